//! The four-bar mechanism of [`FourBar`] with rigid links: its limit for infinite stiffness.

use super::mechanism::FourBar;
use crate::Result;
use autodiff::Scalar;
use mechanics::mechanism::{Body, ElementIndex, Mechanism, ParametricMechanism, Pose};

/// Bending moments of [`FourBar`] with rigid links, by inverse dynamics.
///
/// Each link consists of rigid segments, one for each beam element. The moments of the fixed joints between the segments, and
/// the driving torque at the root of the crank, are the bending moments at the nodes; they are zero at revolute joints.
/// Design variables, outputs and settings are those of [`FourBar`]; Young's modulus, shear, damping and step are not used.
///
/// Use it with [`kinematics`](mechanics::analyses::kinematics::kinematics), from rest at time 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFourBar(pub FourBar);

/// A link: its segments and the fixed joints between them.
struct SegmentedLink {
    segments: Vec<Body>,
    joints: Vec<ElementIndex>,
}

impl RigidFourBar {
    /// A straight link between two points.
    fn link<S: Scalar>(&self, m: &mut Mechanism<S>, i: usize, [from, to]: [[f64; 2]; 2], d: S) -> SegmentedLink {
        let (section, count) = (self.0.section(i, d), self.0.elements);
        let length = self.half_segment(i) * 2.0;
        let mass = section.mass * length;
        let inertia = section.inertia * length + mass * (length * length / 12.0);
        let theta = (to[1] - from[1]).atan2(to[0] - from[0]);
        let place = |k: usize, c: usize| S::from(from[c] + (to[c] - from[c]) * (k as f64 + 0.5) / count as f64);
        let body = |k: usize, m: &mut Mechanism<S>| {
            let pose = Pose { x: place(k, 0), y: place(k, 1), theta: S::from(theta) };
            m.body(&format!("link {} segment {}", i + 1, k + 1), mass, inertia, pose)
        };
        let segments: Vec<Body> = (0..count).map(|k| body(k, m)).collect();
        let (half, zero) = (S::from(0.5 * length), S::from(0.0));
        let joint = |(k, pair): (usize, &[Body])| {
            let name = format!("link {} node {}", i + 1, k + 2);
            m.fixed_joint(&name, pair[0].at(half, zero), pair[1].at(-half, zero), zero)
        };
        let joints = segments.windows(2).enumerate().map(joint).collect();
        SegmentedLink { segments, joints }
    }

    /// Half of a segment's length in m.
    fn half_segment(&self, link: usize) -> f64 {
        0.5 * self.0.lengths[link] / self.0.elements as f64
    }
}

impl ParametricMechanism for RigidFourBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let FourBar { ground, gravity: [gx, gy], start_angle, start_up, .. } = self.0;
        self.0.check(b)?;
        let mut m = Mechanism::with_gravity(S::from(gx), S::from(gy));
        let [joint_b, joint_c] = self.0.joints(start_angle)?;
        let [o, d] = [[0.0; 2], [ground, 0.0]];
        let spans = [[o, joint_b], [joint_b, joint_c], [d, joint_c]];
        let links = [0, 1, 2].map(|i| self.link(&mut m, i, spans[i], b[i]));
        let [crank, coupler, rocker] = &links;
        let near = |i: usize, link: &SegmentedLink| link.segments[0].at(S::from(-self.half_segment(i)), S::from(0.0));
        let far = |i: usize, link: &SegmentedLink| {
            let last = link.segments.len() - 1;
            link.segments[last].at(S::from(self.half_segment(i)), S::from(0.0))
        };
        let pivot = m.ground().at(S::from(ground), S::from(0.0));
        m.revolute("O", m.ground().origin(), near(0, crank));
        m.revolute("B", far(0, crank), near(1, coupler));
        m.revolute("C", far(1, coupler), far(2, rocker));
        m.revolute("D", pivot, near(2, rocker));
        let root = crank.segments[0].theta;
        m.drive(root, start_up, &[start_angle, self.0.speed, self.0.start_up_time].map(S::from));
        for (i, link) in links.iter().enumerate() {
            let at_root = (i == 0).then(|| m.driving_force(root).times(S::from(-1.0)));
            m.output(format!("moment {}.1", i + 1), at_root.as_slice());
            for (k, &joint) in link.joints.iter().enumerate() {
                let moment = m.measure(joint, "moment")?.times(S::from(-1.0));
                m.output(format!("moment {}.{}", i + 1, k + 2), &[moment]);
            }
            m.output(format!("moment {}.{}", i + 1, link.segments.len() + 1), &[]);
        }
        Ok(m)
    }
}
