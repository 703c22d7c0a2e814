//! Where people look at pictures in the making: the terminal, and the viewer tev.

pub mod term;
pub mod tev;
