//! Model files: the same problems as in the library, mistakes and their messages, expressions.

#[cfg(feature = "cli")]
mod browser;
mod commands;
mod documentation;
mod expressions;
mod kinds;
mod mistakes;
#[cfg(feature = "cli")]
mod page;
mod places;
#[cfg(feature = "cli")]
mod report;
mod twins;
