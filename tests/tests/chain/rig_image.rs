//! The rig of four heads in the firmware: the joint answer of this machine, and what a head costs.

use hzn_core::camera::{Config as Camera, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::rig::{Answered, Common, Config as Check, Limb, Mount, Rig};
use hzn_core::{FlightHorizon, Prior, Sensor};
use hzn_flight::bytes::Reader;
use hzn_flight::joint::{Outcome, RigAnswer};
use hzn_flight::packet::{self, Apid, ApidBase, Scan};
use hzn_flight::{Parameters, answer::PictureAnswer};
use hzn_host::Compiled;
use hzn_sim::pose::position_m;
use hzn_sim::{Detector, Look, Pose, Profile, Samples, Scene};
use hzn_tests::emulated::{Board, measure_rig};

/// Most bytes of memory of a further head. A head takes 25 304: two copies of the sensor, 8048 each, two of what is
/// known from navigation and of the tracker of the limb, 520 each, 7260 of buffers, and 908 of the rest of the loop.
/// Under the first limit, 24 KiB, the sensor had 7920 bytes, and the values of 424 bytes were without the tracker.
const MOST_FURTHER_BYTES: u32 = 25 * 1024;

/// Returns the most that four heads with their joint answer may cost, in pictures of one head.
///
/// Four pictures and a share of a half for the joint answer. A Cortex-M4F has no double precision, and the sines and
/// cosines of libm compute in it for every precision. A joint answer of four heads calls them 440 times, to find the
/// arcs of the limb in view and the weather along them, which is 0.7 of a picture. The measured ratio is 4.89, and
/// 4.13 on a Cortex-M7, so that the Cortex-M4F gets one half more. It was 7.63 while the search for arcs took sine and
/// cosine of each azimuth.
fn most_ratio(board: Board) -> f64 {
    if board == Board::An386 { 5.0 } else { 4.5 }
}

/// Returns the parameters and the picture of head `k`, 68 degrees off nadir at 500 km. The axes of the vehicle are
/// those of the body.
fn head(k: u16) -> (Parameters, Vec<u8>) {
    let look = Look::off_nadir(68f64.to_radians(), f64::from(k) * std::f64::consts::FRAC_PI_2 + 0.3, 0.1);
    let pose = Pose::looking(position_m(20.0, 30.0, 500.0), look);
    let mut scene = Scene::new(Camera::ideal(Model::Pinhole, 640, 480, 554.0), pose);
    scene.body.limb_height_km = 25.0;
    scene.profile = Profile::Exponential { scale_km: 7.0 };
    scene.detector = Detector { psf_sigma_px: 0.9, read_noise: 0.01, bits: 8, ..Detector::default() };
    scene.seed = k.into();
    let picture = scene.render().expect("the scene can be rendered");
    let Samples::Bytes(bytes) = picture.samples() else { panic!("the picture must have 8 bits") };
    let mut parameters = Parameters::defaults();
    parameters.sensor.camera = scene.camera.clone();
    parameters.sensor.body = scene.body.clone();
    // Told wrong by the same height for all heads, as it is in flight.
    (parameters.sensor.body.limb_height_km, parameters.sensor.body.limb_height_sigma_km) = (15.0, 10.0);
    parameters.sensor.body.altitude_km = Some(500.0);
    parameters.operations.apid_base = 0x110 + 0x10 * k;
    let first = Parameters::number_of("mount.q_vehicle_from_camera_wxyz").expect("it is a parameter");
    for (id, x) in (first..).zip(scene.pose.q_fixed_from_camera_wxyz) {
        parameters.set(id, x).expect("a number");
    }
    (parameters, bytes.clone())
}

/// Returns the joint answer and the axes of the heads among packets.
fn read(mut sent: &[u8]) -> (RigAnswer, Vec<[f32; 3]>) {
    let (mut joint, mut axes) = (None, Vec::new());
    while let Scan::Packet { end, packet } = packet::scan(sent) {
        let from = &mut Reader::new(packet.user);
        match ApidBase::try_new(packet.apid & !0xF).and_then(|base| base.subject(&packet)) {
            Some(Apid::Rig) => joint = RigAnswer::read(from),
            Some(Apid::Science) => {
                hzn_flight::messages::Exposure::read(from).expect("a whole packet");
                axes.extend(PictureAnswer::read_science(from).and_then(|answer| Some(answer.direction?.axis)));
            }
            _ => {}
        }
        sent = &sent[end..];
    }
    (joint.expect("a joint answer"), axes)
}

#[test]
#[ignore = "needs the images: cargo xtask firmware"]
fn four_heads_have_the_bits_and_the_cost_of_four_heads() {
    let heads = [0, 1, 2, 3].map(head);
    let sensors = heads.each_ref().map(|(p, _)| Sensor::<f32>::new(&p.sensor).expect("valid"));
    let solutions = heads.each_ref().map(|(p, bytes)| {
        let mut horizon = FlightHorizon::boxed(&p.sensor).expect("valid");
        let expected = horizon.expect(&Prior::default()).expect("the altitude is a parameter");
        let picture = Grey::try_new(bytes, Layout::packed(640, 480, 1, 8)).expect("the picture is whole");
        horizon.find(&picture, &expected).solution.expect("an answer")
    });
    let mounts = heads.each_ref().map(|(p, _)| {
        let q = p.sensor.mount.expect("a mount").q_vehicle_from_camera_wxyz.map(|x| x as f32);
        Mount::new([1.0, 0.0, 0.0, 0.0], q, &[0.0; 6]).expect("a rotation")
    });
    let answered: Vec<_> = (0..4)
        .map(|k| {
            // The clock of the image counts its calls, and nothing turns.
            let (solution, camera, mount) = (&solutions[k], sensors[k].camera(), &mounts[k]);
            Some(Answered { solution, camera, mount, time_s: None, rate_rad_s: None, limb_group: 0 })
        })
        .collect();
    let limb = Limb {
        radius_km: (sensors[0].config().body.mean_radius_km() + 15.0) as f32,
        tilt_sigma_km: None,
        own_sigma_km: 1.5,
        own_length_km: 1000.0,
    };
    let rig = Rig::<f32>::new(&Check::default()).expect("the default");
    let epoch = rig.join_epoch(&Common { limb, sigma_rad: 0.0 }, &answered);
    for board in Board::with_pictures() {
        let there = measure_rig(board, &heads);
        let (joint, axes) = read(&there.sent);
        assert_eq!([joint.outcome, joint.heads_used], [Outcome::Answer as u8, 15]);
        // The first head has a threshold from its picture before, as every flight computer has.
        assert_eq!(axes, solutions.each_ref().map(|solution| solution.axis.xyz()), "{}", board.core());
        let bits = |x: RigAnswer| x.values().map(f64::to_bits).collect::<Vec<_>>();
        assert_eq!(bits(joint), bits(joint.with(&epoch)), "{}", board.core());
        let one = there.one - there.idle;
        let ratio = (there.all - there.idle) as f64 / one as f64;
        println!(
            "{}: a turn without a picture {} instructions, with one picture {one} more, with four {ratio:.3} times as \
             many; {} bytes for the first head and {} for each further one",
            board.core(),
            there.idle,
            there.first_bytes,
            there.further_bytes
        );
        assert!(ratio <= most_ratio(board), "{ratio}");
        assert!(there.further_bytes <= MOST_FURTHER_BYTES, "{}", there.further_bytes);
    }
}
