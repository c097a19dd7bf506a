//! The order of the unknowns in a vector.
//!
//! The first is the limb height in kilometres. The changes of the intrinsic parameters follow, then the common shift of
//! all edges and their common shapes in pixels, the local radius in sigmas, and last how the limb height changes with
//! the latitude, in kilometres.
//!
//! A limb is higher and brighter where the Sun is higher, so that its tilt, bend and further shapes change with the
//! side of the Sun. With two sides, the edges with the Sun towards their end have shapes of their own.

use crate::noise::bend::{SHAPES, bend_shape, next_shapes};

/// Number of shapes of an edge that all pictures may have in common: a shift, a tilt, a bend, and the next shapes.
const COMMON: usize = 3 + SHAPES;
/// Number of coefficients of the latitude.
pub(super) const LATITUDE: usize = 2;

/// The order of the unknowns for a number of intrinsic parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of intrinsic parameters.
    pub(super) intrinsics: usize,
    /// Number of sides of the Sun whose edges have shapes of their own: 1 or 2.
    pub(super) sides: usize,
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
    /// Returns the number of common shapes: one shift, and the others for each side.
    pub(super) fn common(self) -> usize {
        1 + (COMMON - 1) * self.sides
    }
    /// Returns the index of each shape of an edge of this side, from 0.
    pub(super) fn shapes(self, side: usize) -> [usize; COMMON] {
        let own = self.first_common() + (COMMON - 1) * side.min(self.sides - 1);
        core::array::from_fn(|i| if i == 0 { self.first_common() } else { own + i })
    }
    /// Returns the index of the local radius.
    pub(super) fn radius(self) -> usize {
        1 + self.intrinsics + self.common()
    }
    /// Returns the index of the first coefficient of the latitude.
    pub(super) fn latitude(self) -> usize {
        self.radius() + 1
    }
    /// Returns the number of unknowns.
    pub(super) fn len(self) -> usize {
        self.latitude() + LATITUDE
    }
}

/// Returns the common shapes at x from −1 (begin of the edge) to 1 (end), each of RMS 1.
pub(super) fn common_shapes(x: f64) -> [f64; COMMON] {
    let [a, b, c] = next_shapes(x);
    [1.0, 3f64.sqrt() * x, bend_shape(x), a, b, c]
}
