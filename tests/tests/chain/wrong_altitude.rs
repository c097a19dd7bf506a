//! What a wrong altitude does to the answers. With a sigma that covers the error, no answer is far beyond its sigma.
//! The test prints the figures of the case for trusting hzn.

use hzn_core::body;
use hzn_core::status::Status;
use hzn_core::{Config, Prior};
use hzn_host::Compiled;
use hzn_sim::flight::{FlightFrame, rocket};
use hzn_sim::{Flight, Picture};
use hzn_tests::Sensors;

/// Counts of one altitude error.
#[derive(Debug, Default)]
struct Count {
    answered: usize,
    beyond_3_sigma: usize,
    beyond_5_sigma: usize,
    worst_deg: f64,
}

/// Processes pictures with altitudes that are wrong by `error_km`.
fn count(flights: &[(Flight, Vec<Picture>)], error_km: f64, body_of: impl Fn(&Config) -> body::Config) -> Count {
    let mut count = Count::default();
    for (flown, pictures) in flights {
        let config = Config { body: body_of(&flown.sensor), ..flown.sensor.clone() };
        let mut sensor = Sensors::new(&config).host;
        for (frame, picture) in flown.frames.iter().zip(pictures) {
            let altitude_m = Some(1e3 * (frame.row().altitude_km + error_km));
            let expected = sensor.expect(&Prior { altitude_m, ..Prior::default() }).unwrap();
            let report = sensor.find(picture.view(), &expected);
            let Some(solution) = report.solution.filter(|_| report.status == Status::Ok) else { continue };
            let error_rad = error_rad(frame, solution.axis.xyz());
            let sigmas = error_rad / solution.covariance.sigma_max_rad();
            count.answered += 1;
            count.beyond_3_sigma += usize::from(sigmas > 3.0);
            count.beyond_5_sigma += usize::from(sigmas > 5.0);
            count.worst_deg = count.worst_deg.max(error_rad.to_degrees());
        }
    }
    count
}

fn error_rad(frame: &FlightFrame, axis: [f64; 3]) -> f64 {
    let truth = frame.truth().unwrap();
    let cos: f64 = axis.iter().zip([truth.axis_x, truth.axis_y, truth.axis_z]).map(|(a, b)| a * b).sum();
    cos.min(1.0).acos()
}

#[test]
fn a_sigma_that_covers_the_altitude_covers_the_answer() {
    // Seeds that occur nowhere else; the payload hides a part of the limb.
    let flights: Vec<(Flight, Vec<Picture>)> = [9301, 9302, 9303]
        .map(|seed| {
            let flown = rocket(960, 540, 14, seed).with_payload();
            let pictures = flown.frames.iter().map(|f| f.render().unwrap()).collect();
            (flown, pictures)
        })
        .into();
    for error_km in [0.0, 5.0, -25.0, 20.0, 45.0] {
        let default = count(&flights, error_km, |_| body::Config::default());
        let covered = count(&flights, error_km, |_| body::Config { altitude_sigma_km: 50.0, ..Default::default() });
        // A sensor that claims to know both heights.
        let claimed = count(&flights, error_km, |sensor| body::Config {
            altitude_sigma_km: 0.05,
            limb_height_sigma_km: 0.9,
            ..sensor.body.clone()
        });
        println!("altitude {error_km:+} km\n  default {default:?}\n  50 km {covered:?}\n  claimed {claimed:?}");
        assert!(covered.answered >= 30 && covered.beyond_5_sigma == 0, "{error_km}: {covered:?}");
        assert_eq!(default.beyond_5_sigma, 0, "{error_km}: {default:?}");
    }
}
