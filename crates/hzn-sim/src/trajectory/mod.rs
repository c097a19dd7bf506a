//! Position and attitude of the vehicle over time in the body-fixed frame, and the signals of its sensors.
//!
//! | module | content |
//! |---|---|
//! | `path` | a flight: the state of the vehicle and the pose of its camera over time |
//! | `position` | the choice of the trajectory |
//! | `rocket` | a sounding rocket: two stages, then free fall |
//! | `orbit` | Kepler's ellipse |
//! | `encounter` | a planet or moon from a given range and side |
//! | `table` | positions and attitudes from a CSV file |
//! | `point` | a point of a trajectory |
//! | `attitude` | the rotation of the vehicle |
//! | `earth` | rotation and gravity of the Earth |
//! | `vehicle` | the truth about the vehicle, for vehicle.csv |
//! | [`instruments`] | gyroscopes, accelerometers, satellite navigation receiver |

mod attitude;
mod earth;
mod encounter;
pub mod instruments;
mod orbit;
mod path;
mod point;
mod position;
mod rocket;
mod table;
mod vehicle;

pub use attitude::{Aimed, Attitude, Pointing, Spin, Towards, Tumble};
pub use encounter::Encounter;
pub use orbit::Orbit;
pub use path::{Path, State};
pub use position::Trajectory;
pub use rocket::Rocket;
pub use table::Table;
pub use vehicle::MAX_RATE_HZ;
