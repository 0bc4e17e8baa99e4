//! Identities that every element must satisfy.

use crate::zoo::{Arm, Joints};
use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::sampling::energy;
use linkwright::mechanics::elements::{ElementKind, Family, InputValue, Role, StateFunction, kinds};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::Harmonic;
use linkwright::mechanics::system::state::State;
use linkwright::mechanics::system::{Linearization, System, Unknown};

/// A force that depends on the velocity, for elements with a function of state.
struct Damper;

impl StateFunction for Damper {
    fn generalized_force<T: Scalar>(&self, p: &[T], _t: T, q: &[T], v: &[T]) -> T {
        p[0] * q[0] - v[0]
    }
}

type Kind = ElementKind<Harmonic, Damper>;

/// Two bodies with an element between them, all inputs at their typical values.
fn typical(kind: &Kind) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, 0.0);
    let one = m.body("one", 1.3, 0.2, Pose { x: 0.0, y: 0.0, theta: 0.1 });
    let two = m.body("two", 0.7, 0.1, Pose { x: 1.0, y: 0.2, theta: -0.3 });
    let mut markers = [one.at(0.5, 0.1), two.at(-0.2, -0.1)].into_iter();
    let mut coordinates = [one.theta, two.theta, m.ground().theta].into_iter();
    // A joint in another place than the element, which has its coordinates and reactions.
    let mut joint = |kinds: &[&str]| {
        let (a, b) = (one.at(0.3, 0.2), two.at(0.1, -0.3));
        match kinds[0] {
            "revolute" => m.revolute("joint", a, b),
            "prismatic" => m.prismatic("joint", a, 0.2, b, -0.4),
            other => unreachable!("{other}"),
        }
    };
    let mut value = |role: Role, example: f64| match role {
        Role::Profile => InputValue::Profile(vec![[0.6, 0.0], [0.0, 0.7], [-0.8, 0.0], [0.0, -0.5]]),
        Role::Joint(kinds) => InputValue::Joint(joint(kinds)),
        Role::Marker | Role::Body | Role::Translations => InputValue::Marker(markers.next().unwrap()),
        role @ (Role::Marker3 | Role::Body3 | Role::Translations3) => unreachable!("{role:?} in the plane"),
        Role::Coordinate => InputValue::Coordinate(coordinates.next().unwrap()),
        Role::Parameter | Role::Gravity => InputValue::Parameter(example),
        Role::TimeFunction => InputValue::TimeFunction(Harmonic, vec![0.4, 0.1, 5.0, 0.2]),
        Role::StateFunction => InputValue::StateFunction(Damper, vec![two.x], vec![3.0]),
    };
    let values = kind.descriptor.inputs.iter().map(|input| value(input.role, input.example)).collect();
    kind.add_to(&mut m, kind.descriptor.kind, values);
    m
}

/// A mechanism with every element of model files, and the larger ones of the zoo.
fn mechanisms() -> Vec<Mechanism<f64>> {
    let mut arm = Arm::DESIGN;
    arm[4] = 0.01;
    let zoo = [
        Joints { length_driver: false }.build(&Joints::DESIGN).unwrap(),
        Joints { length_driver: true }.build(&Joints::DESIGN).unwrap(),
        Arm { elements: 3 }.build(&arm).unwrap(),
    ];
    kinds().iter().map(typical).chain(zoo).collect()
}

#[test]
fn declarations_are_consistent() {
    for kind in kinds::<Harmonic, Damper>() {
        let descriptor = kind.descriptor;
        let inputs: Vec<&str> = descriptor.inputs.iter().map(|input| input.name).collect();
        let measures: Vec<&str> = descriptor.measures.iter().map(|measure| measure.name).collect();
        for names in [inputs, measures] {
            assert!((1..names.len()).all(|k| !names[..k].contains(&names[k])), "{}: {names:?}", descriptor.kind);
        }
        for input in descriptor.inputs.iter().filter(|input| input.role == Role::Parameter) {
            assert!(input.default.is_none_or(|value| value.parse::<f64>().is_ok()), "{}", input.name);
        }
    }
}

