//! What each kind of annotation looks like, in recordings and in pictures alike: the colours of Okabe and Ito, which
//! stay apart for colour-blind eyes. Red, green, blue, 0 to 255.

/// Candidate edges.
pub const EDGE: [u8; 3] = [86, 180, 233];
/// Edge points that carry the answer.
pub const INLIER: [u8; 3] = [0, 158, 115];
/// Edge points that were rejected.
pub const REJECTED: [u8; 3] = [213, 94, 0];
/// The fitted limb.
pub const LIMB: [u8; 3] = [240, 228, 66];
/// Where the axis meets the picture.
pub const AXIS: [u8; 3] = [204, 121, 167];
