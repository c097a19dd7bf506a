//! Joins the edges of one limb that the border of the picture cuts apart.
//!
//! The limb of a disc that is larger than the picture leaves the picture and comes back elsewhere. Each piece is an
//! edge of its own, and one piece says less about the axis than all of them. The edges that begin at the border next to
//! the limb that was found are therefore followed once more, one after the other, and judged as one edge. A mask cuts
//! no edge apart, because the follower walks along the mask to the other side.

use super::edge::CERTAIN_SHARE;
use super::{Best, Search};
use crate::base::real::Real;
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::Pixels;
use crate::model::found_limb::FoundLimb;
use crate::model::observer::Observer;
use crate::stages::contour::{BinaryPicture, Marks, Ranked, Thinned};
use crate::stages::gates::Choice;

/// Largest distance of an edge's beginning from the limb that was found, and of the joined answer from that of the
/// first edge: this many sigmas of the first edge.
const AGREEMENT_SIGMA: f64 = 3.0;

impl<T: Real, O: Observer<T>> Search<'_, T, O> {
    /// Judges the edges at `starts` that begin on the limb of the best answer as one edge. Its answer replaces the best
    /// one if it agrees with it and is more certain.
    // The edges are followed once more, because a list for the pixels of each edge would take more memory than the
    // workspace has. It costs nothing if no second edge begins on the limb, as in nearly every picture.
    pub(super) fn join_edges<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        starts: &Ranked,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
    ) {
        if starts.len() < 2 || self.expected.free || self.choice() != Choice::Score {
            return;
        }
        let Some(best) = &self.best else { return };
        let limb = FoundLimb::new(&best.solution);
        let (fx, fy) = self.camera.focal_px();
        let sigma_px = best.solution.covariance.sigma_max_rad() * (fx + fy) * T::from_f64(0.5);
        let limit_px = T::from_f64(self.sensor.config.consensus.threshold_px) + sigma_px * T::from_f64(AGREEMENT_SIGMA);
        let is_on_limb = |Pixel { x, y }: Pixel| {
            let point = ImagePoint { u: T::from_i32(x.into()), v: T::from_i32(y.into()) };
            limb.is_within(limit_px, point, self.camera)
        };
        let mut on_limb = starts.clone();
        on_limb.retain(|start| is_on_limb(start.pixel));
        if on_limb.len() > 1 {
            self.judge_as_one(binary, &on_limb, border, marks);
        }
    }

    #[cold]
    fn judge_as_one<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        starts: &Ranked,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
    ) {
        let mut edge = Thinned::new(border);
        for start in starts {
            let _ = self.follow(binary, start.pixel, start.dark, &mut edge, marks);
            self.work.charge(binary.cost());
        }
        // The best answer is put aside, so that it does not compete with the joined edge, of which it is a part.
        let before = self.best.take();
        self.judge_edge(binary, &edge);
        match (before, &mut self.best) {
            // The joined answer stays where it is, because an answer takes more than half a kilobyte of stack.
            (Some(before), Some(joined)) if is_better(joined, &before) => joined.certain |= before.certain,
            (before, best) => *best = before,
        }
        self.work.charge(binary.cost());
    }
}

/// Returns whether the answer of a joined edge agrees with that of a part of it, and is more certain.
fn is_better<T: Real>(joined: &Best<T>, part: &Best<T>) -> bool {
    let sigma_rad = part.solution.covariance.sigma_max_rad();
    let (inliers, points) = (joined.outcome.inliers, joined.outcome.points);
    joined.solution.axis.angle_rad(&part.solution.axis) <= sigma_rad * T::from_f64(AGREEMENT_SIGMA)
        && joined.solution.covariance.sigma_max_rad() < sigma_rad
        && T::from_i32(inliers as i32) >= T::from_i32(points as i32) * T::from_f64(CERTAIN_SHARE)
}
