//! Free and heavy tops and the spherical pendulum, compared with closed forms and conservation laws.

use crate::{accurate, follows, in_both_coordinates, times, watch};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::{EulerSequence, Pose3, Rotation};
use linkwright_mechanics::{Dynamics, Mechanism, Result, simulate, simulate_explicitly};

/// Jacobi's elliptic functions sn, cn and dn of `u` for the modulus `k`, by the arithmetic-geometric mean.
///
/// # Sources
/// Abramowitz & Stegun, *Handbook of Mathematical Functions* (1964), Section 16.4.
fn jacobi(u: f64, k: f64) -> [f64; 3] {
    let (mut a, mut c, mut b) = (vec![1.0], vec![k], (1.0 - k * k).sqrt());
    while c.last().unwrap() / a.last().unwrap() > 1e-16 && a.len() < 20 {
        let (x, y) = (*a.last().unwrap(), b);
        a.push(0.5 * (x + y));
        c.push(0.5 * (x - y));
        b = (x * y).sqrt();
    }
    let n = a.len() - 1;
    let mut phi = 2f64.powi(n as i32) * a[n] * u;
    for j in (1..=n).rev() {
        phi = 0.5 * (phi + (c[j] / a[j] * phi.sin()).asin());
    }
    let (sn, cn) = phi.sin_cos();
    [sn, cn, (1.0 - k * k * sn * sn).sqrt()]
}

/// A free rigid body that starts with the angular velocity (ω₁, 0, ω₃) along its axes.
struct FreeTop {
    moments: [f64; 3],
    omega: [f64; 3],
}

impl FreeTop {
    /// Angular velocity along the axes of the body.
    ///
    /// # Sources
    /// Landau & Lifshitz, *Mechanics* (1976), Section 37.
    fn closed_form(&self, t: f64) -> [f64; 3] {
        let ([i1, i2, i3], [w1, _, w3]) = (self.moments, self.omega);
        let energy = i1 * w1 * w1 + i3 * w3 * w3;
        let momentum = (i1 * w1).powi(2) + (i3 * w3).powi(2);
        let (p, q) = (energy * i3 - momentum, momentum - energy * i1);
        let modulus = ((i2 - i1) * p / ((i3 - i2) * q)).sqrt();
        let rate = ((i3 - i2) * q / (i1 * i2 * i3)).sqrt();
        let [sn, cn, dn] = jacobi(rate * t, modulus);
        [w1 * cn, (p / (i2 * (i3 - i2))).sqrt() * sn, w3 * dn]
    }

    /// Outputs: angular velocity along the axes of the body, then the unit vectors of the body, then the energy.
    fn build(&self) -> Result<Mechanism<f64>> {
        let mut m = Mechanism::new();
        let orientation = Rotation::about([1.0, -2.0, 0.5], 0.8);
        let body = m.body3("top", MassProperties3::principal(2.0, self.moments), Pose3::new([0.0; 3], orientation));
        m.set_velocity3(body, [0.0; 3], orientation.rotate(self.omega));
        let sensor = m.sensor3("spin", body.origin());
        watch(&mut m, sensor, &["own_omega_x", "own_omega_y", "own_omega_z"])?;
        for k in 0..3 {
            let point = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
            let sensor = m.sensor3("axis", body.at(point));
            watch(&mut m, sensor, &["x", "y", "z"])?;
        }
        let energy = m.kinetic_energy();
        m.output("energy", &[energy]);
        Ok(m)
    }

    /// Largest change of the angular momentum in world axes, and of the energy, as fractions.
    fn drift(&self, values: &[Vec<f64>]) -> [f64; 2] {
        let momentum = |p: usize, world: usize| -> f64 {
            (0..3).map(|k| self.moments[k] * values[k][p] * values[3 + 3 * k + world][p]).sum()
        };
        let size = (0..3).map(|k| momentum(0, k).powi(2)).sum::<f64>().sqrt();
        let mut worst = [0.0f64; 2];
        for p in 0..values[0].len() {
            for world in 0..3 {
                worst[0] = worst[0].max((momentum(p, world) - momentum(0, world)).abs() / size);
            }
            worst[1] = worst[1].max((values[12][p] / values[12][0] - 1.0).abs());
        }
        worst
    }
}

