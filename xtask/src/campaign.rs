//! Runs the large campaigns that look for faults. `cargo xtask test` runs a small part of each, and with `--all` most
//! of them whole.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::firmware;
use crate::machine::{self, root, target};
use crate::steps::{self, Outcome, Trouble, cargo};
use crate::{miri, mutants, parts, processors, python, wheel};

/// The triple that the fuzzing program is built for. With a named target, build scripts are not instrumented.
const HOST: &str = "x86_64-unknown-linux-gnu";
/// Coverage for libFuzzer and the address sanitizer, as `cargo fuzz` sets them.
const FLAGS: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                     -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
                     -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares \
                     --cfg fuzzing -Zsanitizer=address";
/// Largest input in bytes: valid files of every kind are smaller.
const MAX_INPUT_BYTES: u32 = 8192;

const USAGE: &str = "usage: cargo xtask campaign fuzz [--seconds N] [--keep] [TARGET]...
       cargo xtask campaign kill [RUNS]
       cargo xtask campaign cuts [PICTURES]
       cargo xtask campaign flights [FLIGHTS]
       cargo xtask campaign long [PICTURES]
       cargo xtask campaign fly [PICTURES]
       cargo xtask campaign flips [TRIALS]
       cargo xtask campaign packets [COUNT]
       cargo xtask campaign pictures [FLIGHTS]
       cargo xtask campaign integrity [PICTURES [SEED [STATE]...]]
       cargo xtask campaign night [PICTURES [SEED]]
       cargo xtask campaign means [FLIGHTS [SEED]]
       cargo xtask campaign rig [ATTITUDES [FLIGHTS]]
       cargo xtask campaign check [FLIGHTS [SEED]]
       cargo xtask campaign miri
       cargo xtask campaign paths
       cargo xtask campaign processors [PICTURES]
       cargo xtask campaign parts [FOLDER] [--advisories FOLDER]
       cargo xtask campaign mutants [--sample N] [--seed S] [--again] [--page FILE]
       cargo xtask campaign coverage [--again] [--page FILE]

  fuzz  runs every target (or those that are named) under libFuzzer for N seconds (60); --keep adds the inputs with
        new coverage to fuzz/corpus
  kill  kills RUNS (1000) runs of hzn at random moments and continues them
  cuts  cuts the power after each step of runs of PICTURES (12) pictures
  flights
        fuses FLIGHTS (200) right flights, and every wrong input on a twentieth of them
  fly   gives PICTURES (36000) pictures of 1920x1080 to hzn fly, 60 a second, with a real-time priority where the
        machine allows it, and prints the time from the last byte of a picture to its packet
  long  processes PICTURES (100000) with hzn run, and ten times as many in one process
  flips flips TRIALS (20000) bits of pictures and of stored parameters, sticks as many pictures, and flips every bit
        of a sensor in memory
  packets sends COUNT (1000000) telecommands to the flight software, most of them damaged
  pictures
        renders FLIGHTS (30) flights of three kinds with a program in Python, and counts hzn's errors against sigma;
        then FLIGHTS flights of each of 16 kinds with an edge that is no limb, which continue after a stop
  integrity
        renders PICTURES (200) pictures of each state (day, low Sun, no limb, matching ghost, night), each of a flight
        of its own, from SEED (700000) on, and counts errors above protection_deg
  night renders PICTURES (300) pictures of layers of airglow of each kind, from SEED (810000) on, and as many limbs by
        day with a wrong time and edges that are no limb, and counts the answers of body.night = \"airglow\"
  means simulates FLIGHTS (20) flights of 100 pictures in ten seconds, of each of five scenes, from SEED (930000) on,
        and prints the NEES of means of 3, 10 and 100 answers, and the errors beside those of the preset dlr-2022
  rig   counts the errors of the coarse direction of a rig from ATTITUDES (1000) random attitudes, and those of the
        mounts that hzn calibrate rig finds on FLIGHTS (300) flights
  check renders FLIGHTS (100) small flights of four kinds from SEED (910000) on, and counts what hzn calibrate check
        says of the right lens, and of focal lengths that are 0.3, 1 and 3 % wrong
  miri  runs the tests of the flight software and of the C interface in Miri
  paths builds the images of the flight computer and the wheel in another folder; their bytes must be the same
  processors
        compares the answers to PICTURES (2000) on aarch64 and big-endian powerpc64, in QEMU, with those of this machine
  parts writes the CycloneDX lists of parts (SBOM) of command, wheel and firmware into FOLDER (target/sbom), and runs
        cargo-deny if it is installed; --advisories looks the parts up in a copy of the RustSec database (the folder
        that contains crates/), and lists parts that are yanked or older than the newest version
  mutants
        draws N (200) small changes of the core's stages and pipeline with the seed S (1), and counts how many its tests
        notice; continues after a stop; --again tries the others again, --page writes the figures into a page
  coverage
        counts the lines and branches of each crate that the tests run; --again takes the counts of the last run, --page
        writes the table into a page";

