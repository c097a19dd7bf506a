//! The screen of the ground station (`hzn-ground`).
//!
//! | file | idea |
//! |---|---|
//! | `view` | what the screen shows |
//! | `screen` | the terminal, the keys and the loop |

mod screen;
mod view;

pub(super) use screen::show;
