//! Andrews' squeezer mechanism.

use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::mechanism::{Body, Marker, Mechanism, ParametricMechanism, Pose};
use mechanics::motion::Fixed;

/// Andrews' squeezer mechanism: seven bodies, ten revolute joints, one spring and a motor of constant torque.
///
/// Design variables: motor torque (N·m), spring stiffness (N/m) and unloaded length (m). Outputs: the seven angles
/// β, Θ, γ, Φ, δ, Ω, ε of the literature (rad).
///
/// # Sources
/// Schiehlen (ed.), *Multibody Systems Handbook* (1990); Hairer & Wanner, *Solving ODEs II*, Section VII.7;
/// data and reference solution of the Bari test set for IVP solvers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Andrews;

/// Masses in kg and moments of inertia in kg·m² of K1 to K7.
const MASS: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const INERTIA: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
/// Ground points A, B and C.
const A: [f64; 2] = [-0.06934, -0.00227];
const B: [f64; 2] = [-0.03635, 0.03273];
const C: [f64; 2] = [0.014, 0.072];
/// Initial β, Θ, γ, Φ, δ, Ω, ε.
const START: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_9,
    0.487_364_979_543_842_55,
    -0.222_668_390_165_885_9,
    1.230_547_444_549_821_2,
];

impl Andrews {
    /// Torque, stiffness and length in the literature.
    pub const DESIGN: [f64; 3] = [0.033, 4530.0, 0.07785];
    /// The seven angles at t = 0.03 s: PSIDE at a tolerance of 1e-14.
    pub const REFERENCE: [f64; 7] = [
        15.810_771_196_299_04,
        -15.756_371_059_842_98,
        0.040_822_240_130_731_01,
        -0.534_730_116_322_694_8,
        0.524_409_965_880_530_4,
        0.534_730_116_322_694_8,
        1.048_080_741_042_263,
    ];
}

/// A body with a pin at `pin` and its centre of mass at the body-fixed offset `centre` from the pin.
struct PinnedBody {
    pin: [f64; 2],
    theta: f64,
    centre: [f64; 2],
}

impl PinnedBody {
    /// Inertial position of the point at the body-fixed offset from the pin.
    fn point(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.theta.sin_cos();
        [self.pin[0] + cos * x - sin * y, self.pin[1] + sin * x + cos * y]
    }

    fn add<S: Scalar>(&self, m: &mut Mechanism<S>, k: usize) -> Body {
        let [x, y] = self.point(self.centre).map(S::from);
        let pose = Pose { x, y, theta: S::from(self.theta) };
        m.body(&format!("K{}", k + 1), S::from(MASS[k]), S::from(INERTIA[k]), pose)
    }

    /// The point at an offset from the pin, as a marker on the body.
    fn marker<S: Scalar>(&self, body: Body, [x, y]: [f64; 2]) -> Marker<S> {
        body.at(S::from(x - self.centre[0]), S::from(y - self.centre[1]))
    }
}

impl ParametricMechanism for Andrews {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        Error::check_length("torque, stiffness and length", 3, b.len())?;
        let mut m = Mechanism::new();
        let ground = m.ground();
        let fixed = |p: [f64; 2]| ground.at(S::from(p[0]), S::from(p[1]));
        let [beta, theta, gamma, phi, delta, omega, epsilon] = START;
        // Link lengths: crank rr, K2 d, K3 ss, K4 e, K5 zt, K6 zf, K7 u.
        let (rr, d, ss, e, zt, zf, u) = (0.007, 0.028, 0.035, 0.02, 0.04, 0.02, 0.04);
        let crank = PinnedBody { pin: [0.0; 2], theta: beta, centre: [0.00092, 0.0] };
        let two = PinnedBody { pin: crank.point([rr, 0.0]), theta: beta + theta, centre: [-0.0115, 0.0] };
        let three = PinnedBody { pin: B, theta: gamma, centre: [0.01874, 0.01043] };
        let five = PinnedBody { pin: A, theta: delta, centre: [0.02308, 0.00916] };
        let four = PinnedBody { pin: five.point([zt, 0.0]), theta: phi + delta, centre: [0.0, -(e - 0.01421)] };
        let seven = PinnedBody { pin: A, theta: epsilon, centre: [0.00449, -0.01228] };
        let six = PinnedBody { pin: seven.point([0.0, -u]), theta: omega + epsilon, centre: [zf - 0.01421, 0.0] };
        let links = [&crank, &two, &three, &four, &five, &six, &seven];
        let body = links.iter().enumerate().map(|(k, link)| link.add(&mut m, k)).collect::<Vec<_>>();
        let at = |k: usize, offset| links[k].marker(body[k], offset);
        let none = [0.0; 2];
        m.revolute("O", fixed(none), at(0, none));
        m.revolute("K1-K2", at(0, [rr, 0.0]), at(1, none));
        m.revolute("B", fixed(B), at(2, none));
        m.revolute("A-K5", fixed(A), at(4, none));
        m.revolute("A-K7", fixed(A), at(6, none));
        m.revolute("K4-K5", at(4, [zt, 0.0]), at(3, none));
        m.revolute("K6-K7", at(6, [0.0, -u]), at(5, none));
        m.revolute("E-K3", at(1, [-d, 0.0]), at(2, [0.0, -ss]));
        m.revolute("E-K4", at(1, [-d, 0.0]), at(3, [0.0, -e]));
        m.revolute("E-K6", at(1, [-d, 0.0]), at(5, [zf, 0.0]));
        m.spring_damper("spring", fixed(C), at(2, [0.02, -0.018]), [b[1], S::from(0.0), b[2]]);
        m.load("motor", ground.theta, body[0].theta, Fixed, &[b[0]]);
        let relative = [
            ("beta", ground.theta, body[0].theta),
            ("Theta", body[0].theta, body[1].theta),
            ("gamma", ground.theta, body[2].theta),
            ("Phi", body[4].theta, body[3].theta),
            ("delta", ground.theta, body[4].theta),
            ("Omega", body[6].theta, body[5].theta),
            ("epsilon", ground.theta, body[6].theta),
        ];
        for (name, a, b) in relative {
            let sensor = m.coordinate_sensor(name, a, b);
            let term = m.measure(sensor, "position")?;
            m.output(name, &[term]);
        }
        Ok(m)
    }
}
