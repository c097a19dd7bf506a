//! Replays the committed corpora: every input that libFuzzer found interesting, and every seed.

use std::path::Path;

use hzn_fuzz::TARGETS;

#[test]
fn every_committed_input_passes() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    for (name, target) in TARGETS {
        let folder = std::fs::read_dir(corpora.join(name)).unwrap_or_else(|e| panic!("corpus of {name}: {e}"));
        let mut replayed = 0;
        for entry in folder {
            let path = entry.unwrap().path();
            // If the target panics, the test's output ends with this line.
            println!("{}", path.display());
            target(&std::fs::read(&path).unwrap());
            replayed += 1;
        }
        assert!(replayed >= 3, "{name} has only {replayed} inputs");
        target(&[]);
    }
}

/// Flips bits and cuts the inputs, in a fixed order: a small campaign without coverage.
#[test]
fn damaged_inputs_pass() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut state = 1u64;
    let mut draw = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    for (name, target) in TARGETS {
        let mut inputs: Vec<_> =
            std::fs::read_dir(corpora.join(name)).unwrap().map(|entry| entry.unwrap().path()).collect();
        inputs.sort();
        for _ in 0..100 {
            let mut bytes = std::fs::read(&inputs[draw(inputs.len())]).unwrap();
            for _ in 0..draw(4) {
                let at = draw(bytes.len());
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << draw(8);
                }
            }
            if draw(3) == 0 {
                bytes.truncate(draw(bytes.len()));
            }
            target(&bytes);
        }
    }
}
