//! A picture in memory: draws a limb with known truth, finds it, and compares the answer with its own covariance.
//!
//! Run it with `cargo run --example picture -p hzn-core --features std`.

mod drawing;

use hzn_core::camera::{self, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, HostHorizon, Prior};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A rocket's camera, 120 km above the Earth.
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 500.0));
    config.body.altitude_km = Some(120.0);
    let mut horizon = HostHorizon::boxed(&config)?;
    let expected = horizon.expect(&Prior::default())?;

    // The limb lies in the lower half of the picture: the axis points down and a little forward.
    let truth = UnitVec3::try_new([0.1, 1.0, 0.2]).ok_or("an axis of length zero")?;
    let data = drawing::limb(&config.camera, &truth, expected.half_angle_rad());
    let picture = Grey::try_new(&data, Layout::packed(640, 480, 1, 8))?;

    let report = horizon.process(&picture, &expected);
    let solution = report.solution.ok_or_else(|| format!("no limb: {}", report.status))?;
    let error_rad = solution.axis.angle_rad(&truth);
    let sigma_rad = solution.covariance.sigma_max_rad();
    println!("axis in the camera {:?}", solution.axis.xyz());
    println!("error {:.4} deg, sigma {:.4} deg", error_rad.to_degrees(), sigma_rad.to_degrees());
    println!("{} inliers, {:.3} px RMS", solution.inliers, solution.rms_px);
    assert!(error_rad < 4.0 * sigma_rad, "the error is beyond the covariance");
    Ok(())
}
