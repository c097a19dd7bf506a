//! The region of a picture that counts: the picture, cut by the image circle, by the blind centre of a panoramic lens
//! and by masked polygons.

mod outline;
mod ring;

pub use outline::MAX_CORNERS;
use outline::Outline;
pub(crate) use ring::Run;

use crate::base::error::{ConfigError, Limit, between, require};
use crate::base::keys::section;
use crate::base::parts::packed;
use crate::base::real::Real;
use crate::geometry::camera::{self, Camera};
use crate::geometry::crop::Crop;
use crate::geometry::pixel::ImagePoint;
use crate::model::work;

/// Maximum number of polygons.
pub const MAX_POLYGONS: usize = 8;

/// Width of the rim of the image circle, and of the blind centre, that does not count, in pixels: blur makes the rim
/// neither lit nor dark.
const RIM_PX: f64 = 3.0;

/// Corners (x, y) of a polygon in pixels; the last is joined to the first.
pub type Polygon = heapless::Vec<[f64; 2], MAX_CORNERS>;

section! {
    /// `[mask]` of sensor.toml: parts of the vehicle in view.
    "mask" pub struct Config {
        /// Areas that are ignored, as polygons of corners [x, y], px; no pixel in them is lit, and their outline is not
        /// an edge.
        ///
        /// Draw one around each part of the vehicle that is always in view. Polygons with fewer corners take less time.
        @- polygons_px: heapless::Vec<Polygon, MAX_POLYGONS> = heapless::Vec::new(),
            ["up to 8 polygons of 3 to 16 corners"]
            { unset: "none", example: "[[[1500, 0], [1919, 0], [1919, 1079], [1450, 1079]]]" };
    }
}

impl Config {
    pub(crate) fn check(&self, camera: &camera::Config) -> Result<(), ConfigError> {
        // Corners may lie outside, so that a mask can cover a side. Far outside they are an error of units, and their
        // products would lose the digits of the sides in single precision.
        let reach = f64::from(camera.width.max(camera.height)) * 4.0;
        for polygon in &self.polygons_px {
            let n = polygon.len();
            require(n >= 3, "mask.polygons_px", n as f64, Limit::Rule("a polygon needs at least 3 corners"))?;
            for corner in polygon {
                between("mask.polygons_px", corner[0], -reach, reach)?;
                between("mask.polygons_px", corner[1], -reach, reach)?;
            }
            let rule = Limit::Rule("the corners of a polygon must not all lie on one line");
            // A polygon without area covers no pixel, so that the mask would silently do nothing.
            require(encloses_area(polygon), "mask.polygons_px", n as f64, rule)?;
        }
        Ok(())
    }
}

/// Returns whether three corners of the polygon make a triangle.
fn encloses_area(polygon: &Polygon) -> bool {
    let Some((first, others)) = polygon.split_first() else { return false };
    let from_first = |corner: &[f64; 2]| [corner[0] - first[0], corner[1] - first[1]];
    let Some(side) = others.iter().map(from_first).find(|side| *side != [0.0; 2]) else { return false };
    others.iter().map(from_first).any(|other| side[0] * other[1] != side[1] * other[0])
}

/// The picture cut by the image circle, with the polygons of the mask.
///
/// An edge ends where the region ends. Under a polygon and in the blind centre no pixel is lit, and the outline of both
/// is not an edge.
#[derive(Debug, Clone, PartialEq)]
pub struct Region<T> {
    width: u16,
    height: u16,
    /// Pixels along each side of the picture that do not count.
    // The frame is a number here and not a crop of the picture, because a crop would shift all coordinates.
    frame: u16,
    circle: Option<Circle<T>>,
    /// The blind centre. Its pixels are masked.
    blind: Option<Circle<T>>,
    polygons: heapless::Vec<Outline<T>, MAX_POLYGONS>,
}

/// The image circle, or the blind centre: an ellipse along the axes, because fx and fy may differ.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Circle<T> {
    cx: T,
    cy: T,
    semi_x: T,
    inv_x: T,
    inv_y: T,
}

