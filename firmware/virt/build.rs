//! Gives the linker the memory layout.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("virt.x", out.join("virt.x")).expect("virt.x can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tvirt.x");
    println!("cargo:rerun-if-changed=virt.x");
}