#[test]
fn free_tops_follow_elliptic_functions() {
    let tumbling = FreeTop { moments: [1.0, 2.0, 2.8], omega: [1.5, 0.0, 1.2] };
    // Dzhanibekov: the rotation is about the intermediate axis but for short flips.
    let flipping = FreeTop { moments: [1.0, 2.0, 3.0], omega: [1.0, 0.0, 0.5775] };
    // Near the separatrix, errors grow exponentially on the way to the next flip.
    for (name, top, end, tolerance) in [("tumbling", tumbling, 20.0, 1e-8), ("flipping", flipping, 40.0, 2e-7)] {
        let at = times(end, 200);
        for (coordinates, settings) in in_both_coordinates() {
            let run = simulate_explicitly(&top.build().unwrap(), &settings, &at).unwrap();
            for k in 0..3 {
                let label = format!("{name}, {coordinates} coordinates, ω{}", k + 1);
                follows(&label, &at, &run.values[k], |t| top.closed_form(t)[k], tolerance);
            }
            let [momentum, energy] = top.drift(&run.values);
            println!("{name}, {coordinates} coordinates: momentum {momentum:.1e}, energy {energy:.1e}");
            assert!(momentum < 1e-9 && energy < 1e-9);
        }
    }
}

#[test]
fn the_intermediate_axis_flips() {
    let top = FreeTop { moments: [1.0, 2.0, 3.0], omega: [1.0, 0.0, 0.5775] };
    let run = simulate_explicitly(&top.build().unwrap(), &accurate(), &times(40.0, 800)).unwrap();
    let signs: Vec<bool> = run.values[1].iter().map(|w| *w > 0.0).collect();
    let flips = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(flips >= 2, "{flips}");
}

#[test]
fn implicit_steps_have_order_two_on_a_free_top() {
    let top = FreeTop { moments: [1.0, 2.0, 2.8], omega: [1.5, 0.0, 1.2] };
    let mechanism = top.build().unwrap();
    let error = |h: f64| {
        let run = simulate(&mechanism, &Dynamics::fixed(h), &[4.0]).unwrap();
        let exact = top.closed_form(4.0);
        (0..3).map(|k| (run.values[k][0] - exact[k]).abs()).fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(0.02), error(0.01));
    println!("errors {coarse:.1e} and {fine:.1e}: order {:.2}", (coarse / fine).log2());
    assert!(fine < 2e-3 && ((coarse / fine).log2() - 2.0).abs() < 0.2);
}

/// A symmetric top on a fixed point: A θ̇ and C about its axis, the centre of mass at a distance l.
///
/// Steady precession Ω at the inclination θ needs the spin ω₃ about the axis with C ω₃ Ω − A Ω² cos θ = m g l.
///
/// # Sources
/// Goldstein, *Classical Mechanics* (1980), Section 5.7.
#[test]
fn a_heavy_top_precesses_steadily() {
    let (mass, g, l, j, c) = (0.8, 9.81, 0.12, 2.0e-3, 1.5e-3);
    let (theta, precession) = (0.6f64, 3.0);
    let a = j + mass * l * l;
    let spin = (mass * g * l + a * precession * precession * theta.cos()) / (c * precession);
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let orientation = Rotation::euler_angles(EulerSequence::Zxz, [0.2, theta, 0.0]);
    let properties = MassProperties3::principal(mass, [j, j, c]).with_centre([0.0, 0.0, l]);
    let top = m.body3("top", properties, Pose3::new([0.0; 3], orientation));
    // ω = Ω z + ψ̇ z′, with ω₃ = ψ̇ + Ω cos θ.
    let own = spin - precession * theta.cos();
    let [x, y, z] = orientation.rotate([0.0, 0.0, own]);
    m.set_velocity3(top, [0.0; 3], [x, y, z + precession]);
    let pivot = m.spherical("pivot", ground.origin(), top.origin());
    let angles = m.euler_angle_sensor("angles", ground.origin(), top.origin(), EulerSequence::Zxz);
    watch(&mut m, angles, &["first", "second"]).unwrap();
    watch(&mut m, pivot, &["force_z", "force"]).unwrap();
    let at = times(0.9, 90);
    // The centre of mass moves on a horizontal circle of radius l sin θ.
    let centripetal = mass * precession * precession * l * theta.sin();
    for (coordinates, settings) in in_both_coordinates() {
        let run = simulate_explicitly(&m, &settings, &at).unwrap();
        follows(&format!("precession, {coordinates}"), &at, &run.values[0], |t| 0.2 + precession * t, 1e-9);
        follows(&format!("nutation, {coordinates}"), &at, &run.values[1], |_| theta, 1e-9);
        follows(&format!("vertical force, {coordinates}"), &at, &run.values[2], |_| mass * g, 1e-7);
        follows(&format!("force, {coordinates}"), &at, &run.values[3], |_| (mass * g).hypot(centripetal), 1e-7);
    }
}

