//! The plateaus on both sides of an edge, and where the brightness crosses the middle between them.

use super::point::Aside;
use super::reads::{Around, Line, UNSEEN, Walk};
use crate::base::real::Real;
use crate::image::{Pixels, Profile};
use crate::model::observer::Observer;
use crate::model::tone::Curve;

/// Largest distance up to which a plateau is searched for, in steps.
pub(super) const REACH: i32 = 10;

/// A lit plateau counts as clipped if it is at most 1/128 of full scale below full scale. This leaves room for JPEG
/// artefacts. A bright, noisy plateau that is not clipped seldom comes so near to full scale.
const CLIPPED_PART: i32 = 128;

/// Crossing of an edge with the mid-level.
pub(super) struct Crossing<T> {
    /// Distance from the border pixel towards the dark, in steps.
    pub(super) part: T,
    /// Twice the mid-level, in units of [`Line::smoothed`].
    pub(super) mid2: i32,
    /// Whether the threshold of the picture replaces the local mid-level.
    pub(super) fallback: bool,
    /// Whether the lit side is clipped at full scale.
    pub(super) clipped: bool,
    /// Whether the lit side did not level off within reach.
    pub(super) rising: bool,
}

impl<T: Real, P: Pixels, O: Observer<T>, const FREE: bool> Line<'_, '_, '_, T, P, O, FREE> {
    /// Reads one step after another in the direction `out`, beginning `k` steps towards the dark.
    #[inline(always)]
    fn outwards(&self, k: i32, out: i32) -> Walk<'_, '_, T, P, O, FREE> {
        let Around { binary, x, y, index, .. } = *self.around;
        let (dx, dy) = self.step;
        Walk {
            binary,
            at: (x + k * dx, y + k * dy),
            step: (out * dx, out * dy),
            index: index.wrapping_add_signed(k as isize * self.ahead),
            ahead: out as isize * self.ahead,
        }
    }

    /// Returns the brightness of a plateau, in units of [`Line::smoothed`], and the offset in steps where it begins.
    /// The search begins at the border pixel (or its dark neighbour) with brightness `v` and goes outwards until the
    /// profile levels off. It has levelled off if each of two more steps changes it by less than a twelfth of the
    /// contrast to `other`.
    #[inline(always)]
    fn plateau<const LIT: bool>(&self, mut v: i32, other: i32) -> (i32, i32) {
        let (from, out) = if LIT { (0, -1) } else { (1, 1) };
        // Difference between `v` and `w`, positive if `v` is further from the brightness of the other side.
        let beyond = |v: i32, w: i32| if LIT { v - w } else { w - v };
        // The side ends where nothing can be read.
        let or_here = |seen: i32, v: i32| if FREE || seen != UNSEEN { seen } else { v };
        let mut k = from;
        let mut outwards = self.outwards(from + out, out);
        let (mut near, mut far) = (outwards.next(), outwards.next());
        loop {
            let (n, f) = (or_here(near, v), or_here(far, v));
            // Six counts (24 in fourths) are the least contrast, so that noise of a dark picture does not keep the walk
            // going.
            let contrast = beyond(v, other).max(24);
            if 12 * beyond(n, v) > contrast {
                (k, v, near) = (k + out, n, far);
            } else if 6 * beyond(f, v) > contrast {
                // Two steps are tested, because one alone can stand still in noise while the profile goes on.
                (k, v, near) = (k + 2 * out, f, outwards.next());
            } else {
                // Further pixels on the same level are part of the mean.
                let level = match (6 * beyond(v, n) < contrast, 6 * beyond(v, f) < contrast) {
                    // The mean of three has less noise than one; pixels that already fall again are left out, because
                    // they belong to another edge.
                    (true, true) => (v + n + f) / 3,
                    (true, false) => (v + n) / 2,
                    (false, true) => (v + f) / 2,
                    (false, false) => v,
                };
                return (level, k);
            }
            if (k - from) * out >= REACH {
                return (v, k);
            }
            far = outwards.next();
        }
    }

    /// Returns twice the level of the edge between two plateaus, in units of [`Line::smoothed`]: the mean of their
    /// light, or of their counts if the tone of the picture is unknown.
    #[inline(always)]
    fn mid2(&self, bright: i32, dim: i32) -> i32 {
        let binary = self.around.binary;
        match &binary.curve {
            None => bright + dim,
            Some(curve) => mid2_of_light(curve, bright, dim, binary.picture.full_scale()),
        }
    }

    /// Locates the crossing of the mid-level. The arguments are the smoothed brightness one step to the lit side, here,
    /// and one step to the dark side.
    #[inline(always)]
    pub(super) fn crossing(&self, [inside, first_lit, first_dark]: [i32; 3], aside: &mut Aside) -> Option<Crossing<T>> {
        let binary = self.around.binary;
        // The plateaus are read in one row, because a mean over several pixels is taken. The crossing is read in three
        // rows.
        let (bright, inner) = self.plateau::<true>(first_lit, first_dark);
        // The dark side is measured against the lit plateau, because the first lit pixel may lie in the middle of the
        // edge.
        let (dim, outer) = self.plateau::<false>(first_dark, bright);
        let contrast = bright - dim;
        let level4 = i32::from(binary.level) * 4;
        let (mid2, fallback) = if contrast >= 4 * binary.least_contrast {
            (self.mid2(bright, dim), false)
        } else if first_lit > first_dark {
            (2 * level4.max(first_dark + 1).min(first_lit), true)
        } else {
            return None;
        };
        // Finds the crossing next to the border pixel: outwards if the pixel is lit, otherwise inwards. In the end `a`
        // at `k` is lit and `b` at `k + 1` is not.
        let (mut k, mut a, mut b) =
            if 2 * first_lit >= mid2 { (0, first_lit, first_dark) } else { (-1, inside, first_lit) };
        while 2 * b >= mid2 {
            (k, a) = (k + 1, b);
            if k >= outer.max(1) {
                return None;
            }
            b = self.smoothed(k + 1)?;
        }
        while 2 * a < mid2 {
            if k <= inner.min(-1) {
                return None;
            }
            (k, b) = (k - 1, a);
            a = self.smoothed(k)?;
        }
        // Between equal values there is no crossing, and the quotient would be infinite.
        if a <= b {
            return None;
        }
        let part = T::from_i32(k) + T::from_i32(2 * a - mid2) / T::from_i32(2 * (a - b));
        let full = i32::from(binary.picture.full_scale());
        let clipped = bright >= 4 * (full - full / CLIPPED_PART);
        if aside.wants_profile {
            let (dx, dy) = self.step;
            aside.profile = Profile::new(contrast, a - b, dx.abs() + dy.abs());
        }
        Some(Crossing { part, mid2, fallback, clipped, rising: inner <= -REACH })
    }
}

/// Returns twice the counts whose light is the mean of that of two plateaus, in units of [`Line::smoothed`].
// A blurred edge is a mixture of the light of both sides, so half of the light lies at the true edge, however wide the
// blur is.
#[inline(never)]
fn mid2_of_light<T: Real>(curve: &Curve<T>, bright: i32, dim: i32, full_scale: u16) -> i32 {
    let full = T::from_i32(4 * i32::from(full_scale));
    let level = curve.mid_level(T::from_i32(bright) / full, T::from_i32(dim) / full) * full;
    // The sum is positive, so that the cast rounds to the nearest value.
    (level * T::from_i32(2) + T::from_f64(0.5)).to_i32()
}
