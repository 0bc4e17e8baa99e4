//! Elements of a mechanism: the trait that each implements, its declaration, and its evaluation in every number type.

pub(crate) mod descriptor;
pub(crate) mod evaluation;
pub(crate) mod interface;

pub use descriptor::{ElementDescriptor, Family, Input, Measure, Role, Symbol};
pub use evaluation::{AnyElement, ElementWorkspace, Evaluate, JacobianWorkspace, Observe};
pub use interface::{ConstraintDerivatives, Element, ElementState, Energy, SwitchSides, TangentWeights, Variable};
