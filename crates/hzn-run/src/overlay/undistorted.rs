//! Pictures without the distortion of the lens: as a pinhole with the same optical axis would take them. Straight lines
//! are straight there, and the limb is a conic section.

use hzn_core::Solution;
use hzn_core::camera::{Camera, Config, Model};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pixel::ImagePoint;
use hzn_mcap::Annotations;
use image::{Rgb, RgbImage};

use super::draw_limb;

/// Largest angle off the optical axis that is shown. Beyond it a pinhole stretches a picture more than sixteen times.
const MAX_ANGLE_RAD: f64 = 75.0 * std::f64::consts::PI / 180.0;
/// Part of the picture that remains free on each side, for the arms of a cross and the width of a line.
const MARGIN: f64 = 0.04;
/// Places on each side of the picture at which its outline is looked at.
const PLACES: u32 = 64;
/// Colour of what the lens does not see. It is no colour of the sky.
const OUTSIDE: Rgb<u8> = Rgb([48, 48, 64]);

/// A lens and the pinhole that replaces it.
#[derive(Debug, Clone)]
pub struct Undistorted {
    lens: Camera<f64>,
    pinhole: Camera<f64>,
}

impl Undistorted {
    /// Returns the pinhole whose picture has the size of the camera's picture and shows all of it, and the directions
    /// `also` (camera frame), as far as they are within 75° of the optical axis. `None` if the camera sees nothing
    /// there.
    pub fn new(camera: &Camera<f64>, also: &[UnitVec3<Cam, f64>]) -> Option<Self> {
        let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
        let places = (0..=PLACES).flat_map(|i| {
            let t = f64::from(i) / f64::from(PLACES);
            let (x, y) = (t * w - 0.5, t * h - 0.5);
            [[x, -0.5], [x, h - 0.5], [-0.5, y], [w - 0.5, y]]
        });
        // A place beyond the image circle has no ray. The circle itself is in view where a ray of its rim is.
        let rim = camera.theta_max_rad().min(MAX_ANGLE_RAD).sin_cos();
        let rim = (0..4 * PLACES).filter_map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / f64::from(4 * PLACES)).sin_cos();
            let ray = UnitVec3::try_new([rim.0 * c, rim.0 * s, rim.1])?;
            let at = camera.project(&ray)?;
            ((-0.5..=w - 0.5).contains(&at.u) && (-0.5..=h - 0.5).contains(&at.v)).then_some(ray)
        });
        let outline = places.filter_map(|[u, v]| camera.unproject(ImagePoint { u, v }));
        let far = also.iter().copied().filter(|axis| axis.xyz()[2] >= MAX_ANGLE_RAD.cos());
        let plane =
            outline.map(|ray| on_plane(&ray)).chain(rim.map(|ray| on_plane(&ray))).chain(far.map(|ray| on_plane(&ray)));
        let mut corners = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for point in plane {
            for i in 0..2 {
                corners[0][i] = corners[0][i].min(point[i]);
                corners[1][i] = corners[1][i].max(point[i]);
            }
        }
        let [low, high] = corners;
        let size = [w, h];
        let scale = |i: usize| (1.0 - 2.0 * MARGIN) * size[i] / (high[i] - low[i]);
        let focal_px = scale(0).min(scale(1));
        let centre = |i: usize| (size[i] - 1.0) / 2.0 - focal_px * (low[i] + high[i]) / 2.0;
        let ideal = Config::ideal(Model::Pinhole, camera.width(), camera.height(), focal_px);
        let pinhole = Camera::try_new(&Config { cx_px: centre(0), cy_px: centre(1), ..ideal }).ok()?;
        Some(Self { lens: camera.clone(), pinhole })
    }

    /// Returns the pinhole.
    pub fn pinhole(&self) -> &Camera<f64> {
        &self.pinhole
    }

    /// Returns the picture that the pinhole would take, interpolated between four pixels. What the lens does not see is
    /// of a blue grey.
    pub fn picture(&self, image: &RgbImage) -> RgbImage {
        RgbImage::from_fn(image.width(), image.height(), |x, y| {
            let ray = self.pinhole.unproject(ImagePoint { u: f64::from(x), v: f64::from(y) });
            ray.and_then(|ray| self.lens.project(&ray)).and_then(|at| sample(image, at)).unwrap_or(OUTSIDE)
        })
    }

    /// Returns the edges and edge points of a drawing over the camera's picture, where the pinhole would see them. Limb
    /// and axis are drawn by [`Undistorted::answer`], because they reach beyond the camera's picture.
    pub fn points(&self, drawing: &Annotations) -> Annotations {
        let point = |p: &[f64; 2]| {
            let at = self.pinhole.project(&self.lens.unproject(ImagePoint { u: p[0], v: p[1] })?)?;
            Some([at.u, at.v])
        };
        let all = |points: &[[f64; 2]]| points.iter().filter_map(point).collect();
        Annotations {
            edges: drawing.edges.iter().map(|edge| all(edge)).collect(),
            inliers: all(&drawing.inliers),
            rejected: all(&drawing.rejected),
            ..Annotations::default()
        }
    }

    /// Returns the drawing of an answer: the limb, also beyond the camera's picture, and its axis.
    pub fn answer(&self, solution: &Solution<f64>) -> Annotations {
        draw_limb(solution, &self.pinhole)
    }
}

