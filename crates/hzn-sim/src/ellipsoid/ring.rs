//! Rings in the plane of the equator.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// `[[world.ellipsoid.rings]]`: a ring between two radii. It hides what is behind it; it casts no shadow and gets none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Inner radius, kilometres.
    pub inner_km: f64,
    /// Outer radius, kilometres.
    pub outer_km: f64,
    /// Share of the light from behind that the ring hides, 0 to 1.
    pub opacity: f64,
    /// Brightness of an opaque ring.
    pub brightness: f64,
}

/// What a ray meets in the plane of the rings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RingHit {
    /// Distance from the camera, metres.
    pub(super) range_m: f64,
    /// Share of the light from behind that is hidden.
    pub(super) opacity: f32,
    /// Light of the rings.
    pub(super) light: f32,
    /// Distance in metres from the nearest edge of a ring, measured across the ray's line of sight. At the edge the
    /// light changes within a pixel.
    pub(super) from_edge_m: f64,
}

impl Ring {
    pub(super) fn limits(&self) -> [(&'static str, f64, [f64; 2]); 4] {
        [
            ("rings.inner_km", self.inner_km, [0.0, 1e9]),
            ("rings.outer_km", self.outer_km, [self.inner_km, 1e9]),
            ("rings.opacity", self.opacity, [0.0, 1.0]),
            ("rings.brightness", self.brightness, [0.0, 100.0]),
        ]
    }
}

/// Intersects the plane of the rings with the ray of unit direction `ray` from `position_m`; `None` if the ray does not
/// meet the plane within sight of any ring.
pub(super) fn intersect(rings: &[Ring], position_m: &Vector3<f64>, ray: &Vector3<f64>) -> Option<RingHit> {
    let range_m = -position_m.z / ray.z;
    if rings.is_empty() || !(range_m > 0.0 && range_m.is_finite()) {
        return None;
    }
    let at = position_m + ray * range_m;
    let radius_m = libm::hypot(at.x, at.y);
    let mut hit = RingHit { range_m, opacity: 0.0, light: 0.0, from_edge_m: f64::INFINITY };
    for ring in rings {
        let [inner_m, outer_m] = [ring.inner_km * 1e3, ring.outer_km * 1e3];
        // A ring that is seen at a small angle is narrow across the line of sight, at most by the sine of that angle.
        let edge_m = (radius_m - inner_m).abs().min((radius_m - outer_m).abs()) * ray.z.abs();
        hit.from_edge_m = hit.from_edge_m.min(edge_m);
        if (inner_m..outer_m).contains(&radius_m) {
            // Rings do not overlap; if they do, the later one is behind.
            let share = (1.0 - hit.opacity) * ring.opacity as f32;
            hit.opacity += share;
            hit.light += share * ring.brightness as f32;
        }
    }
    Some(hit)
}
