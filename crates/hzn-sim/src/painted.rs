//! A uniform disc in a uniform sky, computed directly from its cone: no world, no noise, thousands of pictures a
//! minute.
//!
//! These pictures are for campaigns about the search alone. If one is refused, only the sensor can be the reason.

use hzn_core::camera::{self, Camera};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;

use crate::counter::{Counter, Stream};

/// A lens, and the ray through the centre of each of its pixels.
#[derive(Debug, Clone)]
pub struct Canvas {
    camera: Camera<f64>,
    rays: Vec<Option<[f64; 3]>>,
}

/// A uniform disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniformDisc {
    /// Direction of its centre in the camera frame, unit length.
    pub axis: [f64; 3],
    /// Half-angle of the disc, radians.
    pub half_angle_rad: f64,
    /// Brightness of the disc, counts.
    pub lit: f64,
    /// Brightness of the sky, counts.
    pub dark: f64,
    /// Width of the edge from sky to disc, pixels.
    pub edge_px: f64,
}

impl Canvas {
    /// Computes the rays.
    pub fn new(camera: Camera<f64>) -> Self {
        let (w, h) = (camera.width(), camera.height());
        let point = |i: u32| ImagePoint { u: f64::from(i % u32::from(w)), v: f64::from(i / u32::from(w)) };
        let rays = (0..u32::from(w) * u32::from(h)).map(|i| camera.unproject(point(i)).map(|ray| ray.xyz())).collect();
        Self { camera, rays }
    }

    /// Returns the lens.
    pub fn camera(&self) -> &Camera<f64> {
        &self.camera
    }

    /// Paints the picture of a disc, 8 bits, row by row. Pixels that the lens does not see are sky.
    pub fn paint(&self, disc: &UniformDisc) -> Vec<u8> {
        let width = usize::from(self.camera.width());
        let cos = disc.half_angle_rad.cos();
        let cosine = |i: usize| {
            let ray = self.rays.get(i).copied().flatten()?;
            Some(ray.iter().zip(&disc.axis).map(|(s, e)| s * e).sum::<f64>())
        };
        (0..self.rays.len())
            .map(|i| {
                let part = cosine(i).map_or(0.0, |here| {
                    // The change of the cosine from pixel to pixel gives the edge width in pixels.
                    let change = |step: usize| {
                        let (before, after) = (i.checked_sub(step).and_then(cosine), cosine(i + step));
                        match (before, after) {
                            (Some(a), Some(b)) => (b - a) / 2.0,
                            (Some(a), None) => here - a,
                            (None, Some(b)) => b - here,
                            (None, None) => 1.0,
                        }
                    };
                    let inside_px = (here - cos) / change(1).hypot(change(width)).max(1e-12);
                    (0.5 + inside_px / disc.edge_px).clamp(0.0, 1.0)
                });
                (disc.dark + (disc.lit - disc.dark) * part + 0.5) as u8
            })
            .collect()
    }

    /// Returns the share of the disc's outline that is in the picture and in the lens's view, 0 to 1. The share is
    /// counted at 360 points, `margin_px` inside the borders.
    pub fn outline_in_view(&self, disc: &UniformDisc, margin_px: f64) -> f64 {
        let Some(axis) = UnitVec3::<hzn_core::frames::Cam, f64>::try_new(disc.axis) else { return 0.0 };
        let e = nalgebra::Vector3::from(axis.xyz());
        let b1 = e.cross(&e.map(|x| if x.abs() < 0.6 { 1.0 } else { 0.0 })).normalize();
        let b2 = e.cross(&b1);
        let (sin, cos) = disc.half_angle_rad.sin_cos();
        let (w, h) = (f64::from(self.camera.width()), f64::from(self.camera.height()));
        let visible = |degree: u32| {
            let (s, c) = f64::from(degree).to_radians().sin_cos();
            let ray = e * cos + (b1 * c + b2 * s) * sin;
            let Some(p) = UnitVec3::try_new(ray.into()).and_then(|ray| self.camera.project(&ray)) else { return false };
            let in_circle = self.camera.image_circle_px().is_none_or(|(centre, x, y)| {
                ((p.u - centre.u) / (x - margin_px)).hypot((p.v - centre.v) / (y - margin_px)) < 1.0
            });
            in_circle && (margin_px..w - margin_px).contains(&p.u) && (margin_px..h - margin_px).contains(&p.v)
        };
        (0..360).filter(|&d| visible(d)).count() as f64 / 360.0
    }
}

