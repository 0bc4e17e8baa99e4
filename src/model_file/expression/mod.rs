//! Expressions: text that becomes a number, with exact derivatives.
//!
//! | file | what |
//! |---|---|
//! | `token` | numbers, names, signs, with their places |
//! | `tree` | a parsed expression |
//! | `parse` | precedence: `^` binds to the right and tighter than a sign, `-2^2` is −4 |
//! | `function` | `sin`, `hypot`, `deg`, … |
//! | `names` | what names mean: design variables, constants, other expressions |
//! | `compile` | from a tree to a program: constants folded, named expressions evaluated once |
//! | `program` | operations on a stack, over any scalar |
//!
//! ```
//! use linkwright::model_file::expression::{Inputs, Names, TextPlace, Tree, Wants};
//! let mut names = Names::default();
//! names.design("r");
//! names.constant("h", 2.0);
//! let tree = Tree::parse("pi*r^2*h", TextPlace::from(0))?;
//! let volume = names.compile(&tree, &Wants::DESIGN)?;
//! assert_eq!(volume.value(&Inputs::design(&[3.0])), std::f64::consts::PI * 9.0 * 2.0);
//! # Ok::<(), linkwright::model_file::Diagnostic>(())
//! ```

mod compile;
mod function;
mod names;
mod parse;
mod program;
mod token;
mod tree;

pub use compile::Wants;
pub use function::Function;
pub use names::Names;
pub(crate) use names::check_name;
pub use program::{Inputs, Program};
pub use token::TextPlace;
pub use tree::{Node, Operator, Tree};
