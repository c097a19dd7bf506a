//! A lens of your own: from a table of angles to a checked calibration.
//!
//! A rotator with a collimator gives the angle off axis of each image radius. The example fits k1 to k4 of
//! `kannala-brandt` to such a table and shows how well the lens follows it. Run it with
//! `cargo run --example own_lens -p hzn-core --features std`.

use hzn_core::camera::{Camera, Config, Model};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector};

/// Angle off axis in degrees and image radius in pixels. They follow a stereographic lens, r = 2 f tan(θ/2) with
/// f = 400 px, rounded to hundredths of a pixel as a table of measurements is.
const TABLE: [(f64, f64); 9] = [
    (5.0, 34.93),
    (10.0, 69.99),
    (15.0, 105.32),
    (20.0, 141.06),
    (25.0, 177.36),
    (30.0, 214.36),
    (35.0, 252.24),
    (40.0, 291.18),
    (45.0, 331.37),
];

/// Least squares of r = f (θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹), which is linear in f and f k.
fn fit(table: &[(f64, f64)]) -> Option<(f64, [f64; 4])> {
    let powers = DMatrix::from_fn(table.len(), 5, |row, column| table[row].0.to_radians().powi(2 * column as i32 + 1));
    let radii_px = DVector::from_iterator(table.len(), table.iter().map(|(_, radius_px)| *radius_px));
    let x = powers.svd(true, true).solve(&radii_px, 1e-12).ok()?;
    Some((x[0], [x[1], x[2], x[3], x[4]].map(|c| c / x[0])))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (focal_px, k) = fit(&TABLE).ok_or("the table does not determine a lens")?;
    let mut config = Config::ideal(Model::KannalaBrandt, 480, 480, focal_px);
    config.k.extend(k);
    // The lens is used no farther out than the table goes.
    config.theta_max_deg = Some(45.0);
    // A lens that is not monotone up to there is refused here, with the angle at which it turns back.
    let camera = Camera::<f64>::try_new(&config)?;

    println!("f = {focal_px:.3} px, k = {k:.6?}");
    let mut worst_deg: f64 = 0.0;
    for (angle_deg, radius_px) in TABLE {
        let centre = camera.principal_point();
        let point = ImagePoint { u: centre.u + radius_px - 1e-6, v: centre.v };
        let Some(ray) = camera.unproject(point) else { continue };
        let [x, _, z] = ray.xyz();
        worst_deg = worst_deg.max((x.atan2(z).to_degrees() - angle_deg).abs());
    }
    println!("the lens follows the table to {worst_deg:.4} degrees");
    assert!(worst_deg < 0.01, "Kannala-Brandt does not describe this lens");
    Ok(())
}
