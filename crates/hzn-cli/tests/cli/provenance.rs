//! The version, the command and the sensor that overlays, reports and exports name.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::Place;

/// Height of the pictures of [`Place::with_pictures`], in pixels.
const HEIGHT: u32 = 240;

/// Returns the hash that `hzn info` prints for a file.
fn hash(place: &Place, file: &str, key: &str) -> String {
    let facts: serde_json::Value = serde_json::from_str(&place.run(&["info", file, "--json"]).expect(0).out).unwrap();
    facts[key].as_str().unwrap().to_owned()
}

#[test]
fn a_recording_has_the_hash_of_its_sensor() {
    let place = Place::with_pictures(2);
    let own = hash(&place, "in/sensor.toml", "hash");
    assert!(own.len() == 12 && own.chars().all(|c| c.is_ascii_hexdigit()), "{own}");
    place.run(&["run", "in", "-o", "a.mcap", "-q"]).expect(0);
    assert_eq!(hash(&place, "a.mcap", "sensor_hash"), own);
    // A comment changes nothing, a value changes the hash.
    let text = place.read("in/sensor.toml");
    place.write("in/sensor.toml", format!("# the camera at the bow\n{text}").as_bytes());
    assert_eq!(hash(&place, "in/sensor.toml", "hash"), own);
    place.write("in/sensor.toml", format!("{text}airglow_height_sigma_km = 8.5\n").as_bytes());
    assert_ne!(hash(&place, "in/sensor.toml", "hash"), own);
}

/// The last text of the caption, two lines in a small picture, depends on the sensor. The picture and the lines above
/// it do not, as long as the answer is the same.
#[test]
fn an_overlay_names_its_sensor() {
    let place = Place::with_pictures(1);
    let text = place.read("in/sensor.toml");
    let drawn = |sensor: &str| {
        place.write("in/sensor.toml", sensor.as_bytes());
        place.run(&["explain", "in/0000.png", "--overlay", "o.png", "--force"]).expect(0);
        image::open(place.path("o.png")).unwrap().into_rgb8()
    };
    let (own, commented) = (drawn(&text), drawn(&format!("# the camera at the bow\n{text}")));
    assert_eq!(own, commented, "the same values");
    let other = drawn(&format!("{text}airglow_height_sigma_km = 8.5\n"));
    let differs: Vec<u32> =
        own.enumerate_pixels().zip(other.pixels()).filter(|((.., a), b)| a != b).map(|((_, y, _), _)| y).collect();
    let first = differs.iter().min().unwrap();
    assert!(*first > HEIGHT, "the picture and its answer are the same");
    assert!(own.height() - first < 35, "only the last text differs: {first} of {}", own.height());
}

/// The commit of a package is the one that cargo wrote into it. The repository of another project, into which the
/// package was copied, has commits of its own.
#[test]
fn the_commit_of_a_package_is_not_that_of_the_folder_around_it() {
    let place = tempfile::tempdir().unwrap();
    let program = place.path().join("build-script");
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("build.rs");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let compiled = Command::new(rustc).args(["--edition", "2024", "-o"]).arg(&program).arg(&source).status().unwrap();
    assert!(compiled.success());
    let package = place.path().join("vendor/hzn-cli");
    fs::create_dir_all(&package).unwrap();
    fs::copy(&source, package.join("build.rs")).unwrap();
    for args in [
        &["init", "--quiet"][..],
        &["-c", "user.name=n", "-c", "user.email=e", "commit", "--quiet", "--allow-empty", "-m", "theirs"],
    ] {
        assert!(Command::new("git").args(args).current_dir(place.path()).status().unwrap().success());
    }
    let commit = || {
        let mut run = Command::new(&program);
        let out = run.current_dir(&package).env_remove("HZN_COMMIT").output().unwrap();
        let text = String::from_utf8(out.stdout).unwrap();
        text.lines().find_map(|line| line.strip_prefix("cargo:rustc-env=HZN_BUILD_COMMIT=")).unwrap().to_owned()
    };
    assert_eq!(commit(), "unknown");
    let told =
        "{\n  \"git\": {\n    \"sha1\": \"0123456789abcdef0123456789abcdef01234567\"\n  },\n  \"path_in_vcs\": \"\"\n}";
    fs::write(package.join(".cargo_vcs_info.json"), told).unwrap();
    assert_eq!(commit(), "0123456789ab");
}
