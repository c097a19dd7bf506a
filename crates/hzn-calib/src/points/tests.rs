//! Calibrations from simulated points.

use std::path::Path;

use hzn_core::camera::{Camera, Config, Model};
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::{Rotation3, Vector3};

use super::*;
use crate::draws::Draws;
use crate::lens_error::differences_px;

/// The camera of Wang et al. 2022: 384 × 288 pixels, 92 px/rad, up to 90° off axis.
fn infrared() -> Config {
    Config {
        k: [0.01, -0.006, 0.001, -0.0001].into_iter().collect(),
        theta_max_deg: Some(90.0),
        cx_px: 190.2,
        cy_px: 145.1,
        ..Config::ideal(Model::KannalaBrandt, 384, 288, 92.0)
    }
}

/// Returns the points of a rotator with positions every `step_deg`, whose axes are turned against the camera. The
/// directions have errors of `noise_deg`, the centroids of `noise_px`.
fn rotator(lens: &Config, step_deg: f64, noise_deg: f64, noise_px: f64, draws: &mut Draws) -> Points {
    let camera = Camera::<f64>::try_new(lens).unwrap();
    let mount = Rotation3::from_euler_angles(0.02, -0.03, 0.7);
    let mut points = Vec::new();
    let steps = (80.0 / step_deg) as i32;
    for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (i, j))) {
        let (azimuth, elevation) = (f64::from(i) * step_deg, f64::from(j) * step_deg);
        let ray = mount * Vector3::from(table::from_angles(azimuth, elevation));
        let Some(p) = camera.project(&UnitVec3::try_new(ray.into()).unwrap()) else { continue };
        let at_px = [p.u + noise_px * draws.normal(), p.v + noise_px * draws.normal()];
        if at_px[0] < 0.0 || at_px[1] < 0.0 || at_px[0] > 383.0 || at_px[1] > 287.0 {
            continue;
        }
        let direction =
            table::from_angles(azimuth + noise_deg * draws.normal(), elevation + noise_deg * draws.normal());
        points.push(Point { at_px, direction });
    }
    Points { name: "points".into(), points }
}

#[test]
fn a_rotator_gives_the_lens() {
    let lens = infrared();
    let camera = Camera::<f64>::try_new(&lens).unwrap();
    let (mut within, mut all) = (0, 0);
    for seed in 0..20 {
        let points = rotator(&lens, 10.0, 0.01, 0.02, &mut Draws(300 + seed));
        let found = calibrate(Model::KannalaBrandt, [384, 288], &[points]).unwrap();
        let differences = differences_px(&camera, &found.camera);
        let rms = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt();
        assert!(rms < 0.02, "{rms} px");
        let covariance = found.camera.covariance.as_ref().unwrap();
        for (n, which) in covariance.order.iter().enumerate() {
            let off = found.camera.intrinsic(*which).unwrap() - lens.intrinsic(*which).unwrap();
            within += usize::from(off.abs() < 3.0 * covariance.rows[n][n].sqrt());
            all += 1;
        }
    }
    assert!(within as f64 >= 0.97 * f64::from(all), "{within} of {all}");
}

#[test]
fn stars_of_several_pictures_have_rotations_of_their_own() {
    let lens = Config {
        cx_px: 510.0,
        k: [-0.1, 0.02, 0.0, 0.0, 0.0].into_iter().collect(),
        ..Config::ideal(Model::BrownConrady, 1024, 1024, 2400.0)
    };
    let camera = Camera::<f64>::try_new(&lens).unwrap();
    let mut draws = Draws(4);
    let picture = |n: u32, draws: &mut Draws| {
        let turn = Rotation3::from_euler_angles(f64::from(n), 0.3 * f64::from(n), 2.0);
        let star = |draws: &mut Draws| {
            let at = [1023.0 * draws.uniform(), 1023.0 * draws.uniform()];
            let ray = camera.unproject(ImagePoint { u: at[0], v: at[1] }).unwrap();
            let direction = (turn * Vector3::from(ray.xyz())).into();
            Point { at_px: at.map(|x| x + 0.1 * draws.normal()), direction }
        };
        Points { name: format!("{n}.png"), points: (0..40).map(|_| star(draws)).collect() }
    };
    let mut pictures: Vec<Points> = (0..5).map(|n| picture(n, &mut draws)).collect();
    // A star with a wrong name, and a picture with two stars.
    pictures[1].points[7].direction = pictures[1].points[8].direction;
    pictures[4].points.truncate(2);
    let found = calibrate(Model::BrownConrady, [1024, 1024], &pictures).unwrap();
    assert!((found.camera.fx_px / 2400.0 - 1.0).abs() < 1e-3, "{found:?}");
    assert!(!found.views[1].residuals[7].counts && found.views[1].dropped.is_none());
    assert_eq!(found.views[4].dropped.unwrap().to_string(), "it has 2 points, but a pose needs 3");
    assert!((found.sigma_px / 0.1 - 1.0).abs() < 0.15, "{}", found.sigma_px);
}