impl<T: Real> Region<T> {
    /// Makes the region of a checked configuration.
    pub fn new(config: &Config, camera: &Camera<T>) -> Self {
        let rim = T::from_f64(RIM_PX);
        let circle = camera
            .image_circle_px()
            // A circle of the rim's size would leave a semi-axis of 0 or less, and its reciprocal is used everywhere.
            .filter(|(_, x, y)| *x > rim + T::one() && *y > rim + T::one())
            .map(|(c, x, y)| Circle::new(c, x - rim, y - rim));
        // The rim widens the blind centre and narrows the image circle: in both cases the blurred pixels are left out.
        let blind = camera.blind_centre_px().map(|(c, x, y)| Circle::new(c, x + rim, y + rim));
        let mut polygons = heapless::Vec::new();
        for polygon in &config.polygons_px {
            // The items are pushed one by one: both lists have the capacity of the configuration's lists, and `collect`
            // could panic.
            let mut outline =
                // The bounding box begins inverted, so that the first corner sets both of its ends.
                Outline { low: [T::from_f64(1e9); 2], high: [T::from_f64(-1e9); 2], corners: heapless::Vec::new() };
            for &[x, y] in polygon {
                let c = [T::from_f64(x), T::from_f64(y)];
                for k in 0..2 {
                    outline.low[k] = outline.low[k].min(c[k]);
                    outline.high[k] = outline.high[k].max(c[k]);
                }
                let _ = outline.corners.push(c);
            }
            let _ = polygons.push(outline);
        }
        Self { width: camera.width(), height: camera.height(), frame: 0, circle, blind, polygons }
    }

    /// Makes the region of a whole picture without mask.
    pub fn whole(width: u16, height: u16) -> Self {
        Self { width, height, frame: 0, circle: None, blind: None, polygons: heapless::Vec::new() }
    }

    /// Returns the region without a frame of `px` pixels along each side of the picture. The frame must be narrower
    /// than half of the picture.
    // Not inlined: the copy is then made where it stays.
    #[inline(never)]
    pub(crate) fn without_frame(&self, px: u16) -> Self {
        Self { frame: px, ..self.clone() }
    }
    /// Returns the first and last column, or row, that counts on a side of `length` pixels.
    #[inline(always)]
    fn ends(&self, length: u16) -> (u16, u16) {
        // The subtraction saturates, so that a frame wider than the picture leaves an empty range instead of a wrapped
        // one.
        (self.frame, length.saturating_sub(1).saturating_sub(self.frame))
    }
    #[inline(always)]
    fn columns(&self) -> (u16, u16) {
        self.ends(self.width)
    }
    #[inline(always)]
    fn rows(&self) -> (u16, u16) {
        self.ends(self.height)
    }

    /// Returns the part of the region in the first rows of the picture.
    pub(crate) fn first_rows(&self, rows: u16) -> Self {
        Self { height: rows.min(self.height), ..self.clone() }
    }

    /// Returns the region in the coordinates of a rectangle of the picture or of a smaller copy.
    pub(crate) fn for_crop(&self, crop: &Crop) -> Self {
        let [sx, sy] = crop.scale::<T>();
        let place = |[u, v]: [T; 2]| {
            let p = crop.crop_point(ImagePoint { u, v });
            [p.u, p.v]
        };
        let mut polygons = heapless::Vec::new();
        for o in &self.polygons {
            let mut corners = o.corners.clone();
            corners.iter_mut().for_each(|c| *c = place(*c));
            let _ = polygons.push(Outline { low: place(o.low), high: place(o.high), corners });
        }
        let place_circle = |c: Circle<T>| {
            let [cx, cy] = place([c.cx, c.cy]);
            Circle { cx, cy, semi_x: c.semi_x / sx, inv_x: c.inv_x * sx, inv_y: c.inv_y * sy }
        };
        Self {
            width: crop.width,
            height: crop.height,
            frame: 0,
            circle: self.circle.map(place_circle),
            blind: self.blind.map(place_circle),
            polygons,
        }
    }

    /// Returns the number of columns of the picture.
    pub fn width(&self) -> u16 {
        self.width
    }
    /// Returns the number of rows of the picture.
    pub fn height(&self) -> u16 {
        self.height
    }

