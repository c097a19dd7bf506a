//! The mounts of the heads of a rig, from the limbs that they see together.
//!
//! At each epoch, all heads see one cone. Head k with the mount R_k measures its axis and the cosine of its half-angle
//! in its own camera. With the tangent basis (c₁, c₂) of the measured axis, the common axis e has the coordinates
//! hᵢ·e in this basis, hᵢ = R_k cᵢ, and they would be zero without errors. A small rotation θ_k of the mount changes
//! them by θ_k·(hᵢ × e).
//!
//! Axes alone would not do: a wrong height of the limb moves the axis of a short arc by 0.1°. Therefore the cosine of
//! each epoch is common to all heads and unknown, and each head has a constant height of its own, with a prior. Axis
//! and cosine of an epoch are eliminated at once, so that only the mounts and the heights remain. A turn of all heads
//! together moves nothing: the first head is held while the equations are solved, and afterwards the mean of all turns
//! is zero.
//!
//! The heads see a turn about the direction to the body only while this direction moves in the vehicle. The covariance
//! of the mounts against their prior says which turns the data determine.

mod adjust;
mod check;
mod epoch;
mod reduced;
#[cfg(test)]
mod tests;

pub use adjust::{Adjusted, Refused, Settings, adjust};
pub use check::{Check, check, noticed};
pub use epoch::{Epoch, Sighting};
