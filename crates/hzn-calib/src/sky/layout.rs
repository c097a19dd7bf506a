//! The order of the unknowns in a vector.
//!
//! The first is the limb height in kilometres. The changes of the intrinsic parameters follow, then the common shift of
//! all edges and their common shapes in pixels, and last the local radius in sigmas.

use crate::noise::bend::{SHAPES, bend_shape, next_shapes};

/// Number of shapes of an edge that all pictures may have in common: a shift, a tilt, a bend, and the next shapes.
pub(super) const COMMON: usize = 3 + SHAPES;

/// The order of the unknowns for a number of intrinsic parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of intrinsic parameters.
    pub(super) intrinsics: usize,
}

impl Layout {
    /// Index of the limb height.
    pub(super) const HEIGHT: usize = 0;

    /// Returns the index of the first intrinsic parameter.
    pub(super) fn first_intrinsic(self) -> usize {
        1
    }
    /// Returns the index of the common shift; the other common shapes follow.
    pub(super) fn first_common(self) -> usize {
        1 + self.intrinsics
    }
    /// Returns the index of the local radius.
    pub(super) fn radius(self) -> usize {
        1 + self.intrinsics + COMMON
    }
    /// Returns the number of unknowns.
    pub(super) fn len(self) -> usize {
        2 + self.intrinsics + COMMON
    }
}

/// Returns the common shapes at x from −1 (begin of the edge) to 1 (end), each of RMS 1.
pub(super) fn common_shapes(x: f64) -> [f64; COMMON] {
    let [a, b, c] = next_shapes(x);
    [1.0, 3f64.sqrt() * x, bend_shape(x), a, b, c]
}
