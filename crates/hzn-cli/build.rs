//! Passes the build information for `hzn --version` to the compiler: commit, target and profile.

use std::path::Path;
use std::process::Command;

/// cargo writes it into a package.
const OF_PACKAGE: &str = ".cargo_vcs_info.json";

fn main() {
    let given = std::env::var("HZN_COMMIT").ok();
    let commit = given.or_else(commit_of_package).or_else(commit_of_repository);
    println!("cargo:rustc-env=HZN_BUILD_COMMIT={}", commit.as_deref().unwrap_or("unknown"));
    for name in ["TARGET", "PROFILE"] {
        println!("cargo:rustc-env=HZN_BUILD_{name}={}", std::env::var(name).unwrap_or_default());
    }
    println!("cargo:rerun-if-env-changed=HZN_COMMIT");
    println!("cargo:rerun-if-changed=build.rs");
}

/// Returns the commit that a package was made from.
fn commit_of_package() -> Option<String> {
    let text = std::fs::read_to_string(OF_PACKAGE).ok()?;
    let (_, rest) = text.split_once("\"sha1\"")?;
    Some(rest.split('"').nth(1)?.get(..12)?.to_owned())
}

/// Returns the commit of the repository, if these sources are part of it. The folder of a vendored crate can lie in
/// another project's repository.
fn commit_of_repository() -> Option<String> {
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    // The log of HEAD grows with each commit.
    let paths = ["HEAD", "logs/HEAD"].map(|file| git(&["rev-parse", "--git-path", file]));
    for path in paths.iter().flatten().filter(|path| Path::new(path).exists()) {
        println!("cargo:rerun-if-changed={path}");
    }
    git(&["rev-parse", "--short=12", "HEAD"])
}

fn git(args: &[&str]) -> Option<String> {
    let out = Command::new("git").args(args).output().ok().filter(|out| out.status.success())?;
    Some(String::from_utf8_lossy(&out.stdout).trim().to_owned())
}
