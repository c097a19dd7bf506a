//! Rotations that a file has in another order or sense than the expected one.

/// How a quaternion was written that is read as w, x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// As it is read.
    AsRead,
    /// As x, y, z, w.
    ScalarLast,
    /// As the inverse rotation.
    Inverted,
    /// As the inverse rotation, with the scalar last.
    InvertedScalarLast,
}

impl Written {
    /// All ways, the likeliest first.
    pub const ALL: [Self; 4] = [Self::AsRead, Self::ScalarLast, Self::Inverted, Self::InvertedScalarLast];

    /// Returns the rotation that was meant by a quaternion that was read.
    ///
    /// ```
    /// use hzn_files::rotations::Written;
    ///
    /// // The file has x, y, z, w = 0.1, 0.2, 0.3, 0.9.
    /// assert_eq!(Written::ScalarLast.meant([0.1, 0.2, 0.3, 0.9]), [0.9, 0.1, 0.2, 0.3]);
    /// assert_eq!(Written::Inverted.meant([0.9, 0.1, 0.2, 0.3]), [0.9, -0.1, -0.2, -0.3]);
    /// ```
    #[must_use]
    pub fn meant(self, [w, x, y, z]: [f64; 4]) -> [f64; 4] {
        match self {
            Self::AsRead => [w, x, y, z],
            Self::ScalarLast => [z, w, x, y],
            Self::Inverted => [w, -x, -y, -z],
            Self::InvertedScalarLast => [z, -w, -x, -y],
        }
    }
}
