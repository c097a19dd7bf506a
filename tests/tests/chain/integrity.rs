//! The integrity of answers in telemetry: that of the same sensor on this machine, to the last bit, and that of the
//! sensor in double precision, which `hzn run` has by default.

use hzn_core::image::{Channel, ImageView, Layout};
use hzn_core::{Config, Prior};
use hzn_flight::answer::PictureAnswer;
use hzn_flight::assembly::Assembly;
use hzn_flight::packet::{self, Apid, Scan};
use hzn_host::Compiled;
use hzn_sim::flight::rocket;
use hzn_tests::Sensors;
use hzn_tests::emulated::Case;

use crate::flight_artefacts::{fly, navigate};

/// Returns the answer of the flight software to a picture from this position, put together from its packets, and the
/// number of integrity packets.
fn answer(sensor: &Config, pixels: &[u8], position_m: [f64; 3]) -> (PictureAnswer, usize) {
    let sent = fly(sensor.clone(), pixels.to_vec(), &[navigate(position_m)]);
    let (mut rest, mut assembly, mut answer, mut packets) = (&sent[..], Assembly::default(), None, 0);
    while let Scan::Packet { end, packet } = packet::scan(rest) {
        rest = &rest[end..];
        let apid = Apid::from_number(packet.apid).unwrap();
        packets += usize::from(apid == Apid::Integrity);
        answer = assembly.take(apid, packet.user).flatten().map(|picture| picture.answer).or(answer);
    }
    (answer.expect("the picture has a science packet"), packets)
}

/// Returns the larger difference of two numbers relative to the first.
fn relative(a: f64, b: f64) -> f64 {
    ((b - a) / a).abs()
}

#[test]
fn telemetry_has_the_integrity_of_a_run() {
    let (mut compared, mut worst_p, mut worst_level, mut worst_common) = (0, 0.0f64, 0.0f64, 0.0f64);
    for flight in [rocket(640, 480, 8, 1), rocket(960, 540, 6, 2).with_payload()] {
        let mut sensors = Sensors::new(&flight.sensor);
        let factor = flight.sensor.protection_factor(0).unwrap();
        let camera = &flight.sensor.camera;
        let layout = Layout::packed(camera.width.into(), camera.height.into(), 1, 8);
        for frame in &flight.frames {
            let bytes = Case::rendered(frame.file.clone(), &flight.sensor, frame).bytes;
            let view = ImageView::from_bytes(&bytes, layout, Channel::Mean).unwrap();
            let position_m = frame.prior().position_m.unwrap();
            let (sent, packets) = answer(&flight.sensor, &bytes, position_m);

            let position_m = Some(position_m.map(|x| x as f32));
            let expected = sensors.flight.expect(&Prior { position_m, ..Prior::default() }).unwrap();
            let here = PictureAnswer::from_report(&sensors.flight.find(view, &expected), &flight.sensor);
            assert_eq!((sent.integrity, packets), (here.integrity, usize::from(sent.direction.is_some())));

            let position_m = frame.prior().position_m;
            let expected = sensors.host.expect(&Prior { position_m, ..Prior::default() }).unwrap();
            let host = sensors.host.find(view, &expected).solution;
            let (Some(sent), Some(host)) = (sent.integrity, host) else { continue };
            let common = host.common.unwrap();
            compared += 1;
            worst_p = worst_p.max((host.p_limb.unwrap() - sent.p_limb().unwrap()).abs());
            let level_rad = factor * host.covariance.sigma_max_rad();
            worst_level = worst_level.max(relative(level_rad, sent.protection_rad().unwrap()));
            let trace = |[xx, _, _, yy, _, zz]: [f64; 6]| xx + yy + zz;
            let there = trace(sent.cov_common.map(f64::from));
            worst_common = worst_common.max(relative(trace(common.upper_rad2), there));
        }
    }
    println!("{compared} answers: p_limb {worst_p:.1e}, level {worst_level:.1e}, common part {worst_common:.1e}");
    assert!(compared >= 12 && worst_p < 1e-3 && worst_level < 1e-3 && worst_common < 1e-3);
}

/// The gate judges the number that is sent. Above it there is no answer, or that of another look at the picture, which
/// is above the limit.
#[test]
fn the_gate_judges_the_number_that_is_sent() {
    let flight = rocket(640, 480, 1, 1);
    let (frame, mut sensor) = (&flight.frames[0], flight.sensor.clone());
    let bytes = Case::rendered(frame.file.clone(), &sensor, frame).bytes;
    let position_m = frame.prior().position_m.unwrap();
    // Smaller odds move the probability away from 1, where single precision has no room above it.
    sensor.gates.prior_odds = 1.0;
    let p_limb = answer(&sensor, &bytes, position_m).0.integrity.unwrap().p_limb().unwrap();
    assert!((0.01..0.999).contains(&p_limb), "{p_limb}");
    let mut judge = |least: f64| {
        sensor.gates.min_p_limb = least;
        let (sent, packets) = answer(&sensor, &bytes, position_m);
        let is_answered = sent.direction.is_some();
        assert_eq!((sent.integrity.is_some(), packets), (is_answered, usize::from(is_answered)), "{least}");
        sent.integrity.and_then(|i| i.p_limb())
    };
    assert_eq!(judge(p_limb - 1e-6), Some(p_limb));
    assert!(judge(p_limb + 1e-6).is_none_or(|other| other > p_limb));
    assert_eq!(judge(0.9999), None);
}
