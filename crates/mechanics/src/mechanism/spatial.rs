//! Placement of bodies in space.

use crate::mechanism::rotation::{Rotation, e_transposed_times};
use crate::mechanism::vector::subtract;
use crate::mechanism::{Body3, Marker3, Mechanism, Pose3};
use autodiff::Scalar;

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
        let ([x, y, z], e) = (self.point(name, pose.position), pose.orientation.parameters());
        Body3 { x, y, z, e: [0, 1, 2, 3].map(|k| self.coordinate(format!("{name}.e{k}"), e[k], S::zero())) }
    }

    /// The marker of a body that has this pose in the world at the start.
    pub fn marker_on(&self, body: Body3, pose: Pose3<S>) -> Marker3<S> {
        let own = self.pose3(body);
        let to_body = own.orientation.inverse();
        let point = to_body.rotate(subtract(pose.position, own.position));
        Marker3 { body, point, orientation: to_body.then(pose.orientation) }
    }

    /// Initial pose of a body.
    pub fn pose3(&self, body: Body3) -> Pose3<S> {
        let position = [body.x, body.y, body.z].map(|c| self.position(c));
        Pose3::new(position, Rotation::euler_parameters(body.e.map(|c| self.position(c))))
    }

    /// Gives the initial velocity (m/s) of the reference point of a body and its angular velocity (rad/s), both in world axes.
    ///
    /// For components ω in the axes of the body, pass `pose.orientation.rotate(ω)`.
    pub fn set_velocity3(&mut self, body: Body3, velocity: [S; 3], angular_velocity: [S; 3]) {
        self.set_point_velocity3(body, velocity);
        self.set_angular_velocity3(body, angular_velocity);
    }

    /// Gives the initial velocity (m/s) of the reference point of a body, in world axes; the angular velocity stays free.
    pub fn set_point_velocity3(&mut self, body: Body3, velocity: [S; 3]) {
        [body.x, body.y, body.z].into_iter().zip(velocity).for_each(|(c, v)| self.set_velocity(c, v));
    }

    /// Gives the initial angular velocity (rad/s) of a body, in world axes; the velocity of its reference point stays free.
    pub fn set_angular_velocity3(&mut self, body: Body3, angular_velocity: [S; 3]) {
        let e = body.e.map(|c| self.position(c));
        let rates = e_transposed_times(&e, angular_velocity).map(|x| x * 0.5);
        body.e.into_iter().zip(rates).for_each(|(c, v)| self.set_velocity(c, v));
    }
}
