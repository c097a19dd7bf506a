//! The edge points of a picture's candidates, as the pipeline reports them.

use std::cell::RefCell;

use hzn_core::Observer;
use hzn_core::observer::Border;
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;

/// Edge points with their weights, in their order along the edge: (u, v) in pixels, and the weight. A weight of 0 is a
/// rejected point, 1 is the largest.
pub type WeightedPoints = Vec<([f64; 2], f64)>;

/// An observer that stores the edge points of every candidate with the weights of the fit.
#[derive(Debug, Default)]
pub struct PointRecorder {
    candidates: RefCell<Vec<WeightedPoints>>,
}

impl PointRecorder {
    /// Returns the points of a candidate; the list is empty if the candidate is unknown.
    pub fn candidate_points(&self, candidate: u32) -> WeightedPoints {
        self.candidates.borrow().get(candidate as usize).cloned().unwrap_or_default()
    }

    /// Changes the points of a candidate, whose list begins empty.
    fn change(&self, candidate: u32, change: impl FnOnce(&mut WeightedPoints)) {
        let mut all = self.candidates.borrow_mut();
        let index = candidate as usize;
        if all.len() <= index {
            all.resize(index + 1, Vec::new());
        }
        if let Some(points) = all.get_mut(index) {
            change(points);
        }
    }
}

impl<T: Real + Into<f64>> Observer<T> for PointRecorder {
    fn edge(&self, candidate: u32, _: Border<'_>) {
        self.change(candidate, Vec::clear);
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.change(candidate, |points| points.push(([point.u.into(), point.v.into()], 0.0)));
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.change(candidate, |points| {
            if let Some((_, own)) = points.get_mut(point as usize) {
                *own = weight.into();
            }
        });
    }
}
