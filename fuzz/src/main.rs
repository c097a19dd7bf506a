//! Runs one target of tests/fuzz, or the C interface, under libFuzzer. HZN_FUZZ_TARGET names it.
#![no_main]

#[path = "../../firmware/hzn-c/tests/any_calls/mod.rs"]
mod any_calls;

use std::sync::OnceLock;

use hzn_fuzz::Target;
use libfuzzer_sys::fuzz_target;

static TARGET: OnceLock<Target> = OnceLock::new();

fn find_target() -> Target {
    let name = std::env::var("HZN_FUZZ_TARGET").expect("HZN_FUZZ_TARGET names the target");
    if name == "c_interface" {
        return any_calls::call;
    }
    let found = hzn_fuzz::TARGETS.iter().find(|(known, _)| *known == name);
    found.unwrap_or_else(|| panic!("{name} is no target")).1
}

fuzz_target!(|data: &[u8]| (TARGET.get_or_init(find_target))(data));
