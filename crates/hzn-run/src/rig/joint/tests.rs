use std::path::Path;
use std::time::Duration;

use hzn_core::camera::Model;
use hzn_core::report::Free;
use hzn_core::status::Stage;
use hzn_core::{Report, Solution};

use super::*;
use crate::engine::BodyOutcome;

const RIG: &str = "
    [[head]]
    name = \"left\"
    pictures = \"left\"
    mount.q_rig_from_camera_wxyz = [1, 0, 0, 0]
    [[head]]
    name = \"right\"
    pictures = \"right\"
    mount.q_rig_from_camera_wxyz = [0, 0, 0, 1]
    [[head]]
    name = \"back\"
    pictures = \"back\"
    mount.q_rig_from_camera_wxyz = [0, 0, 1, 0]
";

fn sensor() -> Config {
    Config::new(hzn_core::camera::Config::ideal(Model::Pinhole, 640, 480, 500.0))
}

fn joiner() -> Joiner {
    let sensors = [sensor(), sensor(), sensor()];
    Joiner::new(&rig::parse(RIG, Path::new("rig.toml")).unwrap(), &sensors).unwrap()
}

/// An answer along the optical axis, with or without a free cone.
fn solution(has_cone: bool) -> Solution<f64> {
    let axis = UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap();
    let covariance = Cov3::from_upper([1e-6, 0.0, 0.0, 1e-6, 0.0, 0.0]);
    let free = Free {
        axis,
        covariance,
        cos: 0.4,
        var_cos: 1e-6,
        axis_with_cos: Some([0.0; 3]),
        cos_per_px: 1e-3,
        common: None,
    };
    Solution {
        axis,
        covariance,
        common: None,
        axis_fixed: None,
        axis_vehicle: None,
        half_angle_rad: 1.1,
        fused_half_angle_rad: 1.1,
        altitude_m: None,
        free: has_cone.then_some(free),
        axis_by_cos: None,
        position: None,
        p_limb: None,
        is_airglow: false,
        rms_px: 0.1,
        inliers: 100,
        arc_px: 300.0,
        candidate: 0,
    }
}

/// A picture with this answer.
fn finished(time_s: f64, has_cone: bool) -> Finished {
    let report = Report {
        status: Status::Ok,
        stage: Stage::Threshold,
        level: 0,
        next_level: None,
        counters: Default::default(),
        candidates: Default::default(),
        solution: Some(solution(has_cone)),
        is_suspect: false,
    };
    Finished {
        index: 0,
        name: String::new(),
        time_s: Some(time_s),
        stamp: None,
        data: None,
        outcomes: vec![BodyOutcome { report: Ok(report), elapsed: Duration::ZERO }],
        is_flight: false,
        drawing: Default::default(),
        picture: None,
        glimpse: None,
        traces: None,
        tip: None,
        pages: 1,
        mask: None,
        identity: None,
        bytes: None,
        brightness_by_sun: None,
    }
}

#[test]
fn a_head_without_a_free_cone_is_named() {
    let frames = [finished(0.0, true), finished(0.0, false), finished(0.0, false)];
    let row = joiner().join(0, &frames.each_ref().map(|frame| Seen::new(Some(frame), None)));
    assert!(row.detail.contains("right: no free cone, back: no free cone"), "{}", row.detail);
}

#[test]
fn pictures_of_other_times_are_no_epoch() {
    let check = |times: [f64; 2]| {
        let frames = times.map(|time_s| finished(time_s, true));
        let seen = frames.each_ref().map(|frame| Seen::new(Some(frame), None));
        joiner().check_times(&[seen[0], Seen::new(None, None), seen[1]]).map_err(|e| e.to_string())
    };
    assert_eq!(check([1.0, 1.05]), Ok(()));
    let why = check([4.0, 1.0]).unwrap_err();
    assert!(why.starts_with("the picture of left was taken 3.000 s after that of back"), "{why}");
}

#[test]
fn heads_that_look_for_different_bodies_are_refused() {
    let mut other = sensor();
    other.body.kind = body::Kind::Moon;
    let sensors = [sensor(), sensor(), other];
    let why = Joiner::new(&rig::parse(RIG, Path::new("rig.toml")).unwrap(), &sensors).err().unwrap().to_string();
    assert!(why.starts_with("left looks for earth and back for moon: the heads of a rig must look"), "{why}");
}
