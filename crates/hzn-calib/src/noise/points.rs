//! The edge points of a picture's candidates, as the pipeline reports them.

use std::cell::RefCell;

use hzn_core::Observer;
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::real::Real;

/// Edge points with their weights, in their order along the edge: (u, v) in pixels, and the weight. A weight of 0 is a
/// rejected point, 1 is the largest.
pub type Weighted = Vec<([f64; 2], f64)>;

/// An observer that stores the edge points of every candidate with the weights of the fit.
#[derive(Debug, Default)]
pub struct Points {
    candidates: RefCell<Vec<Weighted>>,
}

impl Points {
    /// Returns the points of a candidate; the list is empty if the candidate is unknown.
    pub fn of_candidate(&self, candidate: u32) -> Weighted {
        self.candidates.borrow().get(candidate as usize).cloned().unwrap_or_default()
    }

    fn with(&self, candidate: u32, change: impl FnOnce(&mut Weighted)) {
        let mut all = self.candidates.borrow_mut();
        let place = candidate as usize;
        if all.len() <= place {
            all.resize(place + 1, Vec::new());
        }
        if let Some(points) = all.get_mut(place) {
            change(points);
        }
    }
}

impl<T: Real + Into<f64>> Observer<T> for Points {
    fn edge(&self, candidate: u32, _: impl Iterator<Item = Pixel>, _: u32) {
        self.with(candidate, Vec::clear);
    }
    fn point(&self, candidate: u32, point: ImagePoint<T>) {
        self.with(candidate, |points| points.push(([point.u.into(), point.v.into()], 0.0)));
    }
    fn weight(&self, candidate: u32, point: u32, weight: T) {
        self.with(candidate, |points| {
            if let Some((_, own)) = points.get_mut(point as usize) {
                *own = weight.into();
            }
        });
    }
}
