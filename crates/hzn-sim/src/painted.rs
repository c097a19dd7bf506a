//! An even disc in an even sky, straight from its cone: no world, no noise, thousands a minute.
//!
//! For campaigns about the search alone: what such a picture is refused for is nobody's fault but the sensor's.

use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;

/// A lens, and the ray through the centre of each of its pixels.
#[derive(Debug, Clone)]
pub struct Canvas {
    camera: Camera<f64>,
    rays: Vec<Option<[f64; 3]>>,
}

/// A disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Even {
    /// Direction of its centre in the camera, unit length.
    pub axis: [f64; 3],
    /// Half-angle, radians.
    pub half_angle_rad: f64,
    /// Brightness of the disc, counts.
    pub lit: f64,
    /// Brightness of the sky, counts.
    pub dark: f64,
    /// Width of the edge from sky to disc, pixels.
    pub edge_px: f64,
}

impl Canvas {
    /// Works out the rays.
    pub fn new(camera: Camera<f64>) -> Self {
        let (w, h) = (camera.width(), camera.height());
        let place = |i: u32| ImagePoint { u: f64::from(i % u32::from(w)), v: f64::from(i / u32::from(w)) };
        let rays = (0..u32::from(w) * u32::from(h)).map(|i| camera.unproject(place(i)).map(|ray| ray.xyz())).collect();
        Self { camera, rays }
    }

    /// The lens.
    pub fn camera(&self) -> &Camera<f64> {
        &self.camera
    }

    /// The picture of a disc, 8 bits, row by row; what the lens does not see is sky.
    pub fn paint(&self, disc: &Even) -> Vec<u8> {
        let width = usize::from(self.camera.width());
        let cos = disc.half_angle_rad.cos();
        let along = |i: usize| {
            let ray = self.rays.get(i).copied().flatten()?;
            Some(ray.iter().zip(&disc.axis).map(|(s, e)| s * e).sum::<f64>())
        };
        (0..self.rays.len())
            .map(|i| {
                let part = along(i).map_or(0.0, |here| {
                    // How the cosine changes from pixel to pixel, so that the edge is measured in pixels.
                    let change = |step: usize| {
                        let (before, after) = (i.checked_sub(step).and_then(along), along(i + step));
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

    /// The part of the disc's outline in the picture, 0 to 1: of 360 places.
    pub fn outline_in_view(&self, disc: &Even) -> f64 {
        let Some(axis) = UnitVec3::<hzn_core::frames::Cam, f64>::try_new(disc.axis) else { return 0.0 };
        let e = nalgebra::Vector3::from(axis.xyz());
        let b1 = e.cross(&e.map(|x| if x.abs() < 0.6 { 1.0 } else { 0.0 })).normalize();
        let b2 = e.cross(&b1);
        let (sin, cos) = disc.half_angle_rad.sin_cos();
        let seen = |degree: u32| {
            let (s, c) = f64::from(degree).to_radians().sin_cos();
            let ray = e * cos + (b1 * c + b2 * s) * sin;
            let p = UnitVec3::try_new(ray.into()).and_then(|ray| self.camera.project(&ray));
            p.is_some_and(|p| {
                (0.0..f64::from(self.camera.width()) - 1.0).contains(&p.u)
                    && (0.0..f64::from(self.camera.height()) - 1.0).contains(&p.v)
            })
        };
        (0..360).filter(|&d| seen(d)).count() as f64 / 360.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};

    #[test]
    fn a_disc_has_its_size_and_place() {
        let config = Config::ideal(Model::Equidistant, 200, 160, 100.0);
        let canvas = Canvas::new(Camera::try_new(&config).unwrap());
        let disc = Even { axis: [0.0, 0.0, 1.0], half_angle_rad: 0.4, lit: 200.0, dark: 0.0, edge_px: 1.0 };
        let picture = canvas.paint(&disc);
        // 40 px of radius: its area, and the same on both sides of the centre.
        let area = picture.iter().map(|&p| f64::from(p)).sum::<f64>() / 200.0;
        assert!((area - std::f64::consts::PI * 1600.0).abs() < 5.0, "{area}");
        assert!((0..80).all(|y| (0..200).all(|x| picture[y * 200 + x].abs_diff(picture[(159 - y) * 200 + x]) <= 1)));
        assert_eq!(canvas.outline_in_view(&disc), 1.0);
        let aside = Even { axis: [1f64.sin(), 0.0, 1f64.cos()], ..disc };
        let part = canvas.outline_in_view(&aside);
        assert!((0.4..0.6).contains(&part), "{part}");
    }
}
