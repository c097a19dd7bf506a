//! A flight computer: no heap, single precision, and the sensor in a `static`.
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
    use hzn_core::{Config, FlightHorizon, Prior, Report};

    pub(crate) const WIDTH: usize = 320;
    pub(crate) const HEIGHT: usize = 240;

    /// Configures the sensor as it is built into the image; a flight computer has no file to read this from.
    pub(crate) fn configure(horizon: &mut FlightHorizon) -> Result<(), ConfigError> {
        let lens = camera::Config::ideal(Model::Pinhole, WIDTH as u16, HEIGHT as u16, 300.0);
        let mut config = Config::new(lens);
        config.body.altitude_km = Some(230.0);
        horizon.configure(&config)
    }

    /// One frame of the camera: 8 bits a pixel, no padding between rows.
    pub(crate) fn process(
        horizon: &mut FlightHorizon,
        frame: &[u8; WIDTH * HEIGHT],
        altitude_m: f32,
    ) -> Result<Report<f32>, ImageError> {
        let picture = Grey::try_new(frame, Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8))?;
        // A prior that is refused, such as an altitude below the limb, must not lose the frame: the configured
        // altitude stands in for it.
        let prior = Prior { altitude_m: Some(altitude_m), ..Prior::default() };
        let expected = horizon.expect(&prior).or_else(|_| horizon.expect(&Prior::default()));
        let Ok(expected) = expected else { return Err(ImageError::Size) };
        Ok(horizon.process(&picture, &expected))
    }
}

use hzn_core::Prior;
use hzn_core::frames::UnitVec3;
use std::sync::Mutex;

/// Some 90 KiB of zeros: they take no room in flash. Firmware uses its own kind of cell here, without a lock.
static HORIZON: Mutex<hzn_core::FlightHorizon> = Mutex::new(hzn_core::FlightHorizon::empty());

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut horizon = HORIZON.lock()?;
    flight::configure(&mut horizon)?;
    let lens = horizon.sensor().ok_or("there is no sensor")?.config().camera.clone();
    let axis = UnitVec3::try_new([0.0, 1.0, 0.3]).ok_or("an axis of length zero")?;
    let expected = horizon.expect(&Prior::default())?;
    let drawn = drawing::limb(&lens, &axis, f64::from(expected.half_angle_rad()));
    let frame = core::array::from_fn(|i| drawn[i]);

    let report = flight::process(&mut horizon, &frame, 230e3)?;
    std::println!("{}, {} units of work", report.status, report.counters.work);
    let solution = report.solution.ok_or("no limb")?;
    std::println!("axis {:?}, sigma {:e} rad", solution.axis.xyz(), solution.covariance.sigma_max_rad());
    Ok(())
}
