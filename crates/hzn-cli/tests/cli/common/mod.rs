//! A folder with a few small pictures of a limb, and the command that runs on it.
#![allow(dead_code, reason = "each test file takes what it needs")]
#![allow(unreachable_pub, reason = "shared between test files")]

pub mod ros;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{ImageFormat, Luma};

pub struct Place {
    dir: tempfile::TempDir,
}

/// The result of a run of the command.
pub struct Ran {
    pub code: i32,
    pub out: String,
    pub err: String,
}

pub const SENSOR: &str = "preset = \"hzn\"\n\n[camera]\nwidth = 320\nheight = 240\nmodel = \"pinhole\"\nfx_px = 300.0\n\
                          fy_px = 300.0\ncx_px = 159.5\ncy_px = 119.5\n\n[body]\nkind = \"earth-sphere\"\naltitude_km \
                          = 400.0\n";

/// The lines after [`SENSOR`] that make edge and limb height independent of what a file says of its tone. More keys of
/// the section `input` may follow.
pub const NO_TONE: &str = "limb = \"height\"\n[input]\ntone = \"unknown\"\n";

/// Returns a picture of a smooth bright body below its limb; `shift` moves it by 0.05 degrees per unit.
pub fn limb(width: u32, height: u32, shift: f64) -> image::GrayImage {
    image::GrayImage::from_fn(width, height, |x, y| {
        // The body has a half-angle of 70 degrees, and its centre is 68 degrees below the optical axis.
        let (f, s) = (300.0f64, (68.0 + 0.05 * shift).to_radians());
        let (u, v) = ((f64::from(x) - 159.5) / f, (f64::from(y) - 119.5) / f);
        let cos = (v * s.sin() + s.cos()) / (1.0 + u * u + v * v).sqrt();
        let px = (70.38f64.to_radians() - cos.clamp(-1.0, 1.0).acos()) * f;
        Luma([(20.0 + 180.0 * (0.5 + px / 2.0).clamp(0.0, 1.0)) as u8])
    })
}

/// Checks the last line of a page: the version, the time in UTC, the sensor if there is one, and the command.
pub fn assert_provenance(page: &str, has_sensor: bool, command: &str) {
    let version = format!("hzn {}, ", env!("CARGO_PKG_VERSION"));
    let (_, line) = page.rsplit_once(&version).unwrap_or_else(|| panic!("no version: {page}"));
    let (date, rest) = line.split_once(", ").unwrap();
    // 2026-11-28T19:00:55Z, perhaps with parts of a second.
    let form: String = date.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
    assert!(form.starts_with("0000-00-00T00:00:00") && form.ends_with('Z'), "{date}");
    let hash = rest.strip_prefix("sensor ").map(|rest| rest.chars().take_while(|c| c.is_ascii_hexdigit()).count());
    assert_eq!(hash, has_sensor.then_some(12), "{rest}");
    assert!(rest.contains(&format!("<code>{command}")), "{rest}");
}

