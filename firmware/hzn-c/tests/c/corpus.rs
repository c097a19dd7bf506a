//! Replays the committed inputs of the fuzzing target `c_interface`, and damaged copies of them.

use std::path::Path;

use crate::any_calls;

#[test]
fn every_committed_input_and_its_damaged_copies_pass() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus/c_interface");
    let mut paths: Vec<_> = std::fs::read_dir(corpus).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 3, "only {} inputs", paths.len());
    for path in paths {
        // If a call panics, the test's output ends with this line.
        println!("{}", path.display());
        let bytes = std::fs::read(&path).unwrap();
        any_calls::call(&bytes);
        // Miri takes seconds for each call.
        let step = if cfg!(miri) { 4 * bytes.len().max(1) } else { 1 };
        for bit in (0..8 * bytes.len()).step_by(step) {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            any_calls::call(&damaged);
        }
        (0..bytes.len()).step_by(step).for_each(|end| any_calls::call(&bytes[..end]));
    }
}
