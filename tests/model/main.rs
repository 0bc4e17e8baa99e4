//! Model files: the same problems as in the library, mistakes and their messages, expressions.

mod commands;
mod documentation;
mod expressions;
mod kinds;
mod mistakes;
mod places;
mod robust;
mod runs;
mod shell;
mod twins;
