//! Random numbers, purposes of mechanisms and motions of drives.

use autodiff::Scalar;
use linkwright_mechanics::mechanism::{Coordinate, Mechanism, ParametricMechanism};
use linkwright_mechanics::motion::{Harmonic, Motion, StartUp};

/// A random mechanism of a class, in the plane or in space. Design variables are some of its numbers.
pub trait RandomModel: ParametricMechanism + Sized {
    /// The mechanism of this class and seed; `None` if no attempt leads to one with independent constraints that moves.
    fn random(class: Class, seed: u64) -> Option<Self>;

    /// Purpose of the mechanism.
    fn class(&self) -> Class;

    /// Values of the design variables.
    fn design(&self) -> Vec<f64>;

    /// True if explicit steps suit it.
    fn is_for_explicit_steps(&self) -> bool {
        self.class() != Class::Flexible
    }

    /// True if joints or forces change in events.
    fn has_events(&self) -> bool {
        false
    }

    /// True if it is checked with the scheme of this number, of several that are alike: explicit steps of orders 5 and 8, or
    /// implicit steps with two kinds of damping.
    fn is_for_scheme(&self, _number: usize) -> bool {
        true
    }
}

/// A generator of pseudo-random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.between(0.0, 1.0) < share
    }
}

/// Purpose of a mechanism: the analyses and checks that suit it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Joints, springs, dampers, loads and drives.
    Rigid,
    /// Without drives and dissipation.
    Conservative,
    /// Conservative, without gravity and not connected to the ground.
    Floating,
    /// With compliant contacts.
    Contact,
    /// With beams.
    Flexible,
    /// With constraints that depend on each other.
    Redundant,
    /// All degrees of freedom driven, for kinematics.
    Driven,
    /// In stable equilibrium with springs, for statics.
    Static,
}

pub const CLASSES: [Class; 8] = [
    Class::Rigid,
    Class::Conservative,
    Class::Floating,
    Class::Contact,
    Class::Flexible,
    Class::Redundant,
    Class::Driven,
    Class::Static,
];

/// q₀ + v t + ½ a t²: p = \[q₀, v, a\].
pub struct Accelerated;

impl Motion for Accelerated {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] + (p[1] + p[2] * t * 0.5) * t
    }
}

/// Motion of a drive.
#[derive(Clone, Copy, Debug)]
pub enum Profile {
    Harmonic,
    Accelerated,
    StartUp,
}

/// Numbers of a motion that begins at `start`.
pub fn random_motion(random: &mut Random, start: f64, size: f64) -> (Profile, Vec<f64>) {
    match random.below(3) {
        0 => {
            let (amplitude, omega, phase) =
                (size * random.between(0.2, 0.6), random.between(2.0, 7.0), random.between(0.2, 1.4));
            (Profile::Harmonic, vec![start - amplitude * f64::sin(phase), amplitude, omega, phase])
        }
        1 => (Profile::Accelerated, vec![start, size * random.between(-1.0, 1.0), size * random.between(1.0, 5.0)]),
        _ => (Profile::StartUp, vec![start, size * random.between(1.0, 4.0), random.between(0.3, 0.9)]),
    }
}

/// Prescribes a coordinate.
pub fn prescribe<S: Scalar>(m: &mut Mechanism<S>, coordinate: Coordinate, profile: Profile, p: &[S]) {
    match profile {
        Profile::Harmonic => m.drive(coordinate, Harmonic, &p[..4]),
        Profile::Accelerated => m.drive(coordinate, Accelerated, &p[..3]),
        Profile::StartUp => m.drive(coordinate, StartUp::Polynomial, &p[..3]),
    }
}
