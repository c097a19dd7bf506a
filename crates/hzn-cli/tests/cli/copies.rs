//! How often the sensor is compiled into the program: each copy costs the build seconds.

use std::collections::BTreeSet;

/// The function of the pipeline that takes one edge through all stages, as it is written among the symbols.
const EDGE: &[u8] = b"10judge_edge17h";
/// The copies that are needed. In hzn-host: four kinds of pictures and pictures with an observer in double precision,
/// grey bytes and pictures with an observer in single precision. Two are those of the flight software.
const COPIES: usize = 9;

#[test]
fn the_sensor_is_compiled_no_more_often_than_it_must_be() {
    let program = std::fs::read(assert_cmd::cargo::cargo_bin!("hzn")).unwrap();
    let is_edge = |name: &&[u8]| name.len() < 1000 && name.windows(EDGE.len()).any(|part| part == EDGE);
    let names: BTreeSet<&[u8]> = program.split(|&byte| byte == 0).filter(is_edge).collect();
    assert!(!names.is_empty(), "the program is without names of functions, so the copies cannot be counted");
    let more = "a crate calls hzn_core::Horizon for another type; hzn_host::Compiled has the compiled ones";
    assert!(names.len() <= COPIES, "{} copies of the pipeline instead of {COPIES}: {more}", names.len());
}
