//! Scenes with exact truth for the horizon sensor.
//!
//! A [`Scene`] holds everything that one picture depends on. The rendered [`Picture`] and the truth follow from it,
//! and so do edge points on the limb without rendering. The picture uses the same lens models as the sensor.
//!
//! | module | content |
//! |---|---|
//! | [`scene`] | the camera and the world in front of it |
//! | [`pose`] | position and attitude of the camera |
//! | [`globe`] | the body as an ellipsoid, and its intersection with a ray |
//! | [`ellipsoid`] | planets and moons as ellipsoids: surface, haze, rings, exact limb, random scenes |
//! | [`texture`] | clouds |
//! | [`visible`] | the Earth in sunlight: ground, clouds, air, Sun, Moon |
//! | [`infrared`] | the Earth at 15 µm |
//! | [`radiance`] | a user's table of infrared radiances |
//! | [`optics`] | fall-off and stray light |
//! | [`halves`] | two half pictures, one after the other |
//! | [`motion`] | rotation during a picture |
//! | [`foreground`] | structure of the vehicle in the picture |
//! | `height` | height of the limb by latitude |
//! | `render` | the light on every pixel |
//! | [`image_circle`] | the image circle of the lens in a rendered picture |
//! | [`detector`] | blur, noise, quantisation |
//! | [`picture`] | the rendered picture, and its file |
//! | [`limb`] | the limb as a line in the picture, and edge points on it |
//! | `edge_errors` | the errors of edge points |
//! | [`truth`] | the truth about a scene |
//! | [`scenario`] | a whole sequence in one description: scene.toml, by name or from a file |
//! | [`trajectory`] | rocket, orbit, table; attitude; inertial sensors and satellite navigation receiver |
//! | [`sensitivity`] | covariances by design, without rendering |
//! | [`counter`] | random numbers by index |
//! | [`painted`] | uniform discs that are painted very fast |
//! | [`flight`] | built-in sequences of scenes, with the sensor that takes them |

pub mod counter;
pub mod detector;
mod edge_errors;
pub mod ellipsoid;
pub mod error;
pub mod flight;
pub mod foreground;
#[cfg(feature = "schema")]
mod foreign_schema;
pub mod globe;
pub mod halves;
mod height;
pub mod image_circle;
pub mod infrared;
pub mod limb;
pub mod motion;
pub mod optics;
pub mod painted;
mod painter;
pub mod picture;
pub mod pose;
pub mod radiance;
mod render;
pub mod scenario;
pub mod scene;
pub mod sensitivity;
pub mod texture;
pub mod trajectory;
pub mod truth;
pub mod visible;
mod weather;

pub use detector::{Detector, Tone};
pub use ellipsoid::{Ellipsoid, EllipsoidLimb, Haze, LimbArc, Reflection, Ring, Surface, Trials};
pub use error::SceneError;
pub use flight::{Flight, FlightFrame};
pub use foreground::Foreground;
pub use globe::Globe;
pub use infrared::Infrared;
pub use limb::{EdgeNoise, LimbCircle, LimbPoint};
pub use motion::Motion;
pub use optics::Optics;
pub use picture::{Picture, Samples};
pub use pose::{Look, Pose};
pub use scenario::{Scenario, ScenarioError};
pub use scene::{Band, Disc, Light, Profile, Scene, Sky, World};
pub use texture::Clouds;
pub use visible::Visible;
pub use weather::Weather;
