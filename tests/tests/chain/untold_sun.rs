//! What it costs by day that nothing tells where the Sun is: sigma has a term for light below the limb then. The test
//! prints the figures of book/results/reliability.md.

use hzn_core::{Config, HostHorizon, Prior, Report, body};
use hzn_files::truth::Truth;
use hzn_host::Compiled;
use hzn_sim::{FlightFrame, Scenario};

/// Answers of one scene.
#[derive(Default)]
struct Answers {
    /// Sigma with an unknown Sun over that with the Sun's elevation.
    ratios: Vec<f64>,
    lost: usize,
    beyond_3_sigma: usize,
    errors_deg2: f64,
}

impl Answers {
    fn add(&mut self, truth: &Truth, told: &Report<f64>, untold: &Report<f64>) {
        let Some(with) = &told.solution else { return };
        let Some(without) = &untold.solution else {
            self.lost += 1;
            return;
        };
        let error_rad = angle_rad(without.axis.xyz(), [truth.axis_x, truth.axis_y, truth.axis_z]);
        let sigma_rad = without.covariance.sigma_max_rad();
        self.ratios.push(sigma_rad / with.covariance.sigma_max_rad());
        self.beyond_3_sigma += usize::from(error_rad > 3.0 * sigma_rad);
        self.errors_deg2 += error_rad.to_degrees().powi(2);
    }

    /// Returns the median of the ratios.
    fn cost(&mut self) -> f64 {
        self.ratios.sort_by(f64::total_cmp);
        self.ratios[self.ratios.len() / 2]
    }
}

fn angle_rad(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>().min(1.0).acos()
}

/// Returns the position, and the same with the elevation of the Sun at the point below the camera.
fn priors(frame: &FlightFrame, truth: &Truth) -> [Prior<f64>; 2] {
    let untold = Prior { rate_rad_s: None, ..frame.prior() };
    let sun = [truth.sun_x, truth.sun_y, truth.sun_z].map(|x| x.expect("the scene has a Sun"));
    let sine: f64 = [truth.axis_x, truth.axis_y, truth.axis_z].iter().zip(sun).map(|(down, sun)| -down * sun).sum();
    [Prior { sun_elevation_rad: Some(sine.asin()), ..untold }, untold]
}

/// Flies a scene with the default values of `[body]`, and with its own limb height and noise.
fn fly(name: &str, seed: u64, answers: &mut [Answers; 2]) {
    let mut scene = Scenario::builtin(name).unwrap();
    scene.seed = seed;
    scene.capture.frames = if std::env::var_os("HZN_ALL").is_some() { 24 } else { 8 };
    let own = scene.sensor();
    let default = Config { body: body::Config::default(), ..own.clone() };
    let mut sensors = [default, own].map(|config| HostHorizon::boxed(&config).unwrap());
    for frame in &scene.flight().unwrap().frames {
        let (picture, truth) = (frame.render().unwrap(), frame.truth().unwrap());
        for (sensor, answers) in sensors.iter_mut().zip(answers.iter_mut()) {
            let [told, untold] = priors(frame, &truth).map(|prior| {
                let expected = sensor.expect(&prior).unwrap();
                sensor.find(picture.view(), &expected)
            });
            answers.add(&truth, &told, &untold);
        }
    }
}

#[test]
fn an_untold_sun_costs_little_by_day() {
    for name in ["rocket", "rocket-clean", "horace-wide"] {
        let mut answers = <[Answers; 2]>::default();
        [9101, 9102].into_iter().for_each(|seed| fly(name, seed, &mut answers));
        for (sensor, mut answers) in ["default", "own"].into_iter().zip(answers) {
            let (cost, n) = (answers.cost(), answers.ratios.len());
            let Answers { lost, beyond_3_sigma, errors_deg2, .. } = answers;
            let rms_deg = (errors_deg2 / n as f64).sqrt();
            println!("{name}, {sensor}: {n} answers, {lost} lost, RMS {rms_deg:.3}°, sigma × {cost:.2}");
            // With the whole change of the contrast in it, the term cost up to a factor of four.
            assert!(cost < 2.0 && lost == 0 && beyond_3_sigma == 0, "{name}, {sensor}");
        }
    }
}
