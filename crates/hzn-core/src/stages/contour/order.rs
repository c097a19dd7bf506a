//! Sorts edge pixels along the limb if they were found one by one in the whole picture.

use crate::base::real::Real;
use crate::base::sort;
use crate::geometry::circle::Circle;
use crate::geometry::pixel::Pixel;

/// Sorts the pixels by their angle about the circle through all of them. The widest gap is between the last and the
/// first pixel. Pixels on a straight line keep their order.
pub(super) fn sort_about_common_circle<T: Real>(pixels: &mut [Pixel]) {
    let place = |p: &Pixel| [T::from_i32(i32::from(p.x)), T::from_i32(i32::from(p.y))];
    let Some(circle) = Circle::fit(pixels.iter().map(place)) else { return };
    // This value grows with the angle from −x over −y, from 0 to 4.
    // Quotients order the pixels as the arc tangent would. They are used instead of it, because the sort computes two
    // of them at every comparison.
    let angle = |p: &Pixel| -> T {
        let [x, y] = place(p);
        let (x, y) = (x - circle.centre[0], y - circle.centre[1]);
        let along = x / (x.abs() + y.abs()).max(T::from_f64(1e-20));
        if y < T::ZERO { T::one() + along } else { T::from_f64(3.0) - along }
    };
    // The angles are computed again at each comparison, because there is no memory for one number a pixel.
    sort::by(pixels, |a, b| angle(a) < angle(b));
    let Some((first, last)) = pixels.first().zip(pixels.last()) else { return };
    let (mut widest, mut start) = (angle(first) + T::from_f64(4.0) - angle(last), 0);
    for (i, pair) in pixels.windows(2).enumerate() {
        if let [a, b] = pair
            && angle(b) - angle(a) > widest
        {
            (widest, start) = (angle(b) - angle(a), i + 1);
        }
    }
    if start < pixels.len() {
        pixels.rotate_left(start);
    }
}
