//! A flight computer: no heap, single precision, and the workspace in a `static`.
//!
//! Everything in `flight` builds for a microcontroller; `main` stands for the caller there and has `std` only to print.
//! Run it with `cargo run --example no_std -p hzn-core`.

#![no_std]
extern crate std;
use std::prelude::v1::*;

mod drawing;

mod flight {
    use hzn_core::camera::{self, Model};
    use hzn_core::error::ConfigError;
    use hzn_core::image::{Grey, ImageError, Layout};
    use hzn_core::observer::Unobserved;
    use hzn_core::{Config, FlightWorkspace, Prior, Report, Sensor};

    pub(crate) const WIDTH: usize = 320;
    pub(crate) const HEIGHT: usize = 240;

    /// The configuration that is built into the image; a flight computer has no file to read it from.
    pub(crate) fn sensor() -> Result<Sensor<f32>, ConfigError> {
        let lens = camera::Config::ideal(Model::Pinhole, WIDTH as u16, HEIGHT as u16, 300.0);
        let mut config = Config::new(lens);
        config.body.altitude_km = Some(230.0);
        Sensor::new(&config)
    }

    /// One frame of the camera: 8 bits a pixel, no padding between rows.
    pub(crate) fn process(
        sensor: &Sensor<f32>,
        workspace: &mut FlightWorkspace,
        frame: &[u8; WIDTH * HEIGHT],
        altitude_m: f32,
    ) -> Result<Report<f32>, ImageError> {
        let picture = Grey::try_new(frame, Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8))?;
        // A prior that is refused, such as an altitude below the limb, must not lose the frame: the configured
        // altitude stands in for it.
        let prior = Prior { altitude_m: Some(altitude_m), ..Prior::default() };
        let expected = sensor.expect(&prior).or_else(|_| sensor.expect(&Prior::default()));
        let Ok(expected) = expected else { return Err(ImageError::Size) };
        Ok(sensor.process(workspace, &picture, &expected, &Unobserved))
    }
}

use hzn_core::Prior;
use hzn_core::frames::UnitVec3;
use std::sync::Mutex;

/// Some 90 KiB of zeros: they take no room in flash. Firmware uses its own kind of cell here, without a lock.
static WORKSPACE: Mutex<hzn_core::FlightWorkspace> = Mutex::new(hzn_core::FlightWorkspace::new());

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sensor = flight::sensor()?;
    let mut workspace = WORKSPACE.lock()?;
    let axis = UnitVec3::try_new([0.0, 1.0, 0.3]).ok_or("an axis of length zero")?;
    let expected = sensor.expect(&Prior::default())?;
    let drawn = drawing::limb(&sensor.config().camera, &axis, f64::from(expected.half_angle_rad()));
    let frame = core::array::from_fn(|i| drawn[i]);

    let report = flight::process(&sensor, &mut workspace, &frame, 230e3)?;
    std::println!("{}, {} units of work", report.status, report.counters.work);
    let solution = report.solution.ok_or("no limb")?;
    std::println!("axis {:?}, sigma {:e} rad", solution.axis.xyz(), solution.covariance.sigma_max_rad());
    Ok(())
}
