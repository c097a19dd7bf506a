//! Ideal lenses, as a first guess without any input of the user.
//!
//! The shape of the lens is guessed as ideal, with the principal point in the middle. One unknown is left, the focal
//! length. For each of a series of focal lengths every picture has a pose, and its observations have residuals. The
//! focal length with the smallest residuals is the guess.

use hzn_core::camera::{Config, Equation, Model, Projection};

use crate::adjust::Block;

/// Angles off axis of the picture's farthest corner that are tried, in degrees: from long lenses to fisheyes whose
/// image circle lies within the picture. Steps of 12 % are well within the range from which the adjustment converges.
const FIRST_DEG: f64 = 3.0;
const STEP: f64 = 1.12;
/// Largest angle off axis for a lens of the plane, which ends below 90°, and for other lenses.
const MAX_PLANAR_DEG: f64 = 80.0;
const MAX_DEG: f64 = 160.0;

/// Returns the best of a series of ideal lenses with the poses that `poses` finds for it; `None` if no lens has poses
/// for half of the pictures.
pub(crate) fn guess<P>(
    model: Model,
    size_px: [u16; 2],
    poses: impl Fn(&Config) -> Vec<P>,
    block: impl Fn(&P) -> Option<&Block>,
) -> Option<(Config, Vec<P>)> {
    let end_deg = if model.is_planar() { MAX_PLANAR_DEG } else { MAX_DEG };
    let steps = ((end_deg / FIRST_DEG).ln() / STEP.ln()) as i32;
    let tried = (0..=steps).map(|step| {
        let config = ideal(model, size_px, (FIRST_DEG * STEP.powi(step)).to_radians());
        let found = poses(&config);
        (score(&config, found.iter().map(&block)), config, found)
    });
    let (score, mut config, found) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    prefer_negative_xi(&mut config);
    score.is_finite().then_some((config, found))
}

/// Starts the double sphere near the lenses of its paper (Usenko, Demmel & Cremers 2018, table 2: ξ from −0.3 to 0).
/// Two sets of parameters, one with ξ below 0 and one above, give nearly the same lens; this start chooses between
/// them. The focal length keeps the scale in the middle of the picture, f/(1 + ξ).
fn prefer_negative_xi(config: &mut Config) {
    if config.model == Model::DoubleSphere {
        let (xi, alpha) = (-0.2, 0.6);
        config.k = [xi, alpha].into_iter().collect();
        config.fx_px *= 1.0 + xi;
        config.fy_px *= 1.0 + xi;
    }
}

/// Returns the ideal lens that sees `corner_rad` off axis in the picture's corners.
fn ideal(model: Model, [width, height]: [u16; 2], corner_rad: f64) -> Config {
    let half_diagonal_px = 0.5 * f64::from(width).hypot(f64::from(height));
    let mut config = Config::ideal(model, width, height, half_diagonal_px / radius(model, corner_rad));
    let shape: &[f64] = match model {
        // These values make both lenses stereographic: r = 2 tan(θ/2), between pinhole and equidistant.
        Model::DoubleSphere => &[0.0, 0.5],
        Model::Eucm => &[0.5, 1.0],
        _ => &[],
    };
    config.k = shape.iter().copied().collect();
    config
}

/// Returns the image radius of the ideal lens, in focal lengths.
fn radius(model: Model, theta_rad: f64) -> f64 {
    match model.projection() {
        Projection::Plane => theta_rad.tan(),
        Projection::Angle => theta_rad,
        Projection::Own => 2.0 * (theta_rad / 2.0).tan(),
    }
}

/// Returns the ray of an image point for the ideal lens.
pub(crate) fn unproject(config: &Config, [u, v]: [f64; 2]) -> [f64; 3] {
    let (x, y) = ((u - config.cx_px) / config.fx_px, (v - config.cy_px) / config.fy_px);
    let r = x.hypot(y);
    let theta = match config.model.projection() {
        Projection::Plane => r.atan(),
        Projection::Angle => r.min(std::f64::consts::PI),
        Projection::Own => 2.0 * (r / 2.0).atan(),
    };
    let (sin, cos) = theta.sin_cos();
    let scale = if r > 0.0 { sin / r } else { 1.0 };
    [x * scale, y * scale, cos]
}

/// Returns the median over the pictures of their RMS residuals, px; a picture without a pose counts as infinitely bad.
fn score<'a>(config: &Config, blocks: impl Iterator<Item = Option<&'a Block>>) -> f64 {
    let lens = Equation::new(config);
    let rms = |block: &Block| {
        let squares: Vec<f64> = block.residuals_px(&lens).iter().map(|[u, v]| u * u + v * v).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let or_infinite = |rms: f64| if rms.is_finite() { rms } else { f64::INFINITY };
    let mut all: Vec<f64> = blocks.map(|block| block.map_or(f64::INFINITY, |b| or_infinite(rms(b)))).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::INFINITY)
}
