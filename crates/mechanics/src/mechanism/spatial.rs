//! Bodies, markers and poses in space, and their placement in a mechanism.

use crate::mechanism::element::ElementState;
use crate::mechanism::rotation::{Rotation, e_transposed_times};
use crate::mechanism::vector::add;
use crate::mechanism::{Coordinate, Mechanism};
use autodiff::{Jet2, Scalar};

/// A rigid body or frame in space: the position of its reference point and Euler parameters of its orientation.
///
/// The Euler parameters e = (e₀, e₁, e₂, e₃), scalar first, have the length one by a constraint of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body3 {
    /// Position of the reference point along x.
    pub x: Coordinate,
    /// Position of the reference point along y.
    pub y: Coordinate,
    /// Position of the reference point along z.
    pub z: Coordinate,
    /// Euler parameters, scalar first.
    pub e: [Coordinate; 4],
}

impl Body3 {
    /// The seven coordinates.
    pub fn coordinates(self) -> [Coordinate; 7] {
        let [e0, e1, e2, e3] = self.e;
        [self.x, self.y, self.z, e0, e1, e2, e3]
    }

    /// The marker at the point with the body-fixed coordinates `point` (m), with the axes of the body.
    pub fn at<S: Scalar>(self, point: [S; 3]) -> Marker3<S> {
        Marker3 { body: self, point, orientation: Rotation::identity() }
    }

    /// The marker at the reference point, with the axes of the body.
    pub fn origin<S: Scalar>(self) -> Marker3<S> {
        self.at([S::zero(); 3])
    }
}

/// A point fixed to a body in space, with axes x, y, z fixed to the body.
///
/// Joints use the axes: a revolute joint turns about z, a prismatic joint slides along z.
#[derive(Clone, Copy, Debug)]
pub struct Marker3<S> {
    /// The body.
    pub body: Body3,
    /// Body-fixed coordinates of the point in m.
    pub point: [S; 3],
    /// Orientation of the marker's axes relative to the body.
    pub orientation: Rotation<S>,
}

impl<S: Scalar> Marker3<S> {
    /// The marker with its axes turned by `rotation`, relative to its present axes.
    pub fn turned(self, rotation: Rotation<S>) -> Self {
        Self { orientation: self.orientation.then(rotation), ..self }
    }

    /// The marker with its z-axis along `axis` (components in the axes of the body); see [`Rotation::z_along`].
    pub fn with_z(self, axis: [S; 3]) -> Self {
        Self { orientation: Rotation::z_along(axis), ..self }
    }

    /// The marker with its z-axis along `z` and its x-axis near `x` (components in the axes of the body).
    pub fn with_z_x(self, z: [S; 3], x: [S; 3]) -> Self {
        Self { orientation: Rotation::from_z_x(z, x), ..self }
    }

    /// Parameters of the marker in an element: the point and the Euler parameters of its orientation.
    pub fn parameters(self) -> [S; 7] {
        let ([x, y, z], [e0, e1, e2, e3]) = (self.point, self.orientation.parameters());
        [x, y, z, e0, e1, e2, e3]
    }
}

/// Position (m) and orientation of a body in space.
#[derive(Clone, Copy, Debug)]
pub struct Pose3<S> {
    /// Position of the reference point in m.
    pub position: [S; 3],
    /// Orientation of the body's axes.
    pub orientation: Rotation<S>,
}

impl<S: Scalar> Pose3<S> {
    /// The pose at `position` (m) with the given orientation.
    pub fn new(position: [S; 3], orientation: Rotation<S>) -> Self {
        Self { position, orientation }
    }

    /// The pose at `position` (m) with the axes of the world.
    pub fn at(position: [S; 3]) -> Self {
        Self::new(position, Rotation::identity())
    }

    /// World coordinates of the point with the body-fixed coordinates `point` (m), to place one part on another.
    pub fn point(&self, point: [S; 3]) -> [S; 3] {
        add(self.position, self.orientation.rotate(point))
    }
}

/// A coordinate whose initial value follows from those of other coordinates, such as the angle of a joint.
pub(crate) struct DependentCoordinate<S> {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Coordinates that it depends on.
    pub coordinates: Vec<Coordinate>,
    /// Parameters that it depends on.
    pub parameters: Vec<S>,
    /// Its value along a motion.
    pub value: fn(&ElementState<'_, Jet2<S>>) -> Jet2<S>,
}

impl<S: Scalar> Mechanism<S> {
    /// A mechanism with the gravitational acceleration `gravity` (m/s²) for its bodies, for spatial mechanisms.
    pub fn with_gravity3(gravity: [S; 3]) -> Self {
        Self { gravity, ..Self::new() }
    }

