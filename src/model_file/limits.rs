//! Sizes beyond which a model file is rejected before any work is done.

/// Bytes of a file.
pub const FILE: usize = 1 << 20;
/// Bytes of a text that a program has written from data in memory.
pub const GENERATED: usize = 1 << 26;
/// Files that a model includes.
pub const FILES: usize = 32;
/// Characters of an expression.
pub const EXPRESSION: usize = 4096;
/// Levels of nested parentheses, signs and powers, and of named expressions that use each other.
pub const NESTING: usize = 64;
/// Operations of a compiled expression, with those of named expressions that it uses.
pub const OPERATIONS: usize = 20_000;
/// Operations of all expressions of a file together.
pub const ALL_OPERATIONS: usize = 5_000_000;
/// Characters of a name in messages and suggestions.
pub const NAME: usize = 64;
/// Named expressions.
pub const NAMES: usize = 1000;
/// Tables under one `[[name]]`, with copies by `each`.
pub const PARTS: usize = 10_000;
/// Design variables.
pub const VARIABLES: usize = 10_000;
/// Outputs times design variables, and outputs times time points.
pub const VALUES: usize = 10_000_000;
/// Time points.
pub const POINTS: usize = 100_000;
/// Constraint values: constraints times their time points.
pub const ROWS: usize = 10_000_000;
/// Time steps of an analysis.
pub const STEPS: f64 = 1e7;
/// Fixed time steps times coordinates: the size of the trajectory that derivatives store.
pub const MOTION: f64 = 3e7;
/// Smallest tolerance of adaptive steps.
pub const TOLERANCE: f64 = 1e-15;
/// Processes of a program at once.
pub const JOBS: usize = 1024;
/// Repetitions of a request to a program.
pub const RETRIES: usize = 1000;
/// Elements of a beam.
pub const ELEMENTS: usize = 1000;
/// Elements of all beams together.
pub const ALL_ELEMENTS: usize = 20_000;
