//! The window. [`Viewer`] holds the state and decides. `layout` draws it. Every panel has a separate file and only
//! draws.

mod altitude_trial;
mod calibration;
mod calibration_window;
mod camera_card;
mod chips;
mod command;
mod compare;
mod diagnosis;
mod dialogs;
mod facts;
mod focus_ring;
mod follow;
mod help;
mod histogram;
mod layout;
mod links;
mod live;
mod live_view;
mod number;
mod offered;
mod panels;
mod parameters;
mod path_dialog;
mod picture;
mod placement;
mod plots;
mod questions;
mod side;
mod situations;
mod stages;
mod study;
mod study_window;
mod summary;
mod textures;
mod theme;
mod timeline;
mod toast;
mod toasts;
mod top;
mod viewer;
mod wizard;
mod wizard_form;

pub use command::Command;
pub use situations::Situation;
pub use viewer::Viewer;