    /// The ground of spatial mechanisms: a body at rest at the origin, with the axes of the world.
    ///
    /// The first call adds it.
    pub fn ground3(&mut self) -> Body3 {
        if let Some(ground) = self.ground3 {
            return ground;
        }
        let ground = self.fixed_frame3("ground3", Pose3::at([S::zero(); 3]));
        self.ground3 = Some(ground);
        ground
    }

    /// Coordinates of the ground of spatial mechanisms, if there is one.
    pub(crate) fn ground3_coordinates(&self) -> Option<[usize; 7]> {
        self.ground3.map(|ground| ground.coordinates().map(|coordinate| coordinate.0))
    }

    /// Adds a frame at rest in space.
    pub fn fixed_frame3(&mut self, name: &str, pose: Pose3<S>) -> Body3 {
        let frame = self.coordinates3(name, pose);
        frame.coordinates().into_iter().for_each(|c| self.fix(c));
        frame
    }

    /// The seven coordinates of a body.
    pub(crate) fn coordinates3(&mut self, name: &str, pose: Pose3<S>) -> Body3 {
        let (zero, e) = (S::zero(), pose.orientation.parameters());
        let [x, y, z] = pose.position;
        Body3 {
            x: self.coordinate(format!("{name}.x"), x, zero),
            y: self.coordinate(format!("{name}.y"), y, zero),
            z: self.coordinate(format!("{name}.z"), z, zero),
            e: [0, 1, 2, 3].map(|k| self.coordinate(format!("{name}.e{k}"), e[k], zero)),
        }
    }

    /// Initial pose of a body.
    pub fn pose3(&self, body: Body3) -> Pose3<S> {
        let position = [body.x, body.y, body.z].map(|c| self.position(c));
        Pose3::new(position, Rotation::euler_parameters(body.e.map(|c| self.position(c))))
    }

    /// Sets the initial velocity (m/s) of the reference point of a body and its angular velocity (rad/s), both in world axes.
    ///
    /// For components ω in the axes of the body, pass `pose.orientation.rotate(ω)`.
    pub fn set_velocity3(&mut self, body: Body3, velocity: [S; 3], angular_velocity: [S; 3]) {
        let e = body.e.map(|c| self.position(c));
        let rates = e_transposed_times(&e, angular_velocity).map(|x| x * 0.5);
        let all = velocity.into_iter().chain(rates);
        body.coordinates().into_iter().zip(all).for_each(|(c, v)| self.coordinates[c.0].velocity = v);
        self.update_dependents();
    }

    /// Adds a coordinate with the initial position and velocity that follow from `coordinates` and `parameters` by `value`.
    ///
    /// The velocity is computed again when other initial velocities are set.
    pub(crate) fn dependent_coordinate(
        &mut self,
        name: &str,
        coordinates: &[Coordinate],
        parameters: &[S],
        value: fn(&ElementState<'_, Jet2<S>>) -> Jet2<S>,
    ) -> Coordinate {
        let coordinate = self.coordinate(name, S::zero(), S::zero());
        let (coordinates, parameters) = (coordinates.to_vec(), parameters.to_vec());
        let dependent = DependentCoordinate { coordinate, coordinates, parameters, value };
        self.coordinates[coordinate.0].position = self.at_start(&dependent).re;
        self.dependents.push(dependent);
        self.update_dependents();
        coordinate
    }

    /// Computes the initial velocities of dependent coordinates.
    pub(crate) fn update_dependents(&mut self) {
        for k in 0..self.dependents.len() {
            let dependent = &self.dependents[k];
            let velocity = self.at_start(dependent).v1;
            self.coordinates[dependent.coordinate.0].velocity = velocity;
        }
    }

    /// Initial position and velocity of a dependent coordinate.
    fn at_start(&self, dependent: &DependentCoordinate<S>) -> Jet2<S> {
        let zero = S::zero();
        let jet = |c: &Coordinate| Jet2::new(self.coordinates[c.0].position, self.coordinates[c.0].velocity, zero);
        let q: Vec<_> = dependent.coordinates.iter().map(jet).collect();
        let p: Vec<_> = dependent.parameters.iter().map(|&p| Jet2::new(p, zero, zero)).collect();
        let still = vec![Jet2::new(zero, zero, zero); q.len()];
        let x = ElementState { t: still[0], p: &p, q: &q, v: &still, a: &still, l: &[] };
        (dependent.value)(&x)
    }
}
