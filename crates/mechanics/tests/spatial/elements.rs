//! Identities that every spatial element must satisfy.

use autodiff::Scalar;
use linkwright_mechanics::analyses::conservation::is_conservative;
use linkwright_mechanics::analyses::sampling::energy;
use linkwright_mechanics::elements::spatial::{MassProperties3, kinds};
use linkwright_mechanics::elements::{ElementKind, Family, InputValue, Role, StateFunction};
use linkwright_mechanics::mechanism::{Mechanism, Pose3, Rotation};
use linkwright_mechanics::motion::Harmonic;
use linkwright_mechanics::system::state::State;
use linkwright_mechanics::system::{Linearization, System, Unknown};

/// A force that no element here has.
struct Absent;

impl StateFunction for Absent {
    fn generalized_force<T: Scalar>(&self, _p: &[T], t: T, _q: &[T], _v: &[T]) -> T {
        t * 0.0
    }
}

type Kind = ElementKind<Harmonic, Absent>;

/// Two bodies with an element between them, all inputs at their typical values.
fn typical(kind: &Kind) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity3([1.0, -2.0, 3.0]);
    let properties = MassProperties3::principal(1.3, [0.2, 0.25, 0.3]).with_centre([0.1, 0.0, -0.2]);
    let one = m.body3("one", properties, Pose3::new([0.0, 0.1, 0.0], Rotation::about([1.0, 2.0, 3.0], 0.3)));
    let two = m.body3("two", properties, Pose3::new([1.0, 0.2, 0.4], Rotation::about([-1.0, 0.5, 2.0], 0.5)));
    let coordinate = m.coordinate("coordinate", 0.6, 0.0);
    m.inertia("inertia", coordinate, 0.4);
    let turned = Rotation::about([0.3, -0.2, 0.6], 0.4);
    let mut markers = [one.at([0.5, 0.1, 0.2]).turned(turned), two.at([-0.2, -0.1, 0.3]).turned(turned)].into_iter();
    let mut value = |role: Role, example: f64| match role {
        Role::Marker3 | Role::Body3 | Role::Translations3 => InputValue::Marker3(markers.next().unwrap()),
        Role::Coordinate => InputValue::Coordinate(coordinate),
        Role::Parameter | Role::Gravity => InputValue::Parameter(example),
        Role::TimeFunction => InputValue::TimeFunction(Harmonic, vec![0.4, 0.1, 5.0, 0.2]),
        role => unreachable!("{role:?} in space"),
    };
    let values = kind.descriptor.inputs.iter().map(|input| value(input.role, input.example)).collect();
    kind.add_to(&mut m, kind.descriptor.kind, values);
    m
}

/// A state away from every symmetry; Euler parameters have not the length one.
fn disturbed(mechanism: &Mechanism<f64>, system: &System) -> State<f64> {
    let mut state = State::built(mechanism, 0.3);
    for unknown in system.unknowns() {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] += 0.05 * (3.0 * i as f64).sin(),
            Unknown::Multiplier(m) => state.l[m] = (1.0 + m as f64).cos(),
        }
    }
    state.v.iter_mut().enumerate().for_each(|(i, v)| *v = (2.0 * i as f64).cos());
    state.a.iter_mut().enumerate().for_each(|(i, a)| *a = (5.0 * i as f64).sin());
    state
}

#[test]
fn declarations_are_consistent() {
    let mut known: Vec<(Family, &str)> = Vec::new();
    for kind in kinds::<Harmonic, Absent>() {
        let descriptor = kind.descriptor;
        assert!(!known.contains(&(descriptor.family, descriptor.kind)), "{}", descriptor.kind);
        known.push((descriptor.family, descriptor.kind));
        let inputs: Vec<&str> = descriptor.inputs.iter().map(|input| input.name).collect();
        let measures: Vec<&str> = descriptor.measures.iter().map(|measure| measure.name).collect();
        for names in [inputs, measures] {
            assert!((1..names.len()).all(|k| !names[..k].contains(&names[k])), "{}: {names:?}", descriptor.kind);
        }
    }
    assert!(known.len() > 20);
}

/// Reactions do no work on motions that the joints allow: the block ∂dynamics/∂λ is the transpose of ∂Φ/∂q.
#[test]
fn reactions_are_workless() {
    for kind in &kinds() {
        let mechanism = typical(kind);
        let system = System::new(&mechanism).unwrap();
        let state = disturbed(&mechanism, &system);
        let matrix = system.dense_by_seeding(&mechanism, &state, Linearization::statics());
        for (i, unknown) in system.unknowns().iter().enumerate() {
            if matches!(unknown, Unknown::Multiplier(_)) {
                for j in 0..system.size() {
                    let error = (matrix[(i, j)] - matrix[(j, i)]).abs();
                    assert!(
                        error < 2e-14,
                        "{}: {unknown:?} {:?} {error:.1e}",
                        kind.descriptor.kind,
                        system.unknowns()[j]
                    );
                }
            }
        }
    }
}

/// The matrix that relies on declared linear coordinates equals the one that seeds every unknown.
#[test]
fn constant_derivatives_are_constant() {
    for kind in &kinds() {
        let mechanism = typical(kind);
        let mut system = System::new(&mechanism).unwrap();
        let state = disturbed(&mechanism, &system);
        let mut rows = vec![[0.0]; system.size()];
        for how in [Linearization::statics(), Linearization::accelerations(), Linearization::step(0.3, 0.7)] {
            let reference = system.dense_by_seeding(&mechanism, &state, how);
            system.assemble(&mechanism, &state, how, &mut rows);
            let error = (system.dense() - &reference).amax();
            assert!(error <= 1e-13 * reference.amax(), "{} {how:?}: {error:.1e}", kind.descriptor.kind);
        }
    }
}

/// Forces at rest are the gradient of the potential energy, on and off the unit length of the Euler parameters.
#[test]
fn conservative_forces_are_gradients_of_the_energy() {
    let is_load = |kind: &&Kind| kind.descriptor.inputs.iter().any(|input| input.role == Role::TimeFunction);
    for kind in kinds().iter().filter(|kind| !is_load(kind)) {
        let mechanism = typical(kind);
        let mut system = System::new(&mechanism).unwrap();
        let mut state = disturbed(&mechanism, &system);
        state.v.fill(0.0);
        state.a.fill(0.0);
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
            let h = 1e-4;
            let derivative = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
            let error = (derivative - row[0]).abs();
            assert!(error < 1e-9 * largest.max(1.0), "{}, coordinate {i}: {error:.1e}", kind.descriptor.kind);
        }
    }
}

/// Inertia forces do the work of the kinetic energy, and joints none: mechanisms without dampers and loads keep their energy.
#[test]
fn undamped_elements_are_recognized_as_conservative() {
    for kind in &kinds::<Harmonic, Absent>() {
        let is_passive = matches!(kind.descriptor.family, Family::Body | Family::Joint | Family::Beam | Family::Sensor);
        let mechanism = typical(kind);
        let state = State::built(&mechanism, 0.0);
        assert_eq!(is_conservative(&mechanism, &state), is_passive, "{}", kind.descriptor.kind);
    }
}