/// A state away from every symmetry.
fn disturbed(mechanism: &Mechanism<f64>, system: &System) -> State<f64> {
    let mut state = State::built(mechanism, 0.0);
    for unknown in system.unknowns() {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] += 0.01 * (3.0 * i as f64).sin(),
            Unknown::Multiplier(m) => state.l[m] = (1.0 + m as f64).cos(),
        }
    }
    state
}

/// Reactions do no work on motions that the joints allow: the block ∂dynamics/∂λ is the transpose of ∂Φ/∂q.
///
/// Dry friction is left out: while it sticks, its multiplier is a force of its own, and not a reaction in the row of the coordinate
/// that it holds.
#[test]
fn reactions_are_workless() {
    let kinds: Vec<Kind> = kinds();
    let others = kinds.iter().filter(|kind| !kind.has_modes() || kind.is_rigid_contact()).map(typical);
    let zoo = mechanisms().split_off(kinds.len());
    for mechanism in others.chain(zoo) {
        let system = System::new(&mechanism).unwrap();
        let state = disturbed(&mechanism, &system);
        let matrix = system.dense_by_seeding(&mechanism, &state, Linearization::statics());
        for (i, unknown) in system.unknowns().iter().enumerate() {
            if matches!(unknown, Unknown::Multiplier(_)) {
                for j in 0..system.size() {
                    assert!(
                        (matrix[(i, j)] - matrix[(j, i)]).abs() < 1e-14,
                        "{:?} {:?}",
                        unknown,
                        system.unknowns()[j]
                    );
                }
            }
        }
    }
}

/// Forces at rest are the gradient of the potential energy, for all elements but those that are functions of time or state,
/// and contacts.
#[test]
fn conservative_forces_are_gradients_of_the_energy() {
    let is_function = |role: Role| matches!(role, Role::TimeFunction | Role::StateFunction);
    let is_conservative = |kind: &Kind| {
        kind.descriptor.family != Family::Contact && !kind.descriptor.inputs.iter().any(|i| is_function(i.role))
    };
    let mut arm = Arm::DESIGN;
    arm[4] = 0.0;
    let arm = Arm { elements: 3 }.build(&arm).unwrap();
    for mechanism in kinds().iter().filter(|kind| is_conservative(kind)).map(typical).chain([arm]) {
        let mut system = System::new(&mechanism).unwrap();
        let mut state = disturbed(&mechanism, &system);
        state.v.fill(0.0);
        state.l.fill(0.0);
        let mut rows = vec![[0.0]; system.size()];
        system.assemble(&mechanism, &state, Linearization::statics(), &mut rows);
        let largest = rows.iter().fold(0.0f64, |a, r| a.max(r[0].abs()));
        for (row, unknown) in rows.iter().zip(system.unknowns()) {
            let Unknown::Coordinate(i) = *unknown else { continue };
            let at = |step: f64| {
                let mut moved = state.clone();
                moved.q[i] += step;
                energy(&mechanism, &moved)[1]
            };
            let h = 1e-5;
            let derivative = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            assert!((derivative - row[0]).abs() < 1e-6 * largest.max(1.0), "coordinate {i}: {derivative} {}", row[0]);
        }
    }
}

/// Elements are linear in the coordinates that they declare: the matrix that relies on it equals the one that seeds every
/// unknown.
#[test]
fn constant_derivatives_are_constant() {
    for mechanism in mechanisms() {
        let mut system = System::new(&mechanism).unwrap();
        let mut state = disturbed(&mechanism, &system);
        state.t = 0.3;
        state.v.iter_mut().enumerate().for_each(|(i, v)| *v = (2.0 * i as f64).cos());
        state.a.iter_mut().enumerate().for_each(|(i, a)| *a = (5.0 * i as f64).sin());
        let mut rows = vec![[0.0]; system.size()];
        for how in [Linearization::statics(), Linearization::accelerations(), Linearization::step(0.3, 0.7)] {
            let reference = system.dense_by_seeding(&mechanism, &state, how);
            system.assemble(&mechanism, &state, how, &mut rows);
            let error = (system.dense() - &reference).amax();
            assert!(error <= 1e-13 * reference.amax(), "{how:?}: {error:.1e}");
        }
    }
}
