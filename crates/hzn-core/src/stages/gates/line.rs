//! The straight line through points of the picture.

use super::shape::Place;
use crate::base::real::Real;

/// Sums of points in a frame along one direction. On a straight line the second coordinate stays small, so that single
/// precision suffices.
pub(super) struct Line<T> {
    origin: [T; 2],
    along: [T; 2],
    n: T,
    x: T,
    y: T,
    xx: T,
    xy: T,
    yy: T,
}

impl<T: Real> Line<T> {
    pub(super) fn new(origin: [T; 2], towards: [T; 2]) -> Self {
        let (dx, dy) = (towards[0] - origin[0], towards[1] - origin[1]);
        let length = (dx * dx + dy * dy).sqrt().max(T::from_f64(1e-6));
        let zero = T::ZERO;
        let along = [dx / length, dy / length];
        Self { origin, along, n: zero, x: zero, y: zero, xx: zero, xy: zero, yy: zero }
    }
    pub(super) fn add(&mut self, p: &Place<T>) {
        let (dx, dy) = (p.at[0] - self.origin[0], p.at[1] - self.origin[1]);
        let [ax, ay] = self.along;
        let (x, y, w) = (dx * ax + dy * ay, dy * ax - dx * ay, p.w);
        self.n += w;
        self.x += w * x;
        self.y += w * y;
        self.xx += w * x * x;
        self.xy += w * x * y;
        self.yy += w * y * y;
    }
    /// Returns Σ w d² about the best straight line. The slope is small, so that distances along y are also those across
    /// the line.
    pub(super) fn cost(&self) -> T {
        let n = self.n.max(T::from_f64(1e-20));
        let xx = self.xx - self.x * self.x / n;
        let xy = self.xy - self.x * self.y / n;
        let yy = self.yy - self.y * self.y / n;
        let slope = xy / xx.max(T::from_f64(1e-6));
        ((yy - xy * slope) / (T::one() + slope * slope)).max(T::ZERO)
    }
    /// Returns the weighted RMS distance of the points from the best straight line, in pixels.
    pub(super) fn rms_px(&self) -> T {
        (self.cost() / self.n.max(T::from_f64(1e-20))).sqrt()
    }
}
