//! The check that figures next to a limb leave the limb and the sky clear.

use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;
use hzn_sim::error::SceneError;
use hzn_sim::limb::{EdgeNoise, LimbPoint};
use hzn_sim::scene::Scene;
use nalgebra::Vector3;

use super::kind::Kind;
use super::recipe::Figures;

/// Light of a figure at the limb above which the figure disturbs it.
const MAX_DISTURBANCE: f32 = 0.03;
/// Largest share of the limb that may be disturbed.
const MAX_DISTURBED_SHARE: f64 = 0.1;
/// Number of grid points per side at which the brightness of an artefact is checked.
const GRID: u32 = 24;
/// Number of points along the limb at which disturbance is checked.
const LIMB_POINTS: usize = 120;
/// Distance from these points at which disturbance is checked too, pixels.
const AROUND_PX: f32 = 12.0;

/// A limb in view without figures.
pub(super) struct ClearLimb {
    points: Vec<LimbPoint>,
    /// Grid points of the picture in pixels, and true for those in the sky.
    grid: Vec<(f64, f64, bool)>,
}

impl ClearLimb {
    /// Takes the limb of a scene; `axis` is its axis in the camera frame. Returns `None` if the limb in view is shorter
    /// than half of the picture's width.
    pub(super) fn try_new(scene: &Scene, axis: Vector3<f64>, half_angle_rad: f64) -> Result<Option<Self>, SceneError> {
        let lens = Camera::<f64>::try_new(&scene.camera)?;
        let (w, h) = (f64::from(scene.camera.width), f64::from(scene.camera.height));
        let points = scene.limb_points(LIMB_POINTS, EdgeNoise::None)?;
        if scene.visible_limb_px()? < 0.5 * w {
            return Ok(None);
        }
        let is_sky = |u: f64, v: f64| {
            let ray = lens.unproject(ImagePoint { u, v })?;
            Some(Vector3::from(ray.xyz()).dot(&axis) < libm::cos(half_angle_rad))
        };
        let grid = (0..GRID * GRID)
            .filter_map(|i| {
                let position = |k: u32, size: f64| (f64::from(k) + 0.5) / f64::from(GRID) * size;
                let (x, y) = (position(i % GRID, w), position(i / GRID, h));
                Some((x, y, is_sky(x, y)?))
            })
            .collect();
        Ok(Some(Self { points, grid }))
    }

    /// Returns true if the figures are in view, leave most of the limb undisturbed, and leave half of the sky dark.
    pub(super) fn accepts(&self, kind: Kind, figures: &Figures) -> bool {
        let disturbed = self.points.iter().filter(|p| is_disturbed(p, figures)).count();
        let bright: Vec<bool> =
            self.grid.iter().filter(|(x, y, _)| figures.is_bright(*x, *y)).map(|(.., is_sky)| *is_sky).collect();
        let bright_sky = bright.iter().filter(|&&is_sky| is_sky).count();
        let sky = self.grid.iter().filter(|(.., is_sky)| *is_sky).count();
        let is_in_view = bright.len() >= 4 || matches!(kind, Kind::Moon | Kind::Clouds | Kind::Lights);
        disturbed as f64 <= MAX_DISTURBED_SHARE * self.points.len() as f64 && 2 * bright_sky <= sky && is_in_view
    }
}

/// Returns true if figures add light at a point of the limb or next to it, or cover it.
fn is_disturbed(point: &LimbPoint, figures: &Figures) -> bool {
    let (x, y) = (point.exact.u as f32, point.exact.v as f32);
    let around = [(0.0, 0.0), (AROUND_PX, 0.0), (-AROUND_PX, 0.0), (0.0, AROUND_PX), (0.0, -AROUND_PX)];
    around.iter().any(|(dx, dy)| {
        let spots = figures.shapes.iter().map(|s| s.sample(x + dx, y + dy));
        let (light, cover) = spots.fold((0.0, 0.0f32), |(l, c), s| (l + s.light, c.max(s.cover)));
        light > MAX_DISTURBANCE || cover > MAX_DISTURBANCE
    })
}
