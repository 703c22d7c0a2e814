//! Where people look at scenes and at pictures in the making: windows, the terminal, the viewer tev, and views
//! that scripts drive.

pub mod action;
pub mod heat;
pub mod levels;
pub mod meshes;
pub mod pilot;
pub mod reload;
pub mod script;
pub mod shot;
pub mod stage;
pub mod studio;
pub mod term;
pub mod tev;
pub mod window;
