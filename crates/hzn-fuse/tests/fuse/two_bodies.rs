//! Limb and Sun in one camera: each has a slow error of its own, whether they come in one recording or in two.

use crate::common::{flight, flights, scene};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Body, Inputs, Recording};
use hzn_fuse::{Settings, fuse, truth};
use hzn_nav::frames::{Rotation, Vector};

/// Settings whose noise is that of the simulation.
fn settings() -> Settings {
    let mut settings = Settings::default();
    settings.imu.gyro_noise_deg_rth[1] = 0.3;
    settings.imu.accel_noise_mg_rthz[1] = 0.3;
    settings.camera.white_rad = 4e-4;
    settings.limb_height.sigma_km = Some(0.5);
    settings
}

/// Returns the same flight with a recording for each camera and body.
fn by_body(inputs: &Inputs) -> Inputs {
    let of = |recording: &Recording, body: Body| {
        let seen = recording.seen.iter().copied().filter(|seen| seen.body == body).collect();
        // Two recordings of one time must have different mounts; this one is 0.01 degrees off.
        let turn = Rotation::from_scaled_axis(Vector::new(if body == Body::Sun { 2e-4 } else { 0.0 }, 0.0, 0.0));
        let name = format!("{}-{}", recording.name, body.name());
        Recording { name, mount: recording.mount.map(|mount| mount * turn), seen, ..recording.clone() }
    };
    let recordings = inputs.recordings.iter().flat_map(|r| [Body::Limb, Body::Sun].map(|body| of(r, body)));
    Inputs { recordings: recordings.filter(|r| !r.seen.is_empty()).collect(), ..inputs.clone() }
}

#[test]
fn limb_and_sun_in_one_camera_are_as_honest_as_in_two() {
    let mut nees = [Vec::new(), Vec::new()];
    let flights = flights(6, 20);
    for seed in 1001..=1000 + flights {
        let scene = scene(seed);
        let inputs = flight(&scene);
        let rows: Vec<_> = scene.path().unwrap().vehicle_rows([0.0, 430.0], 10.0).collect();
        for (nees, inputs) in nees.iter_mut().zip([inputs.clone(), by_body(&inputs)]) {
            // A flight without two directions at its beginning has no first attitude.
            let Ok(fused) = fuse(&inputs, &settings(), Wanted { rate_hz: Some(1.0), ..Wanted::default() }) else {
                continue;
            };
            let misses = truth::compare(&fused.epochs, &rows);
            nees.push(misses.iter().map(|m| m.nees).sum::<f64>() / misses.len() as f64);
        }
    }
    let means = nees.each_ref().map(|nees| nees.iter().sum::<f64>() / nees.len() as f64);
    println!("NEES {means:.2?} (ideal 3): {nees:.2?}");
    assert!(
        nees.iter().all(|nees| 5 * nees.len() as u64 >= 2 * flights) && means.iter().all(|m| (1.5..5.0).contains(m)),
        "{nees:.2?}"
    );
}
