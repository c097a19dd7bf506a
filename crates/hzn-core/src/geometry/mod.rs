//! Directions, points in a picture, lenses, and the shapes of the limb.

pub(crate) mod block;
pub mod camera;
#[cfg(any(feature = "horace", feature = "zju"))]
pub(crate) mod circle;
pub(crate) mod cone;
#[cfg(feature = "horace")]
pub(crate) mod crop;
pub mod ellipsoid;
pub mod frames;
pub mod pixel;
#[cfg(feature = "position")]
pub(crate) mod scaling;
pub mod section;
