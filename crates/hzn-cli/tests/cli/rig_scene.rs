//! The scene of the tests of rigs.

use crate::common::{Place, cell, without_time};

pub(crate) type Rows = Vec<Vec<(String, String)>>;

/// Simulates four epochs of the scene `ring` with small pictures.
pub(crate) fn ring() -> Place {
    ring_of(|scene| scene)
}

/// Simulates the same epochs of a scene that is changed.
pub(crate) fn ring_of(change: impl FnOnce(String) -> String) -> Place {
    let place = Place::new();
    let scene = change(place.run(&["simulate", "ring", "--show"]).expect(0).out);
    let scene = scene.replace("width = 640\nheight = 480", "width = 320\nheight = 240").replace("554.0", "277.0");
    place.write("ring.toml", scene.replace("319.5", "159.5").replace("239.5", "119.5").as_bytes());
    place.run(&["simulate", "ring.toml", "-o", "ring", "--frames", "4", "--no-noise", "-q"]).expect(0);
    place
}

/// Runs the rig. Returns the rows of the joint answers, and those of the heads.
pub(crate) fn run(place: &Place, args: &[&str], code: i32) -> (Rows, Rows) {
    let out = place.run(&[&["run", "ring/rig.toml", "-q"], args].concat()).expect(code).out;
    without_time(&out).into_iter().partition(|row| cell(row, "head") == "rig")
}
