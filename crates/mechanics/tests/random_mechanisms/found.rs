//! Mechanisms that the generator found, with the defects that they showed.
