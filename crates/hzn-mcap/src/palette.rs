//! Colours of the annotations, in recordings and in pictures: those of Okabe and Ito, which colour-blind people can
//! distinguish. Each is red, green, blue, from 0 to 255.

/// Candidate edges.
pub const EDGE: [u8; 3] = [86, 180, 233];
/// Inliers: edge points that the answer is fitted to.
pub const INLIER: [u8; 3] = [0, 158, 115];
/// Edge points that were rejected.
pub const REJECTED: [u8; 3] = [213, 94, 0];
/// The fitted limb.
pub const LIMB: [u8; 3] = [240, 228, 66];
/// The point where the axis meets the picture.
pub const AXIS: [u8; 3] = [204, 121, 167];
