//! Edge points in blocks of eight lanes, over which the numerical stages loop.
//!
//! A block is a structure of arrays, so that each loop over its lanes becomes vector instructions on targets that have
//! them. A slice of blocks has no capacity in its type, so that stages are compiled once. Sums are kept by lane and
//! added at the end, in the same order on every target.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::camera::ray::Ray;
use crate::geometry::pixel::ImagePoint;

/// Number of lanes of a block.
// Eight lanes of f32 fill two registers of 128 bits or one of 256. The number is the same on every target, because sums
// by lane depend on it in their last bits.
pub(crate) const LANES: usize = 8;
/// Number of lanes for loops with many sums: eight lanes of each sum would not stay in registers.
pub(crate) const HALF_LANES: usize = LANES / 2;

/// Smallest squared derivative of s·e by (u, v), per square pixel, for a division by it. Only empty lanes are smaller.
// The derivative at the limb of a disc of the radius r in pixels is r/f²: 4e-14 for 4 px and a focal length of 1e7 px.
// Its square is 2e-27. The reciprocal of the limit is a number in single precision, too.
pub(crate) const LEAST_GRADIENT2: f64 = 1e-36;

/// The side of an edge point that is lit: the direction of the brightness gradient along the axis (u or v) on which the
/// edge was located.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The numbers are fixed because a block packs the sides of its eight points into 16 bits.
#[repr(u8)]
pub(crate) enum Lit {
    /// The lit side is at larger u.
    Right = 0,
    /// The lit side is at smaller u.
    Left = 1,
    /// The lit side is at larger v.
    Below = 2,
    /// The lit side is at smaller v.
    Above = 3,
}

#[cfg(any(test, feature = "_edges"))]
impl Lit {
    /// Returns the side to which a direction (u, v) in the picture points.
    pub(crate) fn from_gradient<T: Real>(g: [T; 2]) -> Self {
        match (g[0].abs() >= g[1].abs(), g[0] > T::ZERO, g[1] > T::ZERO) {
            (true, true, _) => Self::Right,
            (true, false, _) => Self::Left,
            (false, _, true) => Self::Below,
            (false, _, false) => Self::Above,
        }
    }
    /// Returns the step of one pixel (u, v) towards the light.
    pub(crate) fn step(self) -> [i8; 2] {
        let (dx, dy) = self.towards_dark();
        [-dx as i8, -dy as i8]
    }
}

impl Lit {
    /// Returns the step (dx, dy) away from the light.
    #[inline(always)]
    pub(crate) fn towards_dark(self) -> (i32, i32) {
        match self {
            Self::Right => (-1, 0),
            Self::Left => (1, 0),
            Self::Below => (0, -1),
            Self::Above => (0, 1),
        }
    }
}

/// Eight edge points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block<T> {
    /// Unit rays, x, y, z, in the camera frame. Between the stages edge points and rays, the first two components hold
    /// the image point (u, v).
    // Image points and rays share the memory, because no stage needs both: 608 points of an edge take 4.9 KB less this
    // way.
    pub(crate) s: [[T; LANES]; 3],
    /// Derivatives of the rays, as in [`Ray`].
    pub(crate) m: [[T; LANES]; 4],
    /// Distance along the edge from the previous point, in pixels.
    pub(crate) step_px: [T; LANES],
    /// 1 for a point that may count and 0 for a point that may not; after the fit, the weight of the point in the fit.
    pub(crate) weight: [T; LANES],
    /// The [`Lit`] side, two bits for each lane.
    lit: u16,
}

impl<T: Real> Default for Block<T> {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl<T: Real> Block<T> {
    /// A block without points.
    pub(crate) const EMPTY: Self = Self {
        s: [[T::ZERO; LANES]; 3],
        m: [[T::ZERO; LANES]; 4],
        step_px: [T::ZERO; LANES],
        weight: [T::ZERO; LANES],
        lit: 0,
    };

    // Every lane is masked with 7 instead of checked, so that the index needs no panic path.
    pub(crate) fn set_point(&mut self, lane: usize, p: ImagePoint<T>, lit: Lit) {
        self.s[0][lane & 7] = p.u;
        self.s[1][lane & 7] = p.v;
        self.weight[lane & 7] = T::one();
        self.lit |= (lit as u16) << (2 * (lane & 7));
    }
    pub(crate) fn point(&self, lane: usize) -> ImagePoint<T> {
        ImagePoint { u: self.s[0][lane & 7], v: self.s[1][lane & 7] }
    }
    #[cfg(any(test, feature = "_edges"))]
    pub(crate) fn lit(&self, lane: usize) -> Lit {
        match (self.lit >> (2 * (lane & 7))) & 3 {
            0 => Lit::Right,
            1 => Lit::Left,
            2 => Lit::Below,
            _ => Lit::Above,
        }
    }
    pub(crate) fn set_ray(&mut self, lane: usize, ray: &Ray<T>) {
        let l = lane & 7;
        (self.s[0][l], self.s[1][l], self.s[2][l]) = (ray.s.x, ray.s.y, ray.s.z);
        for k in 0..4 {
            self.m[k][l] = ray.m[k];
        }
    }
    /// Clears a point so that it cannot count: its weight is 0, and its distance from every limb is not finite.
    pub(crate) fn clear(&mut self, lane: usize) {
        let l = lane & 7;
        // The ray is a unit vector and its derivative is 0, so that the distance in pixels is a division by 0 and never
        // small.
        (self.s[0][l], self.s[1][l], self.s[2][l]) = (T::ZERO, T::ZERO, T::one());
        self.m.iter_mut().for_each(|m| m[l] = T::ZERO);
        self.weight[l] = T::ZERO;
    }
    pub(crate) fn ray(&self, lane: usize) -> V3<T> {
        let l = lane & 7;
        V3::new(self.s[0][l], self.s[1][l], self.s[2][l])
    }

