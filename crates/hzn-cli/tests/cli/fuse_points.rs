//! `hzn fuse --points`: what it needs, and what a solve tells of the limb height.

use crate::fuse::{MOUNTS, flight, fuse};

#[test]
fn points_need_a_solve_and_the_free_cones() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    flight(at);
    let (code, _, stderr) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--points"]].concat());
    assert!(code == 2 && stderr.contains("--solve"), "{stderr}");
    // The tables of this flight have no free cones.
    let (code, _, stderr) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--solve", "--points"]].concat());
    assert!(code == 2 && stderr.contains("left: --points needs the freely fitted cone"), "{stderr}");
    assert!(stderr.contains("hzn run") && stderr.contains("leave --points out"), "{stderr}");
    assert!(!at.join("nav.csv").exists());
    let (code, stdout, stderr) = fuse(at, &[&MOUNTS[..], &["-o", "nav.csv", "--solve"]].concat());
    // Without the derivative of the axes nobody knows what the limb height causes.
    assert!(code == 0 && !stdout.contains("unknown limb height"), "{stdout}{stderr}");
}
