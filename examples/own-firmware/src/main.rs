//! A horizon sensor on a microcontroller: one picture, one direction.

#![no_std]
#![no_main]

use core::fmt::Write;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hio};
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::{Config, FlightHorizon, Prior};
use static_cell::ConstStaticCell;

const WIDTH: u16 = 64;
const HEIGHT: u16 = 48;
type Pixels = [u8; WIDTH as usize * HEIGHT as usize];

// All zeros, so they take no flash and never pass over the stack.
static HORIZON: ConstStaticCell<FlightHorizon> = ConstStaticCell::new(FlightHorizon::empty());
static PIXELS: ConstStaticCell<Pixels> = ConstStaticCell::new([0; WIDTH as usize * HEIGHT as usize]);

#[entry]
fn main() -> ! {
    let (Some(horizon), Some(pixels)) = (HORIZON.try_take(), PIXELS.try_take()) else { exit(debug::EXIT_FAILURE) };
    let Ok(mut console) = hio::hstdout() else { exit(debug::EXIT_FAILURE) };
    match configure(horizon).and_then(|()| look(horizon, pixels)) {
        Ok(nadir) => {
            // A console that is gone does not stop the sensor.
            let _ = writeln!(console, "nadir in the camera, millionths: {:?}", nadir.map(|x| (x * 1e6) as i32));
            exit(debug::EXIT_SUCCESS)
        }
        Err(why) => {
            let _ = writeln!(console, "no answer: {why}");
            exit(debug::EXIT_FAILURE)
        }
    }
}

/// Makes the sensor in its place. The configuration is on the stack only until this function returns.
#[inline(never)]
fn configure(horizon: &mut FlightHorizon) -> Result<(), &'static str> {
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 60.0));
    config.body.altitude_km = Some(230.0);
    horizon.configure(&config).map_err(|error| error.field)
}

/// Takes a picture, and returns the direction of the planet's centre in the camera.
fn look(horizon: &mut FlightHorizon, pixels: &mut Pixels) -> Result<[f32; 3], &'static str> {
    take_picture(pixels);
    let picture = Grey::try_new(&pixels[..], Layout::packed(WIDTH.into(), HEIGHT.into(), 1, 8));
    let picture = picture.map_err(|_| "the picture is not whole")?;
    let prior = Prior { altitude_m: Some(231.5e3), ..Prior::default() };
    let expected = horizon.expect(&prior).map_err(|_| "the altitude is impossible")?;
    let report = horizon.process(&picture, &expected);
    let solution = report.solution.as_ref().ok_or(report.status.name())?;
    Ok(solution.axis.xyz())
}

/// Stands for your camera: it draws a planet whose centre is 75 degrees below the optical axis.
fn take_picture(pixels: &mut Pixels) {
    for (pixel, i) in pixels.iter_mut().zip(0u16..) {
        let x = (f32::from(i % WIDTH) - 31.5) / 60.0;
        let y = (f32::from(i / WIDTH) - 23.5) / 60.0;
        // The sine and cosine of 75 degrees, and the cosine of the half-angle of the planet, 74.8 degrees.
        let (sin, cos, limb) = (0.965_926, 0.258_819, 0.262_189);
        let along = (y * sin + cos) / sqrt(x * x + y * y + 1.0);
        *pixel = (110.0 + 90.0 * ((along - limb) * 60.0).clamp(-1.0, 1.0)) as u8;
    }
}

/// Computes a square root by Newton's method: `core` has none.
fn sqrt(x: f32) -> f32 {
    (0..8).fold(x, |root, _| 0.5 * (root + x / root))
}

fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}

unsafe extern "C" {
    /// Is not defined anywhere: a program that can panic does not link.
    safe fn panic_path_is_linked() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    panic_path_is_linked()
}
