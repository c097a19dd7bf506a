//! Sensors as bytes: the same sensor comes back, and no bytes panic.

use crate::common::{KINDS, garbage};
use hzn_core::body::Prior;
use hzn_core::camera::{self, Covariance, Intrinsic, Model, Temperature};
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::prepared::{MAX_BYTES, PreparedError};
use hzn_core::real::Real;
use hzn_core::tone::Tone;
use hzn_core::{Config, FlightHorizon, FlightWorkspace, Preset, Sensor, SensorPlace, body, covariance, threshold};
use proptest::prelude::*;

/// Bytes before the configuration.
const HEADER: usize = 20;

fn prepare<T: Real>(config: &Config) -> Vec<u8> {
    let mut bytes = vec![0xA5; MAX_BYTES];
    let length = Sensor::<T>::new(config).unwrap().prepare(&mut bytes).unwrap();
    bytes.truncate(length);
    bytes
}

/// Every lens, and every part that a file may leave out.
fn configs() -> Vec<Config> {
    let plain = |model| camera::Config::ideal(model, 96, 64, 60.0);
    let with_k = |model, k: &[f64]| camera::Config { k: k.iter().copied().collect(), ..plain(model) };
    let mut lenses = vec![
        plain(Model::Pinhole),
        plain(Model::Equidistant),
        with_k(Model::KannalaBrandt, &[-0.055, 0.011, -0.0035, 0.0002]),
        with_k(Model::BrownConrady, &[-0.1, 0.01, 0.001, -0.001]),
        // Its radius nearly stops growing at the image circle, so that Newton's method finds the rays.
        camera::Config {
            fx_px: 20.0,
            fy_px: 20.0,
            theta_max_deg: Some(114.0),
            ..with_k(Model::KannalaBrandt, &[-0.08])
        },
    ];
    if cfg!(feature = "kalibr") {
        lenses.extend([with_k(Model::DoubleSphere, &[-0.2, 0.6]), with_k(Model::Eucm, &[0.6, 1.1])]);
    }
    let mut configs: Vec<_> = lenses.into_iter().map(Config::new).collect();
    let presets = Preset::ALL.iter().map(|preset| Config::preset(*preset, plain(Model::Pinhole)));
    configs.extend(presets.filter(|config| Sensor::<f64>::new(config).is_ok()));
    let mut full = configs[2].clone();
    full.camera.theta_max_deg = Some(40.0);
    full.camera.readout_s = 0.02;
    full.camera.temperature = Some(Temperature { reference_c: 20.0, focal_ppm_per_k: 10.0, ..Temperature::default() });
    let order: heapless::Vec<_, 9> = [Intrinsic::FxPx, Intrinsic::CyPx, Intrinsic::K4].into_iter().collect();
    let row = |i: usize| (0..3).map(|j| if i == j { 0.01 } else { 0.0 }).collect();
    full.camera.covariance = Some(Covariance { order, rows: (0..3).map(row).collect() });
    full.mount = Some(hzn_core::config::Mount { q_vehicle_from_camera_wxyz: [0.5, 0.5, 0.5, 0.5] });
    let corners = (0..16).map(|i| f64::from(i) * core::f64::consts::TAU / 16.0);
    let corners: Vec<[f64; 2]> = corners.map(|turn| [48.0 + 5.0 * turn.cos(), 30.0 + 5.0 * turn.sin()]).collect();
    for _ in 0..8 {
        full.mask.polygons_px.push(corners.iter().copied().collect()).unwrap();
    }
    full.input.tone = Some(Tone::Gamma(2.2));
    while !full.bodies.is_full() {
        let kind = if full.bodies.is_empty() { body::Kind::Earth } else { body::Kind::Moon };
        let own = body::Config { kind, altitude_km: Some(300.0), ..body::Config::default() };
        let own = body::Config { threshold: Some(threshold::Config::default()), ..own };
        full.bodies.push(body::Config { covariance: Some(covariance::Config::default()), ..own }).unwrap();
    }
    configs.push(full);
    configs
}

#[test]
fn every_sensor_comes_back() {
    let mut longest = 0;
    let made = |config: &Config| format!("{:?}", Sensor::<f64>::new(config));
    assert!(configs().iter().any(|config| made(config).contains("Newton")), "no lens without series is tested");
    for config in configs() {
        let (single, double) = (prepare::<f32>(&config), prepare::<f64>(&config));
        assert_eq!(Sensor::from_prepared(&single), Ok(Sensor::<f32>::new(&config).unwrap()));
        assert_eq!(Sensor::from_prepared(&double), Ok(Sensor::<f64>::new(&config).unwrap()));
        longest = longest.max(double.len());
        // What lies behind it in a page of flash does not matter.
        let page = [&single[..], &[0xFF; 77]].concat();
        assert!(Sensor::<f32>::from_prepared(&page).is_ok());
    }
    assert!((MAX_BYTES / 2..MAX_BYTES).contains(&longest), "{longest}");
}