/// Runs one campaign.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    std::env::set_current_dir(root()).map_err(|e| e.to_string())?;
    let number_at = |place: usize, default: u64| match args.get(place).map(|text| text.parse::<u64>()) {
        None => Ok(default),
        Some(number) => number.map_err(|_| format!("{}: a number is expected\n{USAGE}", args[place])),
    };
    let number = |default: u64| number_at(1, default);
    let done = match args.first().map(String::as_str) {
        Some("fuzz") => Request::parse(&args[1..]).and_then(|request| request.run().map_err(Trouble::into_message)),
        Some("kill") => kill(number(1000)?).map_err(Trouble::into_message),
        Some("cuts") => cuts(number(12)?).map_err(Trouble::into_message),
        Some("flights") => flights(number(200)?).map_err(Trouble::into_message),
        Some("fly") => fly(number(36_000)?).map_err(Trouble::into_message),
        Some("long") => long(number(100_000)?).map_err(Trouble::into_message),
        Some("flips") => flips(number(20_000)?).map_err(Trouble::into_message),
        Some("packets") => packets(number(1_000_000)?).map_err(Trouble::into_message),
        Some("pictures") => pictures(number(30)?).map_err(Trouble::into_message),
        Some("integrity") => {
            let states = args.get(3..).unwrap_or_default();
            integrity(number(200)?, number_at(2, 700_000)?, states).map_err(Trouble::into_message)
        }
        Some("night") => night(number(300)?, number_at(2, 810_000)?).map_err(Trouble::into_message),
        Some("means") => means(number(20)?, number_at(2, 930_000)?).map_err(Trouble::into_message),
        Some("rig") => rig(number(1000)?, number_at(2, 300)?).map_err(Trouble::into_message),
        Some("check") => check(number(100)?, number_at(2, 910_000)?).map_err(Trouble::into_message),
        Some("processors") => processors::compare(number(2000)?).map_err(Trouble::into_message),
        Some("miri") => miri::campaign().map_err(Trouble::into_message),
        Some("paths") => paths().map_err(Trouble::into_message),
        Some("mutants") => mutants::run(&args[1..]).map_err(Trouble::into_message),
        Some("coverage") => mutants::coverage(&args[1..]).map_err(Trouble::into_message),
        Some("parts") => parts::run(&args[1..]).map_err(Trouble::into_message),
        _ => Err(USAGE.to_owned()),
    };
    done.map_err(|e| format!("campaign: {e}"))
}

/// Returns the call of a test that prints its figures. It is built as the gate builds it.
fn test(binary: &str, name: &str) -> Command {
    let mut command = cargo(&["test", "--test", binary]);
    command.args(["--", "--nocapture", "--include-ignored", name]);
    command
}

pub(crate) fn kill(runs: u64) -> Outcome {
    steps::run(test("cli", "campaign::killed_at_random_moments").env("HZN_KILLS", runs.to_string()))
}

fn long(pictures: u64) -> Outcome {
    steps::run(test("core", "the_answers_repeat").env("HZN_FRAMES", (10 * pictures).to_string()))?;
    steps::run(test("cli", "campaign::a_long_run").env("HZN_PICTURES", pictures.to_string()))
}