/// Waits until no process has the lock of a file. A process that another test is just starting has it, too, until its
/// program begins.
pub fn wait_until_free(part: &std::path::Path) {
    let end = std::time::Instant::now() + std::time::Duration::from_secs(20);
    while hzn_mcap::create_part(part).is_err() {
        assert!(std::time::Instant::now() < end, "{} stays locked", part.display());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

/// Returns the checksum of PNG.
pub fn crc32(data: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    };
    !data.iter().fold(!0u32, step)
}

impl Place {
    /// Makes a folder with a sensor.toml and no pictures.
    pub fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("in")).unwrap();
        let place = Self { dir };
        place.write("in/sensor.toml", SENSOR.as_bytes());
        place
    }
    /// Makes a folder with a sensor.toml whose limb has the same height in pictures of any tone: the drawn limb is an
    /// edge without air, so that its place does not depend on the format of a picture.
    pub fn without_tone() -> Self {
        let place = Self::new();
        place.write("in/sensor.toml", format!("{SENSOR}{NO_TONE}").as_bytes());
        place
    }
    /// Makes a folder with pictures 0000.png to (n-1).png.
    pub fn with_pictures(n: usize) -> Self {
        let place = Self::new();
        for i in 0..n {
            let path = place.path(&format!("in/{i:04}.png"));
            if i < 40 {
                limb(320, 240, i as f64).save_with_format(path, ImageFormat::Png).unwrap();
            } else {
                std::fs::hard_link(place.path(&format!("in/{:04}.png", i % 40)), path).unwrap();
            }
        }
        place
    }
    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    pub fn write(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path(name), bytes).unwrap();
    }
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }
    /// Returns the command, which runs in the folder.
    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("hzn"));
        command.current_dir(self.dir.path()).args(args);
        command
    }
    pub fn run(&self, args: &[&str]) -> Ran {
        Ran::from_output(&self.command(args).output().unwrap(), self.dir.path())
    }
    /// Returns the rows of a CSV file, as columns by name.
    pub fn rows(&self, name: &str) -> Vec<Vec<(String, String)>> {
        let text = self.read(name);
        rows(&text)
    }
}

/// Returns the names of the commands that a help lists.
pub fn commands(place: &Place, args: &[&str]) -> Vec<String> {
    let help = place.run(args).expect(0).out;
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap().to_owned();
    let names = list.lines().filter(|line| !line.starts_with("   ")).map(|line| line.trim().split(' ').next());
    names.map(|name| name.unwrap().to_owned()).collect()
}

/// Runs the command under limits of bash, such as `ulimit -v`.
#[cfg(unix)]
pub fn limited(place: &Place, limits: &str, args: &[&str]) -> Ran {
    let hzn = place.command(&[]);
    let mut shell = Command::new("bash");
    shell.args(["-c", &format!("{limits}; exec \"$0\" \"$@\"")]).arg(hzn.get_program()).args(args);
    Ran::from_output(&shell.current_dir(place.path("")).output().unwrap(), &place.path(""))
}

/// Returns the rows of a CSV text.
pub fn rows(text: &str) -> Vec<Vec<(String, String)>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().unwrap().clone();
    let named = |r: csv::StringRecord| header.iter().map(str::to_owned).zip(r.iter().map(str::to_owned)).collect();
    reader.records().map(|r| named(r.unwrap())).collect()
}

/// Returns a cell of a row.
pub fn cell<'a>(row: &'a [(String, String)], name: &str) -> &'a str {
    &row.iter().find(|(n, _)| n == name).unwrap().1
}

/// Returns the rows of a table without the processing time.
pub fn without_time(text: &str) -> Vec<Vec<(String, String)>> {
    let mut rows = rows(text);
    rows.iter_mut().for_each(|r| r.retain(|(n, _)| n != "elapsed_us"));
    rows
}

impl Ran {
    pub fn from_output(output: &Output, folder: &Path) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace(&format!("{}/", folder.display()), "");
        Self { code: output.status.code().unwrap_or(-1), out: text(&output.stdout), err: text(&output.stderr) }
    }
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout: {}\nstderr: {}", self.out, self.err);
        self
    }
    #[track_caller]
    pub fn says(self, text: &str) -> Self {
        assert!(self.err.contains(text), "expected {text:?} in: {}", self.err);
        self
    }
}

/// Returns the axis of each row; every picture must be answered.
#[track_caller]
pub fn axes(place: &Place, args: &[&str]) -> Vec<[f64; 3]> {
    let rows = without_time(&place.run(args).expect(0).out);
    let number = |r: &[(String, String)], name: &str| cell(r, name).parse::<f64>().unwrap();
    rows.iter()
        .map(|r| {
            assert_eq!(cell(r, "status"), "ok", "{r:?}");
            ["axis_x", "axis_y", "axis_z"].map(|name| number(r, name))
        })
        .collect()
}

/// Returns the angle between two directions, in degrees.
pub fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross =
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]].map(|v| v * v).iter().sum();
    f64::sqrt(cross).asin().to_degrees()
}