    /// Returns whether the pixel lies in the picture and in the image circle.
    #[inline(always)]
    pub fn contains(&self, x: u16, y: u16) -> bool {
        let ((left, right), (top, bottom)) = (self.columns(), self.rows());
        (left..=right).contains(&x)
            && (top..=bottom).contains(&y)
            && self.circle.as_ref().is_none_or(|c| c.contains(x, y))
    }

    /// Returns whether every pixel up to `margin` away in x and y is in the region. Polygons are not tested.
    #[inline(always)]
    pub(crate) fn is_inside_by(&self, x: u16, y: u16, margin: u16) -> bool {
        self.is_inside_by_each(x, y, [margin; 2])
    }

    /// Does the same as [`Self::is_inside_by`], with a margin in x and another in y.
    #[inline(always)]
    pub(crate) fn is_inside_by_each(&self, x: u16, y: u16, margins: [u16; 2]) -> bool {
        let (w, h) = (u32::from(self.width), u32::from(self.height));
        let (x32, y32) = (u32::from(x), u32::from(y));
        let [across, down] = margins.map(|m| u32::from(m) + u32::from(self.frame));
        x32 >= across
            && y32 >= down
            && x32 + across < w
            && y32 + down < h
            && self.circle.as_ref().is_none_or(|c| c.clear(x, y, margins.map(|m| T::from_i32(i32::from(m)))))
    }

    /// Returns the number of pixels, up to `most`, that can be walked from here in any direction without leaving the
    /// region or meeting a masked pixel. It may be lower than the true number, where a test would take longer than
    /// the walk. The cost of the tests is added to `cost`, in the unit of [`crate::model::work`].
    #[inline(always)]
    pub(crate) fn clearance(&self, x: u16, y: u16, most: u16, cost: &mut u32) -> u16 {
        let sides = x
            .min(y)
            .min(self.width.saturating_sub(1).saturating_sub(x))
            // The sides of the picture come first because they are integers: they bound the costly tests below.
            .min(self.height.saturating_sub(1).saturating_sub(y))
            .saturating_sub(self.frame);
        let most = most.min(sides);
        let mut clear = |n: u16| {
            let margin = T::from_i32(i32::from(n));
            self.circle.as_ref().is_none_or(|c| c.clear(x, y, [margin; 2]))
                && (!self.has_mask() || self.is_unmasked_by(x, y, margin, cost))
        };
        // Two tries are enough: if even a quarter is not free, walking pixel by pixel is cheaper than another test.
        [most, most / 4].into_iter().find(|&n| clear(n)).unwrap_or(0)
    }

    /// Returns whether no pixel of the square of `margin` pixels to each side is masked.
    fn is_unmasked_by(&self, x: u16, y: u16, margin: T, cost: &mut u32) -> bool {
        // A comparison with a bounding box costs half a unit.
        *cost += self.polygons.len() as u32 / 2 + 1;
        self.blind.as_ref().is_none_or(|c| c.is_outside(x, y, margin))
            && self.polygons.iter().all(|p| p.clear(x, y, margin, cost))
    }

    /// Returns whether there is a polygon or a blind centre.
    pub(crate) fn has_mask(&self) -> bool {
        !self.polygons.is_empty() || self.blind.is_some()
    }
    /// Returns the largest cost to test whether a pixel is masked, in the unit of [`crate::model::work`]. One unit is
    /// four sides of a polygon.
    pub(crate) fn mask_cost(&self) -> u32 {
        let polygons: u32 = self.polygons.iter().map(Outline::cost).sum();
        polygons + u32::from(self.blind.is_some())
    }