/// Flies with pictures that come in real time.
fn fly(pictures: u64) -> Outcome {
    steps::run(&mut cargo(&["build", "--release", "--bin", "hzn"]))?;
    let mut campaign = test("cli", "fly_long::");
    campaign.env("HZN_FLY_PROGRAM", target().join("release/hzn"));
    campaign.env("HZN_FLY_PICTURES", pictures.to_string());
    if machine::run_within(Command::new("chrt").args(["-f", "50", "true"]), Duration::from_secs(5)) {
        campaign.env("HZN_FLY_PRIORITY", "50");
    } else {
        println!("this machine allows no real-time priority: the times are those of the usual one");
    }
    steps::run(&mut campaign)
}

pub(crate) fn flips(trials: u64) -> Outcome {
    let trials = trials.to_string();
    steps::run(test("flight", "flips::").env("HZN_FLIPS", &trials))?;
    steps::run(&mut test("flips", "every_flipped_bit_is_seen"))
}

/// Processes pictures with artefacts, with and without a limb: `pictures` of each kind.
pub(crate) fn artefacts(pictures: u64) -> Outcome {
    steps::run(test("chain", "artefacts::").env("HZN_ARTEFACTS", pictures.to_string()))
}

/// Fuses right flights, and wrong inputs on a twentieth of them.
pub(crate) fn flights(count: u64) -> Outcome {
    steps::run(test("fuse", "verdict::").env("HZN_FLIGHTS", count.to_string()))
}

/// Counts the errors of what a rig says without a limb, and of its calibrated mounts.
fn rig(attitudes: u64, flights: u64) -> Outcome {
    let mut campaign = test("cli", "rig_campaign::");
    steps::run(campaign.env("HZN_ATTITUDES", attitudes.to_string()).env("HZN_RIG_FLIGHTS", flights.to_string()))
}

/// Counts what `hzn calibrate check` says of right and of wrong lenses.
pub(crate) fn check(flights: u64, first_seed: u64) -> Outcome {
    let mut campaign = test("cli", "check_campaign::");
    steps::run(campaign.env("HZN_CHECKS", flights.to_string()).env("HZN_SEED", first_seed.to_string()))
}

/// Cuts the power after each step of runs of so many pictures.
pub(crate) fn cuts(pictures: u64) -> Outcome {
    steps::run(test("cli", "power_cut::").env("HZN_CUTS", pictures.to_string()))
}

/// Sends telecommands with mixed damage to the flight software. A library of others writes them, in Python.
pub(crate) fn packets(count: u64) -> Outcome {
    let python = python::prepare_environment("tests", Path::new("tests/python/requirements.txt"))?;
    let file = target().join("xtask").join("damaged_packets.bin");
    fs::create_dir_all(target().join("xtask"))?;
    let mut write = Command::new(python);
    steps::run(write.arg("tests/python/damaged_packets.py").arg(&file).args([count.to_string(), "2027".into()]))?;
    // The same call as that of all tests, so that nothing is built again.
    let mut command = cargo(&["test", "--test", "flight"]);
    steps::run(command.args(["--", "--nocapture", "--ignored", "damage::"]).env("HZN_PACKETS", file))
}

/// Renders flights with a program that shares no code with hzn, and compares the answers with its truth.
fn pictures(flights: u64) -> Outcome {
    steps::run(&mut cargo(&["build", "--release", "--bin", "hzn"]))?;
    let mut campaign = limb_campaign(&target().join("release/hzn"))?;
    steps::run(campaign.args(["--list", "--flights", &flights.to_string()]))?;
    let mut decoys = decoy_campaign(&target().join("release/hzn"))?;
    steps::run(decoys.arg("--keep").arg(target().join("xtask/decoys")).args(["--flights", &flights.to_string()]))?;
    // A flight of the others has eight pictures.
    let mut discs = python_campaign("tests/python/half_lit_campaign.py", &target().join("release/hzn"))?;
    steps::run(discs.args(["--pictures", &(8 * flights).to_string()]))
}

