//! The window. [`Viewer`] holds the state and decides. Every panel has a separate file and only draws.

mod command;
mod compare;
mod dialogs;
mod facts;
mod help;
mod picture;
mod plots;
mod side;
mod stages;
mod theme;
mod timeline;
mod top;
mod viewer;

pub use command::Command;
pub use viewer::Viewer;
