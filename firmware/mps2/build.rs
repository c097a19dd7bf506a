//! Gives the linker the memory layout of the processor that the board stands for.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let board = if env::var_os("CARGO_FEATURE_AN500").is_some() { "an500" } else { "an386" };
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy(format!("memory-{board}.x"), out.join("memory.x")).expect("memory.x can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rerun-if-changed=memory-{board}.x");
}