/// Compares errors with protection levels on pictures that programs in Python render, one of each flight.
fn integrity(pictures: u64, first_seed: u64, states: &[String]) -> Outcome {
    steps::run(&mut cargo(&["build", "--release", "--bin", "hzn"]))?;
    let mut campaign = python_campaign("tests/python/integrity_campaign.py", &target().join("release/hzn"))?;
    campaign.args(["--pictures", &pictures.to_string(), "--first-seed", &first_seed.to_string()]);
    if !states.is_empty() {
        campaign.arg("--states").args(states);
    }
    steps::run(&mut campaign)
}

/// Looks for the airglow on pictures of the night that a program in Python renders, and on pictures that show none.
fn night(pictures: u64, first_seed: u64) -> Outcome {
    steps::run(&mut cargo(&["build", "--release", "--bin", "hzn"]))?;
    let mut campaign = python_campaign("tests/python/night_campaign.py", &target().join("release/hzn"))?;
    steps::run(campaign.args(["--list", "--pictures", &pictures.to_string(), "--first-seed", &first_seed.to_string()]))
}

/// Compares the errors of means of many answers with what is common to them.
fn means(flights: u64, first_seed: u64) -> Outcome {
    steps::run(&mut cargo(&["build", "--release", "--bin", "hzn"]))?;
    let mut campaign = python_campaign("tests/python/means_campaign.py", &target().join("release/hzn"))?;
    steps::run(campaign.args(["--flights", &flights.to_string(), "--first-seed", &first_seed.to_string()]))
}

/// Returns the call of the campaign on pictures of another program.
pub(crate) fn limb_campaign(hzn: &Path) -> Result<Command, Trouble> {
    python_campaign("tests/python/limb_campaign.py", hzn)
}

/// Returns the call of the campaign on edges that are no limb.
pub(crate) fn decoy_campaign(hzn: &Path) -> Result<Command, Trouble> {
    python_campaign("tests/python/decoy_campaign.py", hzn)
}

fn python_campaign(script: &str, hzn: &Path) -> Result<Command, Trouble> {
    let python = python::prepare_environment("benches", Path::new("benches/requirements.txt"))?;
    let mut campaign = Command::new(python);
    campaign.arg(script).arg("--hzn").arg(hzn);
    Ok(campaign)
}

/// Clones this repository into a folder with another name, builds the images and the wheel there, and compares them.
fn paths() -> Outcome {
    let clone = target().join("xtask/elsewhere/a folder with another name");
    if clone.exists() {
        fs::remove_dir_all(&clone)?;
    }
    steps::run(Command::new("git").args(["clone", "--quiet"]).arg(root()).arg(&clone))?;
    firmware::is_the_same_elsewhere(&clone)?;
    wheel::is_the_same_elsewhere(&clone)
}

/// A campaign of libFuzzer.
#[derive(Default)]
struct Request {
    seconds: u64,
    keep: bool,
    targets: Vec<String>,
}

/// What libFuzzer says about a target.
#[derive(Default)]
struct Figures {
    executions: u64,
    /// Edges of the program that were reached, and all edges.
    edges: [u64; 2],
}

impl Request {
    fn parse(args: &[String]) -> Result<Self, String> {
        let mut request = Self { seconds: 60, ..Self::default() };
        let mut words = args.iter();
        while let Some(word) = words.next() {
            match word.as_str() {
                "--seconds" => {
                    let number = words.next().and_then(|text| text.parse().ok());
                    request.seconds = number.ok_or(format!("--seconds: a number is expected\n{USAGE}"))?;
                }
                "--keep" => request.keep = true,
                name if name.starts_with('-') => return Err(USAGE.to_owned()),
                name => request.targets.push(name.to_owned()),
            }
        }
        Ok(request)
    }

    fn run(mut self) -> Outcome {
        let program = build()?;
        if self.targets.is_empty() {
            let folders =
                fs::read_dir("fuzz/corpus")?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
            self.targets = folders.collect::<std::io::Result<_>>()?;
            self.targets.sort();
        }
        let mut rows = Vec::new();
        for name in &self.targets {
            let figures = self.run_target(&program, name)?;
            let [reached, all] = figures.edges;
            rows.push(format!("| `{name}` | {} | {reached} of {all} |", figures.executions));
        }
        println!("\n| target | executions | edges reached |\n|---|---|---|\n{}", rows.join("\n"));
        Ok(())
    }