    /// Returns the largest cost to check the reads of one edge point, up to `margin` pixels from here, against border,
    /// image circle and masks, in the unit of [`crate::model::work`]. Only polygons whose bounding box is near take
    /// much.
    #[inline(never)]
    pub(crate) fn checks_cost(&self, x: u16, y: u16, margin: u16) -> u32 {
        let (p, margin) = ([T::from_i32(i32::from(x)), T::from_i32(i32::from(y))], T::from_i32(i32::from(margin)));
        // Each look is charged for the polygons that it can meet. A fixed charge of 12 looks a point was too low,
        // because a point makes up to 45: hostile pictures with masks took 29.6 million instructions instead of 20
        // million.
        let of_polygon = |o: &Outline<T>| {
            work::BOXES + if o.is_near(p, margin) { work::sides_cost(o.corners.len() as u32) } else { 0 }
        };
        let blind = if self.blind.is_some() { work::CHECKS } else { 0 };
        work::CHECKS + blind + self.polygons.iter().map(of_polygon).sum::<u32>()
    }

    /// Returns whether a polygon or the blind centre covers the pixel.
    #[inline(always)]
    pub fn masked(&self, x: u16, y: u16) -> bool {
        self.has_mask() && self.covered(x, y)
    }

    /// Returns whether the pixel exists, is in the region and is not masked. It is for rare reads; there is only one
    /// copy of it in flash.
    #[inline(never)]
    pub(crate) fn is_usable(&self, x: i32, y: i32) -> bool {
        let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return false };
        self.contains(x, y) && !self.masked(x, y)
    }

    #[inline(never)]
    fn covered(&self, x: u16, y: u16) -> bool {
        let p = [T::from_i32(i32::from(x)), T::from_i32(i32::from(y))];
        self.blind.as_ref().is_some_and(|c| c.contains(x, y)) || self.polygons.iter().any(|polygon| polygon.covers(p))
    }

    /// Returns the first and last column of a row; `None` if the image circle leaves nothing of the row.
    pub fn row_span(&self, y: u16) -> Option<(u16, u16)> {
        let ((first, last), (top, bottom)) = (self.columns(), self.rows());
        if !(top..=bottom).contains(&y) {
            return None;
        }
        let Some(c) = &self.circle else { return Some((first, last)) };
        let dy = (T::from_i32(i32::from(y)) - c.cy) * c.inv_y;
        let left = T::one() - dy * dy;
        if !(left > T::zero()) {
            return None;
        }
        let half = c.semi_x * left.sqrt();
        // A region always has columns. The `max` repeats this, so that the compiler sees that `clamp` cannot fail.
        let (first, last) = (i32::from(first), i32::from(last.max(first)));
        // The search starts one pixel inside and grows while the exact test holds: the ring and `contains` must agree.
        let mut x0 = (c.cx - half).floor().to_i32().saturating_add(2).clamp(first, last);
        let mut x1 = (c.cx + half).floor().to_i32().saturating_sub(1).clamp(first, last);
        if x0 > x1 {
            let mid = c.cx.to_i32().clamp(first, last);
            (x0, x1) = (mid, mid);
            if !self.contains(mid as u16, y) {
                return None;
            }
        }
        // Rounding moves the ends by a pixel or two. The count is fixed, so that the loop ends for every circle.
        for _ in 0..4 {
            if x0 > first && self.contains((x0 - 1) as u16, y) {
                x0 -= 1;
            }
            if x1 < last && self.contains((x1 + 1) as u16, y) {
                x1 += 1;
            }
        }
        (self.contains(x0 as u16, y) && self.contains(x1 as u16, y)).then_some((x0 as u16, x1 as u16))
    }
}

impl<T: Real> Circle<T> {
    fn new(centre: ImagePoint<T>, semi_x: T, semi_y: T) -> Self {
        Self { cx: centre.u, cy: centre.v, semi_x, inv_x: T::one() / semi_x, inv_y: T::one() / semi_y }
    }
    #[inline(always)]
    fn contains(&self, x: u16, y: u16) -> bool {
        self.clear(x, y, [T::ZERO; 2])
    }
    /// Returns whether the rectangle of these margins to each side, in x and y, lies within the circle.
    #[inline(always)]
    fn clear(&self, x: u16, y: u16, margins: [T; 2]) -> bool {
        // The corner that is farthest from the centre decides, so one comparison tests the whole rectangle.
        let dx = ((T::from_i32(i32::from(x)) - self.cx).abs() + margins[0]) * self.inv_x;
        let dy = ((T::from_i32(i32::from(y)) - self.cy).abs() + margins[1]) * self.inv_y;
        dx * dx + dy * dy <= T::one()
    }
    /// Returns whether the square of `margin` pixels to each side lies outside the circle.
    #[inline(never)]
    // `max` with 0 covers a square that contains the centre line, whose nearest point lies on the line itself.
    fn is_outside(&self, x: u16, y: u16, margin: T) -> bool {
        let dx = ((T::from_i32(i32::from(x)) - self.cx).abs() - margin).max(T::ZERO) * self.inv_x;
        let dy = ((T::from_i32(i32::from(y)) - self.cy).abs() - margin).max(T::ZERO) * self.inv_y;
        dx * dx + dy * dy > T::one()
    }
}

