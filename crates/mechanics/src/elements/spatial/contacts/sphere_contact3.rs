//! Force of a compliant contact of spheres with friction.

use crate::elements::contacts::hunt_crossley;
use crate::elements::spatial::line3::MarkerPair;
use crate::mechanism::element::ElementState;
use crate::mechanism::frame3::Frame3;
use crate::mechanism::vector::{add, dot, scaled, subtract};
use autodiff::Scalar;

/// Parameters of the force in a contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactLaw<T> {
    /// k in N/m^{3/2}.
    pub stiffness: T,
    /// c in s/m.
    pub damping: T,
    /// Coefficient of friction μ.
    pub friction: T,
    /// Transition speed v_s in m/s.
    pub speed: T,
}

impl ContactLaw<f64> {
    /// Describes a radius or parameter that is out of its range.
    pub fn validate(&self, radii: &[(&str, f64)]) -> Option<String> {
        if let Some((name, radius)) = radii.iter().find(|(_, radius)| !(*radius > 0.0)) {
            return Some(format!("its {name} is {radius} m"));
        }
        if !(self.friction >= 0.0) {
            return Some(format!("its coefficient of friction is {}", self.friction));
        }
        if !(self.speed > 0.0) {
            return Some(format!("its transition speed is {} m/s", self.speed));
        }
        hunt_crossley::validate(self.stiffness, self.damping)
    }
}

/// The contact of a body A with a sphere on a body B.
pub(crate) struct SphereContact3<T> {
    ends: MarkerPair<T>,
    /// Unit vector from A to B in world axes.
    normal: [T; 3],
    /// Depth of penetration in m.
    pub depth: T,
    /// Rate of the depth in m/s.
    rate: T,
    /// The point at which the force acts, in m.
    point: [T; 3],
    /// Velocity of B relative to A at this point in the plane of contact, in m/s.
    sliding: [T; 3],
}

impl<T: Scalar> SphereContact3<T> {
    /// The contact with this `normal` and `depth` at a `point` on the normal through the centre of the sphere.
    pub fn new(x: &ElementState<'_, T>, ends: MarkerPair<T>, normal: [T; 3], depth: T, point: [T; 3]) -> Self {
        let velocity = |frame: &Frame3<T>| frame.velocity(x, subtract(point, frame.origin));
        let relative = subtract(velocity(&ends.b.frame), velocity(&ends.a.frame));
        let rate = -dot(normal, relative);
        let sliding = add(relative, scaled(normal, rate));
        Self { ends, normal, depth, rate, point, sliding }
    }

    /// The force along the normal in N.
    pub fn normal_force(&self, law: &ContactLaw<T>, x: &ElementState<'_, T>) -> T {
        hunt_crossley::contact_force(law.stiffness, law.damping, self.depth, self.rate, x.sides)
    }

    /// The friction force on B in N, in world axes: −μ F v/√(v² + v_s²) with the sliding velocity v.
    pub fn friction_force(&self, law: &ContactLaw<T>, x: &ElementState<'_, T>) -> [T; 3] {
        let speed = (dot(self.sliding, self.sliding) + law.speed * law.speed).sqrt();
        scaled(self.sliding, -law.friction * self.normal_force(law, x) / speed)
    }

    /// Adds the forces as rows inertia − force.
    pub fn add_force(&self, law: &ContactLaw<T>, x: &ElementState<'_, T>, rows: &mut [T]) {
        let on_b = add(scaled(self.normal, self.normal_force(law, x)), self.friction_force(law, x));
        let [a, b] = [&self.ends.a.frame, &self.ends.b.frame];
        a.add_force(rows, subtract(self.point, a.origin), on_b);
        b.add_force(rows, subtract(self.point, b.origin), scaled(on_b, T::from(-1.0)));
    }

    /// Components of a vector along the axes of the marker on A.
    pub fn in_axes_of_a(&self, v: [T; 3]) -> [T; 3] {
        self.ends.a.components(v)
    }

    /// Writes the switching functions of the contact.
    pub fn switching_functions(&self, law: &ContactLaw<T>, out: &mut Vec<T>) {
        hunt_crossley::switching_functions(law.damping, self.depth, self.rate, out);
    }
}