/// A lens with an image circle, and discs in its view. Each disc is the Earth from some altitude.
#[derive(Debug, Clone)]
pub struct LensWithDiscs {
    /// The lens: equidistant, with an image circle at 60 to 90 degrees.
    pub lens: camera::Config,
    /// The same lens with its rays.
    pub canvas: Canvas,
    /// Discs with at least half of the outline in view, each with its altitude in kilometres.
    pub discs: Vec<(UniformDisc, f64)>,
}

impl LensWithDiscs {
    /// Makes circle number `circle` with `count` discs. The same numbers give the same discs.
    ///
    /// # Panics
    /// Never: the lenses are valid.
    pub fn new(circle: u32, count: usize) -> Self {
        let draws = Counter::new(u64::from(circle), Stream::Painted);
        let draw = |i: u64| draws.uniform(i);
        let (w, h) = [(400, 400), (480, 360), (640, 480)][circle as usize % 3];
        let theta_max_rad = (60.0 + 30.0 * draw(0)).to_radians();
        let lens = camera::Config {
            theta_max_deg: Some(theta_max_rad.to_degrees()),
            ..camera::Config::ideal(camera::Model::Equidistant, w, h, f64::from(h) / 3.0)
        };
        let canvas = Canvas::new(Camera::try_new(&lens).expect("the lens is valid"));
        let discs = (0..)
            .map(|n| {
                let number = |k: u64| draw(1 + 8 * n + k);
                // The altitude is 1500 km to 19 000 km.
                let altitude_km = 1500.0 * 10f64.powf(1.1 * number(0));
                let half_angle_rad = (EARTH_KM / (EARTH_KM + altitude_km)).asin();
                let (turn, off) =
                    (core::f64::consts::TAU * number(1), number(2) * (theta_max_rad - 0.3 * half_angle_rad));
                let axis = [off.sin() * turn.cos(), off.sin() * turn.sin(), off.cos()];
                let (lit, edge_px) = (60.0 + 190.0 * number(3), 1.0 + 3.0 * number(4));
                (UniformDisc { axis, half_angle_rad, lit, dark: 5.0, edge_px }, altitude_km)
            })
            .filter(|(disc, _)| canvas.outline_in_view(disc, RIM_PX) >= 0.5)
            .take(count)
            .collect();
        Self { lens, canvas, discs }
    }
}

/// Mean radius of the Earth, kilometres.
const EARTH_KM: f64 = 6371.0;
/// Distance from the image circle in pixels within which an outline counts as out of view; the sensor leaves out three
/// pixels.
const RIM_PX: f64 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};

    #[test]
    fn a_disc_has_its_size_and_place() {
        let config = Config::ideal(Model::Equidistant, 200, 160, 100.0);
        let canvas = Canvas::new(Camera::try_new(&config).unwrap());
        let disc = UniformDisc { axis: [0.0, 0.0, 1.0], half_angle_rad: 0.4, lit: 200.0, dark: 0.0, edge_px: 1.0 };
        let picture = canvas.paint(&disc);
        // The radius is 40 px. The area must fit, and both sides of the centre must be the same.
        let area = picture.iter().map(|&p| f64::from(p)).sum::<f64>() / 200.0;
        assert!((area - std::f64::consts::PI * 1600.0).abs() < 5.0, "{area}");
        assert!((0..80).all(|y| (0..200).all(|x| picture[y * 200 + x].abs_diff(picture[(159 - y) * 200 + x]) <= 1)));
        assert_eq!(canvas.outline_in_view(&disc, 0.0), 1.0);
        let aside = UniformDisc { axis: [1f64.sin(), 0.0, 1f64.cos()], ..disc };
        let part = canvas.outline_in_view(&aside, 0.0);
        assert!((0.4..0.6).contains(&part), "{part}");
    }
}