packed!(Region<T> { width, height, frame, circle, blind, polygons });
packed!(Circle<T> { cx, cy, semi_x, inv_x, inv_y });

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{Config as CameraConfig, Model};

    #[test]
    fn what_is_clear_is_not_masked() {
        let camera = Camera::<f32>::try_new(&CameraConfig::ideal(Model::Pinhole, 64, 48, 50.0)).unwrap();
        let mut config = Config::default();
        for polygon in [
            [[5.0, 3.0], [9.0, 3.0], [60.0, 44.0], [56.0, 44.0]],
            [[50.0, 2.0], [58.0, 8.0], [40.0, 12.0], [49.0, 5.0]],
        ] {
            config.polygons_px.push(polygon.into_iter().collect()).unwrap();
        }
        let region = Region::new(&config, &camera);
        let mut clear = 0;
        for (x, y) in (0..48u16).flat_map(|y| (0..64u16).map(move |x| (x, y))) {
            let n = region.clearance(x, y, 6, &mut 0);
            clear += u32::from(n == 6);
            for (i, j) in (0..=2 * n).flat_map(|j| (0..=2 * n).map(move |i| (i, j))) {
                assert!(n == 0 || !region.masked(x + i - n, y + j - n), "{x} {y}: {n}");
            }
        }
        // There is clearance also between the polygons and the corners of their bounding boxes, which cover most of the
        // picture.
        assert!(clear > 400, "{clear}");
    }

    #[test]
    fn the_blind_centre_is_masked() {
        let lens =
            CameraConfig { theta_min_deg: Some(20.0), ..CameraConfig::ideal(Model::Equidistant, 200, 160, 60.0) };
        let region = Region::new(&Config::default(), &Camera::<f64>::try_new(&lens).unwrap());
        let radius = 60.0 * 20f64.to_radians() + RIM_PX;
        for (x, y) in (0..160u16).flat_map(|y| (0..200u16).map(move |x| (x, y))) {
            let distance = (f64::from(x) - 99.5).hypot(f64::from(y) - 79.5);
            assert_eq!(region.masked(x, y), distance <= radius, "{x} {y}");
            let n = region.clearance(x, y, 6, &mut 0);
            for (i, j) in (0..=2 * n).flat_map(|j| (0..=2 * n).map(move |i| (i, j))) {
                assert!(n == 0 || !region.masked(x + i - n, y + j - n), "{x} {y}: {n}");
            }
        }
        let refused = |deg| {
            let lens = CameraConfig { theta_min_deg: Some(deg), ..lens.clone() };
            Camera::<f64>::try_new(&lens).unwrap_err().field
        };
        assert_eq!([refused(150.0), refused(0.0)], ["camera.theta_min_deg"; 2]);
    }

    #[test]
    fn polygons_cover_their_inside() {
        let camera = Camera::<f64>::try_new(&CameraConfig::ideal(Model::Pinhole, 40, 30, 50.0)).unwrap();
        let mut config = Config::default();
        config.polygons_px.push(heapless::Vec::from_slice(&[[10.0, 5.0], [20.0, 5.0], [10.0, 15.0]]).unwrap()).unwrap();
        let region = Region::new(&config, &camera);
        assert!(region.masked(12, 8) && !region.masked(19, 14) && !region.masked(9, 8));
    }
}
