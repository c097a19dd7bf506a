//! The state and the decisions of the viewer. Everything here is plain Rust and works without a window, also in tests.

pub mod knob;
pub mod mask;
pub mod plane;
pub mod playback;
pub mod rows;
pub mod sequence;
pub mod session;
pub mod settings;
pub mod sheet;
pub mod view;
pub mod whole;

pub use knob::Knob;
pub use mask::MaskEdit;
pub use plane::Plane;
pub use playback::Playback;
pub use rows::ResultHistory;
pub use sequence::{Entry, Place, Sequence};
pub use session::Session;
pub use settings::{Look, Settings};
pub use sheet::Sheet;
pub use view::View;
