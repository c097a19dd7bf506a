//! A planet, moon or asteroid as an ellipsoid with three semi-axes, lit by the Sun from any side.
//!
//! Positions and directions are in the body-fixed frame: its axes are those of the ellipsoid, its origin is the centre.
//! The equations are in book/theory/simulator.md.

mod body;
mod haze;
mod limb;
mod outline;
mod paint;
mod ring;
mod surface;
mod trials;

pub use body::Ellipsoid;
pub use haze::Haze;
pub use limb::{EllipsoidLimb, LimbArc};
pub use ring::Ring;
pub use surface::{Reflection, Surface};
pub use trials::Trials;

pub(crate) use outline::EllipsoidOutline;
pub(crate) use paint::EllipsoidPainter;
