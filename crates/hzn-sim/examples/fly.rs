//! Flies the built-in flights through the sensor and prints each answer with its error:
//! `fly [rocket|payload|leo] [width] [count] [seed] [sigma of a prior attitude in degrees]`.

use hzn_core::{HostHorizon, camera::Config};
use hzn_host::Compiled;
use hzn_sim::flight::{leo_infrared, rocket};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, or: u64| arguments.get(i).and_then(|a| a.parse().ok()).unwrap_or(or);
    let (width, count, seed) = (number(1, 1920) as u16, number(2, 24) as usize, number(3, 1));
    let prior_deg: Option<f64> = arguments.get(4).and_then(|a| a.parse().ok());
    let height = (u32::from(width) * 9 / 16) as u16;
    let flight = match arguments.first().map(String::as_str) {
        Some("leo") => leo_infrared(count, seed),
        Some("payload") => rocket(width, height, count, seed).with_payload(),
        _ => rocket(width, height, count, seed),
    };
    let Config { width, height, .. } = flight.sensor.camera;
    println!("{} {width}x{height}", flight.name);
    let mut horizon = HostHorizon::boxed(&flight.sensor).expect("the flight's sensor is valid");
    let (mut square, mut nees, mut answered) = (0.0, 0.0, 0);
    for frame in &flight.frames {
        let truth = frame.truth().expect("the scene is valid");
        let picture = frame.render().expect("the scene is valid");
        let prior = prior_deg.map_or_else(|| frame.prior(), |deg| frame.prior_with_attitude(deg.to_radians()));
        let expected = horizon.expect(&prior).expect("the position is outside the Earth");
        let report = horizon.find(picture.view(), &expected);
        let listed: Vec<&str> = report.candidates.iter().map(|c| c.verdict.name()).collect();
        let status = report.status.name();
        let Some(solution) = report.solution else {
            println!("{}: {status}, level {}, {listed:?}", frame.file, report.level);
            continue;
        };
        let axis = truth.axis().expect("the truth has an axis");
        let error_deg = solution.axis.angle_rad(&axis).to_degrees();
        let sigma_deg = solution.covariance.sigma_max_rad().to_degrees();
        // The covariance has rank 2. The square of the null direction is added, which gives the pseudo-inverse.
        let [p, e] = [solution.covariance.rows(), [solution.axis.xyz(); 3]];
        let e = e[0];
        let scale = p[0][0] + p[1][1] + p[2][2];
        let full = nalgebra::Matrix3::from_fn(|i, j| p[i][j] + scale * e[i] * e[j]);
        let d = nalgebra::Vector3::from(axis.xyz()) - nalgebra::Vector3::from(e);
        let one = full.try_inverse().map_or(f64::NAN, |inverse| d.dot(&(inverse * d)));
        println!(
            "{}: error {error_deg:.4}° sigma {sigma_deg:.4}° NEES {one:.2} rms {:.2} px, {} of {} points, half-angle \
             {:+.3}°, {listed:?}",
            frame.file,
            solution.rms_px,
            solution.inliers,
            report.counters.edge_points,
            solution.half_angle_rad.to_degrees() - truth.half_angle_deg,
        );
        square += error_deg * error_deg;
        nees += one;
        answered += 1;
    }
    let n = f64::from(answered);
    println!("{answered} of {} answered, {:.4}° RMS, NEES {:.2}", flight.frames.len(), (square / n).sqrt(), nees / n);
}
