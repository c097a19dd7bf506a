//! Passes the build information for `hzn --version` to the compiler: commit, target and profile.

use std::path::Path;
use std::process::Command;

fn main() {
    let git = |args: &[&str]| {
        let out = Command::new("git").args(args).output().ok().filter(|out| out.status.success())?;
        Some(String::from_utf8_lossy(&out.stdout).trim().to_owned())
    };
    // A package or an archive of the source has no repository; its maker can give the commit.
    let given = std::env::var("HZN_COMMIT").ok();
    let commit = given.or_else(|| git(&["rev-parse", "--short=12", "HEAD"])).unwrap_or_else(|| "unknown".to_owned());
    println!("cargo:rustc-env=HZN_BUILD_COMMIT={commit}");
    for name in ["TARGET", "PROFILE"] {
        println!("cargo:rustc-env=HZN_BUILD_{name}={}", std::env::var(name).unwrap_or_default());
    }
    println!("cargo:rerun-if-env-changed=HZN_COMMIT");
    println!("cargo:rerun-if-changed=build.rs");
    // The log of HEAD grows with each commit.
    let paths = ["HEAD", "logs/HEAD"].map(|file| git(&["rev-parse", "--git-path", file]));
    for path in paths.iter().flatten().filter(|path| Path::new(path).exists()) {
        println!("cargo:rerun-if-changed={path}");
    }
}
