//! Runs the project's chores.
//!
//! ```text
//! cargo xtask test       runs all checks: format, lints, tests, documents, flight build, files, demo; --all runs
//!                        them whole
//! cargo xtask bench      compares hzn-core with the OpenCV recipe, in one run
//! cargo xtask reproduce  compares our numbers with the published ones and writes book/results/reproduction.md
//! cargo xtask firmware   builds the images for the flight computer and counts their instructions
//! cargo xtask campaign   looks for faults: fuzzing, killed runs, long runs
//! cargo xtask dist       makes the files of a release: archive, Debian package, wheel, lists of parts, checksums
//! cargo xtask keys       writes the files that follow from the keys of sensor.toml: table, template, types of Python,
//!                        and the JSON schemas of sensor.toml, frames.csv and scene.toml
//! cargo xtask first-command
//!                        measures what the README's first command costs on a clean clone
//! cargo xtask pictures   makes the documents' pictures with overlays
//! cargo xtask site       builds the site and checks its links; the page in the browser is part of it
//! cargo xtask viewer     makes the picture of the viewer's window in the documents, or pictures of all situations
//! ```
#![forbid(unsafe_code)]

mod bench;
mod beside;
mod c_package;
mod campaign;
mod demo;
mod display;
mod dist;
mod firmware;
mod first_command;
mod flight_build;
mod frameworks;
mod ground;
mod machine;
mod miri;
mod mutants;
mod page;
mod parts;
mod pictures;
mod processors;
mod python;
mod reproduce;
mod site;
mod situations;
mod soft_double;
mod steps;
mod test;
mod test_build;
mod viewer;
mod wheel;

use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask COMMAND [OPTION]...; COMMAND is one of these:

  test [--all] [STEP]...
                     runs the steps of every check, or all steps whose name contains one of the words; --all runs the
                     long steps, too, and each step whole: every image, notebook, campaign and ignored test;
                     CI=true turns a step that cannot run into a failure
  bench [ARG]...     compares hzn-core with the OpenCV recipe; arguments go to hzn-benches (see --help there)
  bench run [ARG]... compares `hzn run` on PNG, JPEG and headerless pictures with decoding alone
  bench python       measures the cost of the Python package compared with the sensor; writes
                     book/results/python-measured.md
  bench ransac [--runs N]
                     compares samplers of outliers on simulated edge points
  reproduce [STUDY]...
                     measures the numbers of book/results/reproduction.md again and writes the file (see --help there)
  campaign <fuzz|kill|long|flips|mutants|coverage|parts> [ARG]...
                     looks for faults, and lists what hzn is built from (see book/results/reliability.md)
  dist [--target TRIPLE] [PART]...
                     makes the files of a release in target/release-files: the static program as an archive and as a
                     Debian package, the wheel with the program, lists of parts (CycloneDX), SHA256SUMS; then tries
                     them. The part `crates` compiles each published crate from its package, and `systems` checks
                     the command for Windows and macOS; both run only if they are named
  firmware [--write] builds the images for the flight computer and counts their instructions in QEMU;
                     --write puts the table into book/results/firmware-cost.md;
                     --build only builds the images that every check runs;
                     --by-feature prints only how much flash the methods of published systems take
  first-command      clones the committed state, runs the README's first command there, and prints its wall time and
                     processor time; what cargo downloads is downloaded before and not counted
  keys               writes the tables of book/reference/sensor-toml.md, the template and the Python types (hzn.keys)
                     from the keys in hzn-core, and the JSON schemas of sensor.toml, frames.csv and scene.toml
  page               builds the page with the sensor in the browser into target/xtask/page
  pictures           makes the documents' pictures with overlays again: those of the gallery, the photograph on the
                     first page, and the map of a lens; needs ffmpeg
  site               builds the site (the book, its notebooks, and that page) into target/xtask/site, and checks its
                     links and its search
  viewer             makes book/images/viewer.png again; needs `cargo xtask test demo` first
  viewer situations  makes pictures of the window into target/xtask/situations, in four sizes and two themes";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (command, rest) = match args.split_first() {
        Some((command, rest)) => (command.as_str(), rest),
        None => ("", [].as_slice()),
    };
    let result = match command {
        "test" => test::run(rest),
        "bench" => bench::run(rest),
        "reproduce" => reproduce::run(rest),
        "campaign" => campaign::run(rest),
        "dist" => dist::run(rest),
        "firmware" => firmware::run(rest),
        "page" => page::run(),
        "site" => build_site(),
        "first-command" => first_command::run(),
        "keys" => write_keys(),
        "pictures" => pictures::run(),
        "viewer" => viewer::run(rest),
        "help" | "-h" | "--help" => {
            println!("{USAGE}");
            Ok(())
        }
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("xtask: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Builds the whole site, checks it, and prints where it is.
fn build_site() -> Result<(), String> {
    std::env::set_current_dir(machine::root()).map_err(|e| e.to_string())?;
    let page = || wheel::build_site().and_then(|()| page::build());
    page().and_then(|page| site::add_page(&page)).map_err(steps::Trouble::into_message)?;
    println!("{0} is the site: python3 -m http.server -d {0}", site::folder().display());
    Ok(())
}

/// Writes the documents that are derived from keys of sensor.toml and scene.toml, and from columns of frames.csv.
fn write_keys() -> Result<(), String> {
    let run = |args: &[&str]| {
        let mut cargo = steps::cargo(&[&["run", "--quiet"], args, &["--", "."]].concat());
        steps::run(&mut cargo).map_err(steps::Trouble::into_message)
    };
    run(&["-p", "hzn-files", "--example", "keys"])?;
    run(&["-p", "hzn-sim", "--features", "schema", "--example", "schema"])
}
