//! Writes a flight without pictures as files for `hzn fuse`, into the folder that is named.
//!
//! The directions have independent errors of 0.05° (1-sigma). Studies with other errors implement
//! [`Errors`](hzn_fuse::simulated::Errors).

use std::path::Path;

use hzn_fuse::simulated::{Errors, Moment, inputs, write};
use hzn_nav::frames::{Cam, Covariance, Vector};
use hzn_sim::Scenario;

/// 1-sigma of a direction, rad.
const SIGMA_RAD: f64 = 0.05 * core::f64::consts::PI / 180.0;

/// Errors that change with every picture.
struct White(u64);

impl White {
    /// Returns a number with mean 0 and variance 1: the sum of twelve uniform numbers, minus six.
    fn normal(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

impl Errors for White {
    fn draw(&mut self, _: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let error = core::array::from_fn(|_| SIGMA_RAD * self.normal());
        (error.into(), Covariance::across(axis, SIGMA_RAD.powi(2)))
    }

    fn by_limb_height(&mut self, _: &Moment, _: &Vector<Cam>) -> Vector<Cam> {
        Vector::zeros()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: flight FOLDER")?;
    std::fs::create_dir_all(&folder)?;
    let mut scene = Scenario::builtin("atek").ok_or("the scene is built in")?;
    scene.capture.frames = 75;
    write(&scene, &inputs(&scene, &mut White(1), 0.0)?, Path::new(&folder))?;
    Ok(())
}