    fn run_target(&self, program: &Path, name: &str) -> Result<Figures, Trouble> {
        let committed = PathBuf::from("fuzz/corpus").join(name);
        let [found, finding] = ["corpus", "artifacts"].map(|kind| target().join("fuzz").join(kind).join(name));
        [&committed, &found, &finding].into_iter().try_for_each(fs::create_dir_all)?;
        let mut command = Command::new(program);
        command.env("HZN_FUZZ_TARGET", name).env("ASAN_OPTIONS", "detect_leaks=0").arg(&found).arg(&committed);
        command.arg(format!("-max_total_time={}", self.seconds)).arg(format!("-max_len={MAX_INPUT_BYTES}"));
        command.arg(format!("-artifact_prefix={}/", finding.display()));
        command.args(["-print_final_stats=1", "-timeout=20", "-rss_limit_mb=2048"]);
        steps::show(&command);
        let mut child = command.stdin(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        let errors = child.stderr.take().ok_or_else(|| Trouble::Failed("libFuzzer has no output".into()))?;
        let (mut figures, mut last) = (Figures::default(), Vec::new());
        for line in BufReader::new(errors).lines() {
            let line = line?;
            figures.read(&line);
            last.push(line);
            if last.len() > 40 {
                last.remove(0);
            }
        }
        if !child.wait()?.success() {
            println!("{}", last.join("\n"));
            return Err(Trouble::Failed(format!(
                "{name}: a finding, see above; its input is in {}",
                finding.display()
            )));
        }
        if self.keep {
            let mut merge = Command::new(program);
            merge.env("HZN_FUZZ_TARGET", name).env("ASAN_OPTIONS", "detect_leaks=0");
            merge.arg("-merge=1").arg(format!("-max_len={MAX_INPUT_BYTES}")).arg(&committed).arg(&found);
            steps::run(merge.stderr(Stdio::null()))?;
        }
        Ok(figures)
    }
}

impl Figures {
    /// Reads a line of libFuzzer.
    fn read(&mut self, line: &str) {
        let number = |text: &str| text.split_whitespace().next()?.trim_matches(['(', ')']).parse::<u64>().ok();
        let after = |word: &str| line.split_once(word).and_then(|(_, rest)| number(rest));
        self.executions = after("stat::number_of_executed_units:").unwrap_or(self.executions);
        self.edges[0] = after(" cov: ").unwrap_or(self.edges[0]);
        if line.contains("PC tables (") {
            self.edges[1] = after("PC tables (").unwrap_or(self.edges[1]);
        }
    }
}

/// Builds the fuzzing program and returns its path.
fn build() -> Result<PathBuf, Trouble> {
    let folder = target().join("fuzz");
    let mut command = cargo(&["build", "--release", "--manifest-path", "fuzz/Cargo.toml", "--target", HOST]);
    // With RUSTC_BOOTSTRAP a stable compiler takes the flag of the sanitizer.
    command.env("RUSTC_BOOTSTRAP", "1").env("RUSTFLAGS", FLAGS).env("CARGO_TARGET_DIR", &folder);
    steps::run(&mut command)?;
    Ok(folder.join(HOST).join("release/hzn-libfuzzer"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_come_from_the_lines_of_libfuzzer() {
        let mut figures = Figures::default();
        for line in [
            "INFO: Loaded 1 PC tables (152310 PCs): 152310 [0x55,0x56),",
            "#2	INITED cov: 402 ft: 403 corp: 1/1b exec/s: 0 rss: 40Mb",
            "#262144	pulse  cov: 1234 ft: 5678 corp: 99/1Kb lim: 4096 exec/s: 1000 rss: 99Mb",
            "stat::number_of_executed_units: 300000",
        ] {
            figures.read(line);
        }
        assert_eq!((figures.executions, figures.edges), (300_000, [1234, 152_310]));
    }
}
