//! The window. [`Viewer`] holds the state and decides. `layout` draws it. Every panel has a separate file and only
//! draws.

mod command;
mod compare;
mod dialogs;
mod facts;
mod help;
mod layout;
mod parameters;
mod path_dialog;
mod picture;
mod placement;
mod plots;
mod side;
mod stages;
mod textures;
mod theme;
mod timeline;
mod top;
mod viewer;

pub use command::Command;
pub use viewer::Viewer;
