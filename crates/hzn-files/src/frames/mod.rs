//! `frames.csv`: the prior of every picture.
//!
//! Columns are found by name. Only `file` is required; an empty cell is an unknown value.
//!
//! | column | meaning |
//! |---|---|
//! | `file` | name of the picture in the folder |
//! | `time_s` | time in seconds, any epoch |
//! | `utc` | the same as ISO 8601; it is used if `time_s` is empty |
//! | `altitude_km` | geodetic above WGS-84 for `earth`, else above the radius |
//! | `x_km`, `y_km`, `z_km` | position in ECEF; it overrides the altitude |
//! | `qw`, `qx`, `qy`, `qz` | prior attitude, camera to ECEF |
//! | `attitude_sigma_deg` | 1σ of that attitude, 5 if it is empty; above 30 the attitude is not used |
//! | `sun_x`, `sun_y`, `sun_z` | direction to the Sun in the camera frame |
//! | `rate_x`, `rate_y`, `rate_z` | rate of the camera in its frame, rad/s: rolling shutter, `gates.fixed_edge` |
//! | `camera_temperature_c` | temperature of the camera, °C: `camera.temperature` |

mod check;
mod columns;
mod data;
mod inertial;
mod names;
mod read;

pub use check::altitude_at_km;
pub use columns::{COLUMNS, schema};
pub use data::{FrameData, Frames, Orientation, Unused};
pub use read::{load, load_for, load_vehicle, parse, parse_vehicle};
