//! Files with names of version 0.1.0: every command refuses them with the new name, and `hzn migrate` rewrites them.

use crate::common::{Place, SENSOR};

const OLD: &str = "\n[reject]  # outliers\nthreshold_px = 2.5\n[select]\nmax_way = 2.0  # tested in flight\n";

#[test]
fn an_old_sensor_toml_is_refused_and_rewritten() {
    let place = Place::with_pictures(1);
    let old = format!("{SENSOR}{OLD}");
    place.write("in/sensor.toml", old.as_bytes());
    for command in [&["run", "in"][..], &["explain", "in/0000.png"], &["camera", "show", "in/sensor.toml"]] {
        let ran = place.run(command).expect(2);
        ran.says("[reject]: this name is now consensus; `hzn migrate in/sensor.toml` rewrites the file");
    }
    place
        .run(&["migrate", "in/sensor.toml", "--dry-run"])
        .expect(0)
        .says("[select] max_way is now a constant; its line is a comment");
    assert_eq!(place.read("in/sensor.toml"), old);
    place.run(&["migrate", "in/sensor.toml"]).expect(0).says("in/sensor.toml: 3 keys rewritten");
    let new = OLD.replace("reject", "consensus").replace("select", "gates").replace("max_way", "# max_way");
    assert_eq!(place.read("in/sensor.toml"), format!("{SENSOR}{new}"));
    place.run(&["run", "in"]).expect(0);
    place.run(&["migrate", "in/sensor.toml"]).expect(0).says("in/sensor.toml: has no old name");
}

#[test]
fn scenes_and_flights_of_the_filter_are_rewritten_too() {
    let place = Place::with_pictures(1);
    place.write("fuse.toml", b"[mount]\nbody_from_camera = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n");
    place.write("scene.toml", b"[mount]\nq_body_from_camera_wxyz = [1, 0, 0, 0]\n");
    place.run(&["simulate", "scene.toml", "-o", "out"]).expect(2).says("this name is now q_vehicle_from_camera_wxyz");
    place.run(&["migrate", "fuse.toml", "scene.toml"]).expect(0);
    assert!(place.read("fuse.toml").starts_with("[mount]\nvehicle_from_camera = [["));
    assert!(place.read("scene.toml").starts_with("[mount]\nq_vehicle_from_camera_wxyz = ["));
}

#[test]
fn one_file_that_cannot_be_rewritten_keeps_all_as_they_are() {
    let place = Place::with_pictures(1);
    place.write("a.toml", b"[reject]\nseed = 2\n");
    place.write("b.toml", b"[gates]\nmin_inliers = 30\n[select]\nmax_rms_px = 2.0\n");
    place.run(&["migrate", "a.toml", "b.toml"]).expect(2).says("b.toml:3: [select]: the file has [gates] too");
    place.run(&["migrate", "a.toml", "lost.toml"]).expect(2).says("lost.toml: cannot be read");
    assert_eq!(place.read("a.toml"), "[reject]\nseed = 2\n");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.toml", place.path("link.toml")).unwrap();
        place.run(&["migrate", "link.toml"]).expect(0);
        assert_eq!(place.read("a.toml"), "[consensus]\nseed = 2\n");
        assert!(place.path("link.toml").is_symlink());
    }
}
