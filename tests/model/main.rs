//! Model files: the same problems as in the library, mistakes and their messages, expressions.

mod any_text;
mod assembly;
#[cfg(feature = "cli")]
mod browser;
mod budget;
mod combinations;
mod commands;
mod database;
mod derivatives;
#[cfg(feature = "app")]
mod devtools;
mod diagnostics;
mod documentation;
mod edits;
mod events;
mod everyday;
mod expressions;
mod folders;
mod forces;
mod frequencies;
mod kinds;
mod limits;
mod mechanics_benchmarks;
mod mistakes;
mod mjcf;
mod notice;
#[cfg(feature = "app")]
mod open;
#[cfg(feature = "app")]
mod open_disk;
#[cfg(feature = "app")]
mod open_drawing;
#[cfg(feature = "app")]
mod open_journey;
#[cfg(feature = "app")]
mod open_page;
#[cfg(feature = "app")]
mod open_results;
#[cfg(feature = "app")]
mod open_steering;
#[cfg(feature = "cli")]
mod page;
mod peak;
mod program;
#[cfg(feature = "cli")]
mod report;
mod robust;
mod runs;
mod scale;
mod shell;
mod space;
mod space_axes;
mod space_results;
mod study;
mod study_kinds;
mod study_units;
mod sweeps;
mod transcripts;
mod twins;
mod units;
mod urdf;
mod verdicts;
mod version1;
mod vocabulary;
mod warnings;
mod wishes;
