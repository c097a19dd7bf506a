//! The angle where a lens stops being monotone.

use hzn_core::camera::{Config, Equation};

/// Number of azimuths that are examined: tangential distortion is not the same in all directions.
const AZIMUTHS: u32 = 16;
/// Step of the angle off axis, in degrees.
const STEP_DEG: f64 = 0.01;

/// Returns the smallest angle off axis in degrees where the image point no longer moves outwards: dr/dθ ≤ 0 along any
/// azimuth. Returns `None` if the lens is monotone as far as it has image points.
pub(super) fn limit_deg(config: &Config) -> Option<f64> {
    let equation = Equation::new(config);
    let azimuths = (0..AZIMUTHS).map(|i| core::f64::consts::TAU * f64::from(i) / f64::from(AZIMUTHS));
    azimuths.filter_map(|azimuth| along(&equation, config, azimuth)).reduce(f64::min)
}

fn along(equation: &Equation, config: &Config, azimuth: f64) -> Option<f64> {
    let (sin_a, cos_a) = azimuth.sin_cos();
    // Outwards in the picture: the focal lengths may differ.
    let outwards = [cos_a * config.fx_px, sin_a * config.fy_px];
    for step in 1..(180.0 / STEP_DEG) as u32 {
        let deg = STEP_DEG * f64::from(step);
        let (sin, cos) = deg.to_radians().sin_cos();
        let projected = equation.project([sin * cos_a, sin * sin_a, cos])?;
        let turn = [cos * cos_a, cos * sin_a, -sin];
        let slope = |row: [f64; 3]| row.iter().zip(turn).map(|(by, t)| by * t).sum::<f64>();
        let [u, v] = projected.by_direction.map(slope);
        if u * outwards[0] + v * outwards[1] <= 0.0 {
            return Some(deg);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::Model;

    #[test]
    fn limits_of_known_lenses() {
        let with =
            |model, k: &[f64]| Config { k: k.iter().copied().collect(), ..Config::ideal(model, 640, 480, 300.0) };
        // 1 + 3 k1 θ² = 0.
        let limit = limit_deg(&with(Model::KannalaBrandt, &[-0.1])).unwrap();
        assert!((limit - (1.0f64 / 0.3).sqrt().to_degrees()).abs() < 0.011, "{limit}");
        // 1 + 3 k1 r² = 0 with r = tan θ.
        let limit = limit_deg(&with(Model::BrownConrady, &[-0.2])).unwrap();
        assert!((limit - (1.0f64 / 0.6).sqrt().atan().to_degrees()).abs() < 0.011, "{limit}");
        assert_eq!(limit_deg(&with(Model::Pinhole, &[])), None);
        // r = sin θ/(α + (1 − α) cos θ) has its maximum at cos θ = −(1 − α)/α for β = 1.
        let limit = limit_deg(&with(Model::Eucm, &[0.8, 1.0])).unwrap();
        assert!((limit - (-0.25f64).acos().to_degrees()).abs() < 0.011, "{limit}");
    }
}
