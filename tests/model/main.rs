//! Model files: the same problems as in the library, mistakes and their messages, expressions.

mod commands;
mod derivatives;
mod documentation;
mod edits;
mod expressions;
mod harmless;
mod kinds;
mod mistakes;
mod places;
mod refusals;
mod robust;
mod runs;
mod shell;
mod twins;
