//! The body's share of a pixel's light, by height above the limb.

use crate::scene::Profile;

/// Number of points along each side of a pixel that is averaged by sampling.
const SAMPLES: i32 = 5;

/// The limb's profile, prepared for rendering: the body's share of the light by tangent height above the limb height.
#[derive(Debug, Clone, Copy)]
pub(super) enum Edge {
    Sharp,
    Exponential { per_m: f64, knee_m: f64 },
}

impl Edge {
    pub(super) fn new(profile: Profile) -> Self {
        match profile {
            Profile::Exponential { scale_km } if scale_km > 0.0 => {
                let scale_m = scale_km * 1e3;
                Self::Exponential { per_m: 1.0 / scale_m, knee_m: -core::f64::consts::LN_2 * scale_m }
            }
            _ => Self::Sharp,
        }
    }

    /// Returns the share at a height in metres above the limb.
    #[inline(always)]
    pub(super) fn share(&self, height_m: f64) -> f32 {
        match *self {
            Self::Sharp => f32::from(u8::from(height_m <= 0.0)),
            Self::Exponential { per_m, knee_m } => {
                let scales = ((height_m - knee_m) * per_m) as f32;
                // Less than a millionth of the light counts as none.
                if scales > 14.0 { 0.0 } else { libm::expf(-scales.max(0.0)) }
            }
        }
    }

    /// Returns the mean share over a pixel with this height in its middle and this gradient in metres per pixel.
    pub(super) fn mean_share(&self, height_m: f64, [gu, gv]: [f64; 2]) -> f32 {
        match self {
            Self::Sharp => half_plane_share(height_m, [gu, gv]),
            Self::Exponential { .. } => {
                let mut sum = 0.0;
                for i in 0..SAMPLES {
                    for j in 0..SAMPLES {
                        let [du, dv] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5);
                        sum += self.share(height_m + gu * du + gv * dv);
                    }
                }
                sum / (SAMPLES * SAMPLES) as f32
            }
        }
    }
}

/// Returns the share of a pixel that is below the limb. Its middle has this height above the limb, in metres, with this
/// gradient in metres per pixel.
pub(crate) fn half_plane_share(height_m: f64, [gu, gv]: [f64; 2]) -> f32 {
    let slope = libm::hypot(gu, gv);
    if slope > 0.0 {
        half_plane(-height_m / slope, gu / slope, gv / slope) as f32
    } else {
        f32::from(u8::from(height_m <= 0.0))
    }
}

/// Returns the share of a unit square that is in a half plane. Its border has the normal (nx, ny) and passes `inside`
/// beyond the square's middle (positive if the middle is in the half plane).
fn half_plane(inside: f64, nx: f64, ny: f64) -> f64 {
    let (a, b) = (nx.abs().max(ny.abs()), nx.abs().min(ny.abs()));
    // The share is the integral of a trapezoid, which is a box of width a smoothed by a box of width b.
    let d = inside.abs();
    let share = if d <= 0.5 * (a - b) {
        0.5 + d / a
    } else {
        let rest = (0.5 * (a + b) - d).max(0.0);
        1.0 - if rest > 0.0 { rest * rest / (2.0 * a * b) } else { 0.0 }
    };
    if inside >= 0.0 { share } else { 1.0 - share }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_plane_equals_counting() {
        for (angle, d) in [(0.0f64, 0.2), (0.3, -0.35), (0.785, 0.6), (1.2, 0.05), (2.0, -0.1), (4.0, 0.49)] {
            let (ny, nx) = angle.sin_cos();
            let n = 1000;
            let inside = (0..n * n)
                .filter(|i| {
                    let [x, y] = [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n) - 0.5);
                    x * nx + y * ny <= d
                })
                .count();
            let share = inside as f64 / f64::from(n * n);
            assert!((half_plane(d, nx, ny) - share).abs() < 2e-3, "{angle} {d}");
        }
    }

    #[test]
    fn half_brightness_is_at_the_limb_height() {
        let edge = Edge::new(Profile::Exponential { scale_km: 7.0 });
        assert!((edge.share(0.0) - 0.5).abs() < 1e-6 && edge.share(-1e4) == 1.0);
        assert!((edge.share(7e3) - 0.5 / core::f32::consts::E).abs() < 1e-6);
    }
}
