//! Expressions: formulas as text, evaluated over any scalar, with exact derivatives.
//!
//! | file | content |
//! |---|---|
//! | `tree` | a parsed expression with its location |
//! | `function` | `sin`, `hypot`, `deg`, … |
//! | `table` | functions through given points |
//! | `reduction` | `peak`, `mean`, `at`, …: of a history to a number |
//! | `parse` | tokens and precedence: `^` is right-associative and binds tighter than a sign, `-2^2` is −4 |
//! | `names` | definitions of names: design variables, constants, other expressions |
//! | `dimension` | dimensions of expressions: `120 mm` is not an angle |
//! | `compiled` | a compiled expression: operations on a stack, over any scalar |
//! | `compile` | from a tree to operations: constants are folded, named expressions are evaluated once |
//!
//! ```
//! use linkwright::model_file::expression::{Inputs, Names, Scope, TextPlace, ExpressionTree};
//! let mut names = Names::default();
//! names.design("r");
//! names.constant("h", 2.0);
//! let tree = ExpressionTree::parse("pi*r^2*h", TextPlace::from(0))?;
//! let volume = names.compile(&tree, &Scope::DESIGN)?;
//! assert_eq!(volume.value(&Inputs::design(&[3.0])), std::f64::consts::PI * 9.0 * 2.0);
//! # Ok::<(), linkwright::model_file::Diagnostic>(())
//! ```

mod axis;
mod compile;
mod compiled;
mod dimension;
mod function;
mod names;
mod parse;
mod reduction;
mod table;
mod tree;

pub use axis::Axis;
pub use compile::{OtherUnit, Scope};
pub use compiled::{CompiledExpression, DesignDependence, Inputs};
pub use dimension::CYCLES;
pub use function::MathFunction;
pub use names::Names;
pub(crate) use names::check_name;
pub use parse::TextPlace;
pub use reduction::{REDUCTIONS, Reduction};
pub use table::TableFunction;
pub use tree::{ExpressionTree, Node, Operator};