/// Returns the point of a ray on the plane z = 1. A ray farther off than the largest angle is moved to it.
fn on_plane(ray: &UnitVec3<Cam, f64>) -> [f64; 2] {
    let [x, y, z] = ray.xyz();
    let flat = x.hypot(y);
    let tan = if z > MAX_ANGLE_RAD.cos() { flat / z } else { MAX_ANGLE_RAD.tan() };
    let per = if flat > 0.0 { tan / flat } else { 0.0 };
    [x * per, y * per]
}

/// Returns the colour at a point, interpolated between four pixels; `None` outside of the picture.
fn sample(image: &RgbImage, at: ImagePoint<f64>) -> Option<Rgb<u8>> {
    let (w, h) = (f64::from(image.width()), f64::from(image.height()));
    if !((-0.5..=w - 0.5).contains(&at.u) && (-0.5..=h - 0.5).contains(&at.v)) {
        return None;
    }
    // Pixel centres are at integers, so the outer half of a border pixel has no second neighbour.
    let (u, v) = (at.u.clamp(0.0, w - 1.0), at.v.clamp(0.0, h - 1.0));
    let (x, y) = (u.floor(), v.floor());
    let (s, t) = (u - x, v - y);
    let pixel = |dx: f64, dy: f64| image.get_pixel((x + dx).min(w - 1.0) as u32, (y + dy).min(h - 1.0) as u32).0;
    let four = [(pixel(0.0, 0.0), (1.0 - s) * (1.0 - t)), (pixel(1.0, 0.0), s * (1.0 - t))];
    let four = [four[0], four[1], (pixel(0.0, 1.0), (1.0 - s) * t), (pixel(1.0, 1.0), s * t)];
    Some(Rgb([0, 1, 2].map(|i| four.iter().map(|(p, share)| f64::from(p[i]) * share).sum::<f64>().round() as u8)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(model: Model, focal_px: f64) -> Camera<f64> {
        Camera::try_new(&Config::ideal(model, 640, 480, focal_px)).unwrap()
    }

    #[test]
    fn the_picture_of_a_pinhole_is_only_smaller_by_the_margin() {
        let undistorted = Undistorted::new(&camera(Model::Pinhole, 500.0), &[]).unwrap();
        let (focal, centre) = (undistorted.pinhole.focal_px().0, undistorted.pinhole.principal_point());
        assert!((focal - 0.92 * 500.0).abs() < 1e-9, "{focal}");
        assert!((centre.u - 319.5).abs() < 1e-9 && (centre.v - 239.5).abs() < 1e-9, "{centre:?}");
    }

    /// A line of the world is curved in the picture of a wide lens. Its pixels are straight in the undistorted one.
    #[test]
    fn pixels_of_a_straight_line_become_straight() {
        let lens = camera(Model::Equidistant, 280.0);
        let undistorted = Undistorted::new(&lens, &[]).unwrap();
        let mut image = RgbImage::new(640, 480);
        let mut marks = Annotations::default();
        for i in -800..=800 {
            let ray = UnitVec3::try_new([f64::from(i) / 1000.0, 0.5, 1.0]).unwrap();
            let at = lens.project(&ray).unwrap();
            marks.inliers.push([at.u, at.v]);
            for y in [at.v.floor(), at.v.ceil()] {
                image.put_pixel(at.u.round() as u32, y as u32, Rgb([255; 3]));
            }
        }
        let flat = undistorted.picture(&image);
        let row = undistorted.pinhole.project(&UnitVec3::try_new([0.0, 0.5, 1.0]).unwrap()).unwrap().v;
        let lit: Vec<f64> = flat
            .enumerate_pixels()
            .filter(|(_, _, p)| p.0[0] > 100 && p.0[2] > 100)
            .map(|(_, y, _)| f64::from(y))
            .collect();
        // The line is 1.6 focal lengths long, and interpolation dims some of its pixels.
        assert!(lit.len() > 100 && lit.iter().all(|y| (y - row).abs() < 1.5), "{row}: {lit:?}");
        assert!(undistorted.points(&marks).inliers.iter().all(|p| (p[1] - row).abs() < 1e-6));
    }

    #[test]
    fn a_nadir_beyond_the_picture_is_in_view_and_one_beyond_75_degrees_is_not() {
        let lens = camera(Model::Pinhole, 500.0);
        let shown = |deg: f64| {
            let axis = UnitVec3::try_new([0.0, deg.to_radians().sin(), deg.to_radians().cos()]).unwrap();
            let pinhole = Undistorted::new(&lens, &[axis]).unwrap().pinhole;
            pinhole.project(&axis).is_some_and(|p| (0.0..640.0).contains(&p.u) && (0.0..480.0).contains(&p.v))
        };
        assert!(lens.project(&UnitVec3::try_new([0.0, 1.0, 0.4]).unwrap()).is_none_or(|p| p.v > 480.0));
        assert!(shown(20.0) && shown(70.0) && !shown(80.0));
    }
}