    /// Returns the ray with its derivative.
    pub(crate) fn ray_with_derivative(&self, lane: usize) -> Ray<T> {
        Ray { s: self.ray(lane), m: self.m.map(|m| m[lane & 7]) }
    }

    /// Returns the derivative of s·e by (u, v) for each lane, in radians per pixel.
    #[inline(always)]
    pub(crate) fn gradient(&self, e: &V3<T>) -> [[T; LANES]; 2] {
        let mut g = [[T::ZERO; LANES]; 2];
        for l in 0..LANES {
            let [gu, gv] = self.gradient_at(l, e);
            g[0][l] = gu;
            g[1][l] = gv;
        }
        g
    }
    #[inline(always)]
    pub(crate) fn gradient_at(&self, l: usize, e: &V3<T>) -> [T; 2] {
        let (x, y, z) = (self.s[0][l & 7], self.s[1][l & 7], self.s[2][l & 7]);
        // This is the tangent basis of `camera::tangent` times e.
        let w = (x * e.x + y * e.y) / (T::one() + z) + e.z;
        let (a, b) = (e.x - x * w, e.y - y * w);
        [self.m[0][l & 7] * a + self.m[2][l & 7] * b, self.m[1][l & 7] * a + self.m[3][l & 7] * b]
    }

    /// Returns whether the lit side lies towards `e`, as it does on the limb of a body.
    #[inline]
    pub(crate) fn is_lit_towards(&self, l: usize, e: &V3<T>) -> bool {
        self.is_lit_along(l, self.gradient_at(l, e))
    }
    /// Does the same as [`Self::is_lit_towards`], from the gradient.
    #[inline(always)]
    pub(crate) fn is_lit_along(&self, l: usize, [gu, gv]: [T; 2]) -> bool {
        // The side is compared along one axis only, because the point was located along this axis and its sign is sure
        // there.
        match (self.lit >> (2 * (l & 7))) & 3 {
            0 => gu > T::ZERO,
            1 => gu < T::ZERO,
            2 => gv > T::ZERO,
            _ => gv < T::ZERO,
        }
    }
}

/// Returns every `every`-th point that has a weight, from the middle of the first stretch on: its number, its block and
/// its lane. A loop should use `for_each`, which compiles to two plain loops.
pub(crate) fn every_weighted<T: Real>(
    blocks: &[Block<T>],
    every: usize,
) -> impl Iterator<Item = (usize, &Block<T>, usize)> {
    let every = every.max(1);
    // The first chosen point lies in the middle of its stretch, so that the chosen ones are centred on the edge.
    let mut to_pass = every / 2;
    let points = blocks.iter().enumerate().flat_map(|(n, b)| (0..LANES).map(move |l| (n * LANES + l, b, l)));
    points.filter(move |(_, block, lane)| {
        if !(block.weight[lane & 7] > T::ZERO) {
            return false;
        }
        let is_chosen = to_pass == 0;
        to_pass = if is_chosen { every - 1 } else { to_pass - 1 };
        is_chosen
    })
}

/// Adds the lanes in a fixed order.
#[inline(always)]
pub(crate) fn sum<T: Real>(lanes: &[T; LANES]) -> T {
    // The order is that of pairs. Float addition is not associative, so a free order would change the last bits by
    // target.
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// Returns exp(−x) for each lane, x ≥ 0. The lanes are computed together when all x are small, which is usual between
/// neighbouring points of an edge.
#[inline(always)]
pub(crate) fn exp_neg<T: Real>(lanes: &[T; LANES]) -> [T; LANES] {
    // The negated comparison sends NaN to the full function, which returns NaN.
    if lanes.iter().any(|&x| !(x <= T::EXP_SERIES)) {
        return lanes.map(T::exp_neg);
    }
    // A loop: on a flight computer, `map` would not be unrolled.
    let mut out = [T::ZERO; LANES];
    for l in 0..LANES {
        out[l] = lanes[l].exp_neg_series();
    }
    out
}
