//! Trees of bodies in space.
//!
//! Every joint adds its coordinates: angles, displacements, or the Euler parameters of a spherical joint. Free bodies
//! keep their positions and Euler parameters. The seven absolute coordinates of the bodies are computed from them, with
//! unit Euler parameters. Coordinates of joints ([`JointAngle`](crate::elements::spatial::JointAngle) and similar
//! elements) are those of the tree where they have the markers of the joint, and may be prescribed.
//!
//! Euler parameters e among the joint coordinates have four rows: 2 Eᵀ m/|e|² for the moment m of the joint, and e (e·ë + ė·ė), which
//! keeps their length without a multiplier. They and their rates are projected onto |e| = 1 at the end of a step.
//!
//! | file | contents |
//! |---|---|
//! | `topology` | bodies in the order from the ground to the tips |
//! | `joint` | coordinates of one joint, and the motion of its markers |
//! | `rigid` | rigid bodies and point masses |
//! | `placed` | one body at an instant; motions and wrenches |
//! | `sweep` | positions, velocities and accelerations outwards, rows and reactions inwards, any scalar |
//! | `articulated` | factorization of the mass matrix, and its solutions |
//! | `transpose` | derivatives with respect to bodies become those of joints |

pub(crate) mod articulated;
pub(crate) mod joint;
pub(crate) mod placed;
pub(crate) mod rigid;
pub(crate) mod sweep;
pub(crate) mod topology;
pub(crate) mod transpose;

pub(crate) use topology::Space;
