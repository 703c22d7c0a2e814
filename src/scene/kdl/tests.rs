//! Tests of the scene format as a whole.
