//! Papers whose tables are regenerated and put beside the printed ones.

pub mod etman_1998;
