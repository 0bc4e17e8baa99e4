//! Model files: the same problems as in the library, mistakes and their messages, expressions.

#[cfg(feature = "cli")]
mod browser;
mod commands;
mod derivatives;
mod documentation;
mod edits;
mod expressions;
mod harmless;
mod kinds;
mod mistakes;
#[cfg(feature = "cli")]
mod page;
mod places;
mod refusals;
#[cfg(feature = "cli")]
mod report;
mod robust;
mod runs;
mod shell;
mod twins;
mod version1;
