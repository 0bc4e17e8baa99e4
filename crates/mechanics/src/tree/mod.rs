//! Relative (joint) coordinates of chains, trees and loops, in the plane and in space.
//!
//! Joints connect each body to its parent: a revolute joint adds an angle, a prismatic joint a displacement. The joint coordinates q
//! are the unknowns. Positions, velocities and accelerations of the bodies in the plane are computed from them, so that
//! elements, outputs and derivatives of elements are those of absolute coordinates:
//!
//! $$ \mathbf r(q, v, \dot v) = J^T\,\mathbf r_{abs}\big(\mathbf x(q),\ \dot{\mathbf x},\ \ddot{\mathbf x}\big) = 0 ,\qquad
//!    J = \partial\dot{\mathbf x} / \partial v $$
//!
//! $r_{abs}$ are the rows of all bodies and forces, inertia − force. In open trees there are no constraints and no drift. Joints
//! that close loops are cut: they remain constraints Φ(x(q)) = 0, onto which the ends of steps are projected.
//!
//! | file | contents |
//! |---|---|
//! | `topology` | the tree: bodies in the order from the ground to the tips, and what relative coordinates do not support |
//! | `joint` | one body with its joint: parameters and levers, joint coordinates of given positions |
//! | `placement` | from the ground to the tips: positions, velocities and accelerations of the bodies, any scalar |
//! | `collect` | from the tips to the ground: rows of the joints, wrenches and reactions, any scalar |
//! | `articulated` | from the tips to the ground and back: factorization of the mass matrix, and its solutions |
//! | `linearize` | derivatives of the sweeps in the plane, for many design variables at a time |
//! | `transpose` | from the tips to the ground: derivatives with respect to bodies become those of joints |
//! | `space` | the same for bodies in space |
//! | `cut` | constraints that close loops: Delassus matrix, projection |
//! | `dynamics` | accelerations of the joint coordinates |

pub(crate) mod articulated;
pub(crate) mod collect;
pub(crate) mod cut;
pub(crate) mod dynamics;
pub(crate) mod joint;
pub(crate) mod linearize;
pub(crate) mod placement;
pub(crate) mod space;
pub(crate) mod topology;
pub(crate) mod transpose;

pub(crate) use dynamics::TreeDynamics;
pub(crate) use topology::Tree;

/// The error of a part that relative coordinates do not support.
pub(crate) fn unsupported(what: &str, why: &str) -> crate::Error {
    crate::Error::unsupported(what, why, "use absolute coordinates, or leave the choice automatic")
}