#[test]
fn a_running_sensor_stays_when_bytes_are_refused() {
    let configs = configs();
    let mut place = SensorPlace::<f32>::empty();
    assert_eq!(place.load(&[]), Err(PreparedError::NoSensor));
    assert!(place.sensor().is_none());
    place.load(&prepare::<f32>(&configs[0])).unwrap();
    let mut wrong = prepare::<f32>(&configs[2]);
    wrong[500] ^= 1;
    assert_eq!(place.load(&wrong), Err(PreparedError::Checksum));
    assert_eq!(place.sensor().unwrap().config(), &configs[0]);

    let mut horizon = Box::new(FlightHorizon::empty());
    horizon.load(&prepare::<f32>(&configs[2])).unwrap();
    assert_eq!(horizon.sensor().unwrap(), &Sensor::new(&configs[2]).unwrap());
}

#[test]
fn each_reason_has_its_own_error() {
    let right = prepare::<f32>(&configs()[2]);
    let load = |bytes: &[u8]| Sensor::<f32>::from_prepared(bytes).unwrap_err();
    let with = |place: usize, bytes: &[u8]| {
        let mut changed = right.clone();
        changed[place..place + bytes.len()].copy_from_slice(bytes);
        changed
    };
    assert_eq!(load(b"[camera]\nwidth = 96\n"), PreparedError::NoSensor);
    assert_eq!(Sensor::<f64>::from_prepared(&right), Err(PreparedError::Precision));
    let words: Vec<u8> = right.chunks(4).flat_map(|word| word.iter().rev().copied()).collect();
    assert_eq!(load(&words), PreparedError::Order);
    assert_eq!(load(&sealed(with(6, &[2]))), PreparedError::Version);
    assert_eq!(load(&sealed(with(8, &[0; 4]))), PreparedError::Version);
    // A picture of no width; a body that is longer, or shorter, than its values.
    assert_eq!(load(&sealed(with(HEADER, &[0, 0]))), PreparedError::Value);
    for length in [right.len() - 21, right.len() - HEADER + 1] {
        let longer = [&right[..], &[0]].concat();
        let length = (length as u32).to_le_bytes();
        let bytes: Vec<u8> = [&longer[..12], &length, &longer[16..]].concat();
        assert_eq!(load(&sealed(bytes)), PreparedError::Value);
    }
    let mut short = [0; 100];
    let needed = right.len();
    let sensor = Sensor::<f32>::new(&configs()[2]).unwrap();
    assert_eq!(sensor.prepare(&mut short), Err(PreparedError::TooLong { needed }));
    assert_eq!(sensor.prepare(&mut short[..7]), Err(PreparedError::TooLong { needed }));
}

#[test]
fn every_flipped_bit_and_every_missing_byte_is_noticed() {
    let right = prepare::<f32>(&configs()[2]);
    for bit in 0..right.len() * 8 {
        let mut changed = right.clone();
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(Sensor::<f32>::from_prepared(&changed).is_err(), "bit {bit}");
    }
    for length in 0..right.len() {
        assert_eq!(Sensor::<f32>::from_prepared(&right[..length]), Err(PreparedError::NoSensor), "{length} bytes");
    }
}

/// Gives changed bytes a right checksum.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(&bytes[..16]);
    digest.update(&bytes[HEADER..][..length.min(bytes.len() - HEADER)]);
    let sum = digest.finalize();
    bytes[16..20].copy_from_slice(&sum.to_le_bytes());
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    /// A few bytes of a right body are anything, and the checksum is right. Either the bytes are refused, or the sensor
    /// processes pictures without a panic, and its answers are numbers.
    #[test]
    fn bytes_with_a_right_checksum_never_panic(
        which in any::<prop::sample::Index>(), kind in 0..KINDS, seed in any::<u64>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let configs = configs();
        let mut bytes = prepare::<f32>(which.get(&configs));
        for (place, byte) in changes {
            let place = HEADER + place.index(bytes.len() - HEADER);
            bytes[place] = byte;
        }
        let Ok(sensor) = Sensor::<f32>::from_prepared(&sealed(bytes)) else { return Ok(()) };
        let (width, height) = (sensor.camera().width(), sensor.camera().height());
        let mut data = garbage(kind, seed, 128);
        data.resize(usize::from(width) * usize::from(height), 90);
        let layout = Layout::packed(width.into(), height.into(), 1, 8);
        let picture = Grey::try_new(&data, layout).unwrap();
        let mut workspace = Box::new(FlightWorkspace::new());
        if let Ok(expected) = sensor.expect(&Prior { altitude_m: Some(3e5), ..Prior::default() }) {
            let report = sensor.process(&mut workspace, &picture, &expected, &Unobserved);
            if let Some(answer) = report.solution {
                prop_assert!(answer.axis.xyz().iter().all(|x| x.is_finite()));
            }
        }
    }

    /// The whole body is noise.
    #[test]
    fn noise_with_a_right_checksum_is_refused(body in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut bytes = prepare::<f32>(&configs()[0])[..HEADER].to_vec();
        bytes[12..16].copy_from_slice(&(body.len() as u32).to_le_bytes());
        bytes.extend(body);
        prop_assert_eq!(Sensor::<f32>::from_prepared(&sealed(bytes)), Err(PreparedError::Value));
    }
}
