//! Directions, points in a picture, lenses, and the shapes of the limb.

pub(crate) mod block;
pub mod camera;
pub(crate) mod circle;
pub(crate) mod cone;
pub(crate) mod crop;
pub mod ellipsoid;
pub mod frames;
pub mod pixel;
pub(crate) mod scaling;
pub mod section;
