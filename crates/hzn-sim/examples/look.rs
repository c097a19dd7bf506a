//! Writes pictures of a built-in scene, runs the sensor over them and prints each answer with its error:
//! `look SCENE [pictures] [folder] [fit]`. With `fit` the noise model is measured first.

use std::path::PathBuf;
use std::time::Instant;

use hzn_core::HostHorizon;
use hzn_host::Compiled;
use hzn_sim::Scenario;
use hzn_sim::scenario::Fit;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments.first().map_or("rocket", String::as_str);
    let mut scenario = Scenario::builtin(name).expect("a built-in scene");
    scenario.capture.frames = arguments.get(1).and_then(|a| a.parse().ok()).unwrap_or(6);
    let folder = PathBuf::from(arguments.get(2).map_or("look", String::as_str));
    std::fs::create_dir_all(&folder).expect("the folder can be made");
    let begin = Instant::now();
    let flight = scenario.flight().expect("the scene is valid");
    println!("{name}: planned in {:.1?}", begin.elapsed());
    let mut sensor = flight.sensor.clone();
    if arguments.iter().any(|a| a == "fit") {
        let fit = Fit::measure(&scenario, 24, &|_, _| ()).expect("the scene is valid");
        println!("{fit:.3?} after {:.1?}", begin.elapsed());
        fit.iter().for_each(|fit| fit.apply(&mut sensor));
    }
    if let Some(body) = sensor.bodies.first().cloned() {
        sensor.body = body;
        sensor.bodies.clear();
    }
    let kind = sensor.body.kind;
    let mut horizon = HostHorizon::boxed(&sensor).expect("the sensor is valid");
    for frame in &flight.frames {
        let start = Instant::now();
        let picture = frame.render().expect("the scene is valid");
        let took = start.elapsed();
        picture.save(&folder.join(&frame.file)).expect("the picture can be written");
        let truth = frame.scene.body_truth(kind, &frame.file, frame.time_s).expect("the scene is valid");
        let expected = horizon.expect(&frame.prior()).expect("the position is outside the Earth");
        let report = horizon.find(picture.view(), &expected);
        let px = frame.scene.visible_px(kind).expect("the scene is valid");
        print!(
            "{} {:.0} s, {:.0} km, {px:.0} px of limb, exposure {:.2}, {took:.0?}: {}",
            frame.file,
            frame.time_s,
            truth.altitude_km,
            frame.scene.exposure,
            report.status.name()
        );
        match (report.solution, truth.axis()) {
            (Some(s), Some(axis)) => println!(
                ", error {:.4} deg, sigma {:.4} deg, {} points",
                s.axis.angle_rad(&axis).to_degrees(),
                s.covariance.sigma_max_rad().to_degrees(),
                s.inliers
            ),
            _ => println!(" {:?}", report.candidates.iter().map(|c| c.verdict.name()).collect::<Vec<_>>()),
        }
    }
}