#[test]
fn a_conical_pendulum_goes_round_at_its_speed() {
    let (g, l, theta) = (9.81f64, 0.7, 0.9f64);
    let (rate, radius) = ((g / (l * theta.cos())).sqrt(), l * theta.sin());
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let mass = m.point_mass3("mass", 1.3, [radius, 0.0, -l * theta.cos()]);
    m.set_velocity(mass.y, rate * radius);
    let rod = m.distance_constraint3("rod", ground.origin(), mass.origin(), l);
    let sensor = m.sensor3("sensor", mass.origin());
    watch(&mut m, sensor, &["x", "y", "z"]).unwrap();
    watch(&mut m, rod, &["tension"]).unwrap();
    let at = times(5.0, 50);
    for (name, run, tolerance) in [
        ("explicit", simulate_explicitly(&m, &accurate(), &at), 1e-8),
        ("implicit", simulate(&m, &Dynamics::fixed(1e-3), &at), 2e-3),
    ] {
        let run = run.unwrap();
        follows(&format!("{name}, x"), &at, &run.values[0], |t| radius * (rate * t).cos(), tolerance);
        follows(&format!("{name}, y"), &at, &run.values[1], |t| radius * (rate * t).sin(), tolerance);
        follows(&format!("{name}, z"), &at, &run.values[2], |_| -l * theta.cos(), tolerance);
        follows(&format!("{name}, tension"), &at, &run.values[3], |_| 1.3 * g / theta.cos(), 20.0 * tolerance);
    }
}

/// A spherical pendulum released sideways: the turning heights are the roots of a cubic.
#[test]
fn a_spherical_pendulum_turns_where_energy_and_momentum_say() {
    let (g, l, height, speed) = (9.81, 1.0, -0.5f64, 1.5);
    let radius = (l * l - height * height).sqrt();
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let properties = MassProperties3::principal(1.0, [1e-9; 3]);
    let pose = Pose3::new([0.0; 3], Rotation::about_y(-(radius / l).asin()));
    let bob = m.body3("bob", properties.with_centre([0.0, 0.0, -l]), pose);
    m.set_velocity3(bob, [0.0; 3], [0.0, 0.0, speed / radius]);
    m.spherical("pivot", ground.origin(), bob.origin());
    let sensor = m.sensor3("sensor", bob.at([0.0, 0.0, -l]));
    watch(&mut m, sensor, &["x", "y", "z", "vx", "vy"]).unwrap();
    let at = times(6.0, 3000);
    for (coordinates, settings) in in_both_coordinates() {
        let run = simulate_explicitly(&m, &settings, &at).unwrap();
        let [x, y, z, vx, vy] = [0, 1, 2, 3, 4].map(|k| &run.values[k]);
        let momentum = |p: usize| x[p] * vy[p] - y[p] * vx[p];
        for p in 0..at.len() {
            assert!((momentum(p) - radius * speed).abs() < 1e-7);
        }
        // l² ż² = 2 (E − g z)(l² − z²) − h² with the energy E and the momentum h, both per mass.
        let energy = 0.5 * speed * speed + g * height;
        let rate = |z: f64| 2.0 * (energy - g * z) * (l * l - z * z) - (radius * speed).powi(2);
        let (lowest, highest) = (z.iter().copied().fold(0.0, f64::min), z.iter().copied().fold(-1.0, f64::max));
        println!(
            "{coordinates} coordinates: turning heights {lowest} and {highest}: {:.1e} and {:.1e}",
            rate(lowest),
            rate(highest)
        );
        // Sampled at 2 ms, the extremes are missed by at most ½ z̈ (1 ms)².
        assert!((highest - height).abs() < 1e-5 && lowest < height - 0.1);
        assert!(rate(lowest).abs() < 1e-4 && rate(highest).abs() < 1e-4);
    }
}
