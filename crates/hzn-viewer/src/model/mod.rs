//! The state and the decisions of the viewer. Everything here is plain Rust and works without a window, also in tests.

pub mod atomic_file;
pub mod autosave;
pub mod cause;
pub mod fingerprint;
pub mod histogram;
pub mod image_circle;
pub mod kept_settings;
pub mod lens_residuals;
pub mod live;
pub mod mask;
pub mod navigation;
pub mod plane;
pub mod playback;
pub mod quantity;
pub mod rows;
pub mod sequence;
pub mod session;
pub mod settings;
pub mod sheet;
pub mod sigma_parts;
pub mod slider_range;
pub mod steady_edge;
pub mod view;

pub use hzn_run::diagnosis;

pub use autosave::{Autosave, Unsaved};
pub use fingerprint::Fingerprint;
pub use histogram::Histogram;
pub use image_circle::CircleEdit;
pub use kept_settings::KeptSettings;
pub use lens_residuals::LensResiduals;
pub use live::Live;
pub use mask::MaskEdit;
pub use navigation::Navigation;
pub use plane::Plane;
pub use playback::Playback;
pub use rows::{Processed, ResultHistory};
pub use sequence::{Entry, Place, Sequence};
pub use session::{FileChange, Session};
pub use settings::{Contrast, Look, Settings};
pub use sheet::Sheet;
pub use slider_range::SliderRange;
pub use view::View;
