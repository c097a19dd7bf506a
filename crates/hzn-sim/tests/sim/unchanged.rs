//! Pictures of the built-in scenes stay the same, to the last pixel.

use hzn_sim::{Flight, Picture, Samples, Scenario, flight};

/// Hash of a picture: FNV-1a over its samples (Fowler, Noll, Vo).
fn hash(picture: &Picture) -> u64 {
    let bytes: Vec<u8> = match picture.samples() {
        Samples::Bytes(bytes) => bytes.clone(),
        Samples::Words(words) => words.iter().flat_map(|w| w.to_le_bytes()).collect(),
    };
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// Returns one hash for a small version of the second of three pictures of each built-in scene.
fn scene_hash(name: &str) -> u64 {
    let mut scenario = Scenario::builtin(name).unwrap();
    scenario.capture.frames = 3;
    let c = &mut scenario.camera;
    let centre = |c: f64| (c + 0.5) / 4.0 - 0.5;
    (c.width, c.height, c.fx_px, c.fy_px) = (c.width / 4, c.height / 4, c.fx_px / 4.0, c.fy_px / 4.0);
    (c.cx_px, c.cy_px) = (centre(c.cx_px), centre(c.cy_px));
    let mut scenario = scenario.by_camera().remove(0);
    scenario.vehicle.clear();
    hash(&scenario.flight().unwrap().frames[1].scene.render().unwrap())
}

/// The values come from version 0.1.0. They hold on this platform only, because sines of the standard library differ in
/// the last bit.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn built_in_scenes_have_the_pixels_that_they_had() {
    let known: [(&str, u64); 9] = [
        ("rocket", 0x7a75_498c_3ae3_6aef),
        ("rocket-clean", 0x3056_507a_d9b1_a7aa),
        ("leo-infrared", 0x12b1_7f0d_967e_2cdd),
        ("horace", 0x3bd7_7dc0_bde8_6d52),
        ("horace-wide", 0xdf9e_b221_cfa6_3b47),
        ("full-disc", 0x37df_b596_5009_20e7),
        ("sun-moon", 0x7292_5347_4e5d_ac41),
        ("tumble", 0x7a58_2a8f_015f_24fb),
        ("atek", 0xbe9b_51c4_7159_730e),
    ];
    for (name, expected) in known {
        let got = scene_hash(name);
        assert_eq!(got, expected, "{name}: {got:#018x}");
    }
    let hash = |flight: Flight| hash(&flight.frames[1].scene.render().unwrap());
    assert_eq!(hash(flight::rocket(480, 270, 3, 5)), 0x371f_d476_05dc_608f);
    assert_eq!(hash(flight::leo_infrared(3, 5)), 0xed12_71af_245e_110a);
}