#[test]
fn a_wrong_table_is_refused_with_the_correction() {
    let lens = infrared();
    let good = rotator(&lens, 10.0, 0.01, 0.02, &mut Draws(9));
    let refused = |change: &dyn Fn(&mut Point), size: [u16; 2], model: Model| {
        let mut points = good.clone();
        points.points.iter_mut().for_each(change);
        calibrate(model, size, &[points]).unwrap_err().to_string()
    };
    let mirrored = refused(&|p| p.direction[0] = -p.direction[0], [384, 288], Model::KannalaBrandt);
    assert!(mirrored.contains("if the azimuth counts to the other side"), "{mirrored}");
    // The rotation of the camera is free, so exchanged pixels are a mirrored picture.
    let exchanged = refused(&|p| p.at_px = [p.at_px[1], p.at_px[0]], [384, 384], Model::KannalaBrandt);
    assert!(exchanged.contains("if the azimuth") || exchanged.contains("u_px and v_px"), "{exchanged}");
    let plane = refused(&|_| (), [384, 288], Model::Pinhole);
    assert!(plane.contains("deg off axis, but pinhole ends before 90 deg"), "{plane}");
    let few = Points { points: good.points[..4].to_vec(), ..good.clone() };
    let few = calibrate(Model::KannalaBrandt, [384, 288], &[few]).unwrap_err().to_string();
    assert_eq!(few, "there are 4 points, but this model needs at least 8; measure more points");
}

/// The same measurements again say nothing new: neither the lens nor its sigmas may change.
#[test]
fn copies_of_rows_and_of_pictures_count_once() {
    let lens = infrared();
    let points = rotator(&lens, 12.0, 0.01, 0.05, &mut Draws(21)).points;
    let row =
        |p: &Point| format!("{},{},{},{},{}\n", p.at_px[0], p.at_px[1], p.direction[0], p.direction[1], p.direction[2]);
    let rows = |file: &str| points.iter().map(|p| format!("{file},{}", row(p))).collect::<String>();
    let read =
        |rows: &str| table::parse(&format!("file,u_px,v_px,x,y,z\n{rows}"), Path::new("p.csv"), [384, 288]).unwrap();
    let once = read(&rows("a.png"));
    assert!(once.copies_in_words().is_empty());
    let again = read(&(rows("a.png").repeat(6) + &rows("b.png")));
    assert_eq!((again.copied_rows, again.pictures.len()), (5 * points.len(), 1));
    assert_eq!(again.pictures, once.pictures);
    let words = again.copies_in_words();
    assert!(words[0].contains(&format!("{} rows are earlier rows", 5 * points.len())), "{words:?}");
    assert!(words[1].starts_with("all points of b.png are those of a.png to the last bit"), "{words:?}");
    // The same source a nanopixel further is another measurement.
    let [u, v] = points[0].at_px;
    let other = row(&Point { at_px: [u + 1e-9, v], ..points[0] });
    assert_eq!(read(&(rows("a.png") + "a.png," + &other)).copied_rows, 0);
}

#[test]
fn the_table_is_checked_line_by_line() {
    let read = |text: &str| table::parse(text, Path::new("p.csv"), [640, 480]);
    let good = read("file,u_px,v_px,azimuth_deg,elevation_deg\na.png,1,2,90,0\n# a comment\nb.png,3,4,0,90\n").unwrap();
    let good = good.pictures;
    assert_eq!(good.len(), 2);
    assert!(
        (good[0].points[0].direction[0] - 1.0).abs() < 1e-12 && (good[1].points[0].direction[1] + 1.0).abs() < 1e-12
    );
    assert_eq!(read("u_px,v_px,x,y,z\n1,2,0,0,1.001\n").unwrap().pictures[0].points[0].direction, [0.0, 0.0, 1.0]);
    let error = |text: &str| read(text).unwrap_err().to_string();
    assert!(
        error("u_px,v_px,azimut_deg,elevation_deg\n")
            .starts_with("p.csv:1: azimut_deg: unknown column; did you mean azimuth_deg?")
    );
    assert!(error("u_px,azimuth_deg,elevation_deg\n").starts_with("p.csv:1: v_px: missing"));
    assert!(error("u_px,v_px,x,y,z,azimuth_deg,elevation_deg\n").contains("keep one of the two"));
    assert_eq!(error("u_px,v_px,x,y,z\n1,2,0,0,1.1\n"), "p.csv:2: x: the vector has the length 1.1000, not 1");
    assert_eq!(error("u_px,v_px,x,y,z\n1,two,0,0,1\n"), "p.csv:2: v_px: \"two\" is not a finite number");
    assert!(error("u_px,v_px,azimuth_deg,elevation_deg\n1,2,3,120\n").contains("120 is not between -90 and 90"));
    assert!(
        error("u_px,v_px,azimuth_deg,elevation_deg\n1,500,3,0\n").contains("500 is outside a picture of 640 x 480 px")
    );
    assert_eq!(error("u_px,v_px,x,y,z\n"), "p.csv: the table has no rows");
}
