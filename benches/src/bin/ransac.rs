//! Repeats the comparison of Wang et al. 2022 (figures 5 and 6, table 2): samplers on simulated edge points, by the
//! share of outliers. `cargo xtask bench ransac` starts this program; the tables are Markdown.
#![forbid(unsafe_code)]

use std::f64::consts::TAU;
use std::process::ExitCode;
use std::time::Instant;

use hzn_core::body::{self, Kind};
use hzn_core::camera::{self, Camera, Model};
use hzn_core::consensus::{self, Method};
use hzn_core::frames::{Cam, UnitVec3};
use hzn_core::pipeline::edges::Edges;
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, HostHorizon, Prior};

const HELP: &str = "usage: cargo xtask bench ransac [--runs N]
  --runs N     point sets per cell, at least 10 (default 200; the Hough transform gets one tenth)";

/// Number of points in a set.
const POINTS: usize = 400;
/// Error of the points on the limb in pixels (1-sigma, each axis).
const NOISE_PX: f64 = 0.3;
/// Largest error of a success, in degrees; an answer farther from the truth is a failure.
const SUCCESS_DEG: f64 = 2.0;
const OUTLIERS: [f64; 8] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];

/// Linear congruential generator. Its numbers are repeatable and good enough to scatter points.
struct Rng(u64);

impl Rng {
    fn new(seed: u64) -> Self {
        let mut rng = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        rng.uniform();
        rng
    }
    /// Returns a number from 0 to 1.
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Simulated edge points with their true axis.
struct PointSet {
    points: Vec<ImagePoint<f64>>,
    axis: UnitVec3<Cam, f64>,
}

/// Method in the comparison; `None` is the Hough transform.
struct Contender {
    name: &'static str,
    method: Option<consensus::Config>,
}

fn contenders() -> Vec<Contender> {
    // Their threshold of 1° is 1.6 px at 92 px/rad.
    let sampler = |method, max_draws| {
        Some(consensus::Config { method, max_draws, threshold_px: 1.6, ..consensus::Config::default() })
    };
    vec![
        Contender { name: "`two-point`", method: sampler(Method::TwoPoint, 800) },
        Contender { name: "`ransac-preverify`", method: sampler(Method::RansacPreverify, 20_000) },
        Contender { name: "the same, 286 draws", method: sampler(Method::RansacPreverify, 286) },
        Contender { name: "`ransac`", method: sampler(Method::Ransac, 2000) },
        Contender { name: "`mlesac`", method: sampler(Method::Mlesac, 2000) },
        Contender { name: "Hough transform", method: None },
    ]
}

/// Results of a method at one share of outliers.
#[derive(Default, Clone)]
struct Cell {
    runs: u32,
    solved: u32,
    draws: u64,
    errors_deg: Vec<f64>,
    time_us: Vec<f64>,
}

fn main() -> ExitCode {
    match parse_runs(std::env::args().skip(1)).and_then(compare) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

fn parse_runs(mut args: impl Iterator<Item = String>) -> Result<u32, String> {
    let mut runs = 200;
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--runs" => runs = args.next().and_then(|n| n.parse().ok()).ok_or("--runs needs a number")?,
            _ => return Err(HELP.into()),
        }
    }
    if runs < 10 { Err("--runs must be at least 10".into()) } else { Ok(runs) }
}

fn compare(runs: u32) -> Result<(), String> {
    let lens =
        camera::Config { theta_max_deg: Some(90.0), ..camera::Config::ideal(Model::Equidistant, 384, 288, 92.0) };
    let camera = Camera::<f64>::try_new(&lens).map_err(|e| e.to_string())?;
    let mut config = Config::new(lens);
    config.body =
        body::Config { kind: Kind::EarthSphere, altitude_km: Some(600.0), limb_height_sigma_km: 1.0, ..config.body };
    let horizon = HostHorizon::boxed(&config).map_err(|e| e.to_string())?;
    let expected = horizon.expect(&Prior::default()).map_err(|e| e.to_string())?;
    let half_angle_rad = expected.half_angle_rad();

    let contenders = contenders();
    let mut cells = vec![vec![Cell::default(); OUTLIERS.len()]; contenders.len()];
    for (column, &share) in OUTLIERS.iter().enumerate() {
        for run in 0..runs {
            let mut rng = Rng::new(u64::from(run) + 1000 * column as u64);
            let set = PointSet::draw(&mut rng, &camera, half_angle_rad, share)?;
            for (contender, row) in contenders.iter().zip(&mut cells) {
                let slow = contender.method.is_none();
                if slow && run % 10 != 0 {
                    continue;
                }
                let mut edges = Edges::new(&camera, &set.points, &set.axis);
                let seed = run + 1;
                let start = Instant::now();
                let found = match &contender.method {
                    Some(method) => {
                        let method = consensus::Config { seed, ..*method };
                        let found = edges.consensus(&expected, &method);
                        // Without an answer, all draws were made.
                        (found.map(|a| a.axis), found.map_or(method.max_draws, |a| a.draws))
                    }
                    None => (find_axis_by_hough(&camera, &set.points), 0),
                };
                row[column].add(start.elapsed().as_secs_f64() * 1e6, found, &set.axis);
            }
        }
        eprintln!("{:.0} % outliers measured", share * 100.0);
    }
    print_tables(&contenders, &cells, runs);
    Ok(())
}

impl PointSet {
    /// Draws a set with the camera up to 60° off nadir. The outliers lie anywhere in the image circle.
    fn draw(rng: &mut Rng, camera: &Camera<f64>, half_angle_rad: f64, outliers: f64) -> Result<Self, String> {
        let (off, around) = (60f64.to_radians() * rng.uniform(), TAU * rng.uniform());
        let axis = UnitVec3::try_new([off.sin() * around.cos(), off.sin() * around.sin(), off.cos()])
            .ok_or("the axis has no length")?;
        let e = axis.xyz();
        let (b1, b2) = perpendicular_basis(e);
        let (sin, cos) = half_angle_rad.sin_cos();
        let inside = |p: &ImagePoint<f64>| {
            (0.0..=383.0).contains(&p.u) && (0.0..=287.0).contains(&p.v) && camera.unproject(*p).is_some()
        };
        let mut points = Vec::new();
        while points.len() < POINTS {
            let p = if rng.uniform() < outliers {
                ImagePoint { u: 383.0 * rng.uniform(), v: 287.0 * rng.uniform() }
            } else {
                let (s, c) = (TAU * rng.uniform()).sin_cos();
                let ray = [0, 1, 2].map(|k| cos * e[k] + sin * (c * b1[k] + s * b2[k]));
                let Some(p) = UnitVec3::try_new(ray).and_then(|ray| camera.project(&ray)) else { continue };
                ImagePoint { u: p.u + NOISE_PX * rng.gaussian(), v: p.v + NOISE_PX * rng.gaussian() }
            };
            if inside(&p) {
                points.push(p);
            }
        }
        Ok(Self { points, axis })
    }
}

impl Cell {
    fn add(&mut self, time_us: f64, (found, draws): (Option<UnitVec3<Cam, f64>>, u32), truth: &UnitVec3<Cam, f64>) {
        self.runs += 1;
        self.draws += u64::from(draws);
        self.time_us.push(time_us);
        if let Some(axis) = found {
            let error = axis.angle_rad(truth).to_degrees();
            if error < SUCCESS_DEG {
                self.solved += 1;
                self.errors_deg.push(error);
            }
        }
    }

    fn success(&self) -> f64 {
        100.0 * f64::from(self.solved) / f64::from(self.runs)
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

fn print_tables(contenders: &[Contender], cells: &[Vec<Cell>], runs: u32) {
    println!(
        "{runs} sets of {POINTS} points per cell ({} for the Hough transform), errors of {NOISE_PX} px on the limb, up \
         to 60° off nadir.",
        runs.div_ceil(10)
    );
    let head: String = OUTLIERS.iter().map(|r| format!(" {:.0} % |", r * 100.0)).collect();
    let rule = "---:|".repeat(OUTLIERS.len());
    let table = |title: &str, cell: &dyn Fn(&Cell) -> String| {
        println!("\n| {title} |{head}\n|---|{rule}");
        for (contender, row) in contenders.iter().zip(cells) {
            let row: String = row.iter().map(|c| format!(" {} |", cell(c))).collect();
            println!("| {} |{row}", contender.name);
        }
    };
    table("solved to 2°, %", &|c| format!("{:.0}", c.success()));
    table("median error of solved sets, degrees", &|c| format!("{:.3}", median(&c.errors_deg)));
    table("draws, mean", &|c| match c.draws {
        0 => "–".into(),
        draws => format!("{:.0}", draws as f64 / f64::from(c.runs)),
    });
    table("time, median, µs", &|c| format!("{:.0}", median(&c.time_us)));
    println!("\n| time over that of `ransac-preverify` |{head}\n|---|{rule}");
    let reference: Vec<f64> = cells[1].iter().map(|c| median(&c.time_us)).collect();
    for (contender, row) in contenders.iter().zip(cells) {
        let row: String =
            row.iter().zip(&reference).map(|(c, r)| format!(" {:.2} |", median(&c.time_us) / r)).collect();
        println!("| {} |{row}", contender.name);
    }
}

/// Returns the axis of the cone with the most votes. First, axes lie on a grid of 2° and half-angles in bins of 1°;
/// then both are refined to 0.5° about the best axis. This method is a reference for the samplers and is not meant for
/// a flight computer.
fn find_axis_by_hough(camera: &Camera<f64>, points: &[ImagePoint<f64>]) -> Option<UnitVec3<Cam, f64>> {
    let rays: Vec<[f64; 3]> = points.iter().filter_map(|p| camera.unproject(*p)).map(|r| r.xyz()).collect();
    // Axes are every 2° from the optical axis to 120° off it, and every 2° around it.
    let coarse = (0..=60).flat_map(|ring| {
        let (sin, cos) = (2.0 * f64::from(ring)).to_radians().sin_cos();
        let steps = (180.0 * sin).ceil().max(1.0) as u32;
        (0..steps).map(move |k| {
            let (s, c) = (TAU * f64::from(k) / f64::from(steps)).sin_cos();
            [sin * c, sin * s, cos]
        })
    });
    let (best, _) = coarse.map(|e| (e, count_votes(&rays, &e, 1.0))).max_by_key(|(_, n)| *n)?;
    let (b1, b2) = perpendicular_basis(best);
    let fine = (-4..=4).flat_map(|i| (-4..=4).map(move |j| (f64::from(i), f64::from(j)))).filter_map(|(i, j)| {
        let step = 0.5f64.to_radians();
        UnitVec3::<Cam, f64>::try_new([0, 1, 2].map(|k| best[k] + step * (i * b1[k] + j * b2[k])))
    });
    fine.map(|e| (e, count_votes(&rays, &e.xyz(), 0.5))).max_by_key(|(_, n)| *n).map(|(e, _)| e)
}

/// Returns the number of rays in the fullest bin of the angle to an axis; only angles from 20° to 90° count.
fn count_votes(rays: &[[f64; 3]], e: &[f64; 3], bin_deg: f64) -> u32 {
    let mut bins = [0u32; 200];
    for s in rays {
        let angle = (s[0] * e[0] + s[1] * e[1] + s[2] * e[2]).clamp(-1.0, 1.0).acos().to_degrees();
        if (20.0..90.0).contains(&angle) {
            bins[(angle / bin_deg) as usize] += 1;
        }
    }
    bins.into_iter().max().unwrap_or(0)
}

/// Returns two unit vectors that are perpendicular to a unit vector and to each other.
fn perpendicular_basis(e: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let aside = if e[0].abs() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let b1 = cross(e, aside);
    let n = (b1[0] * b1[0] + b1[1] * b1[1] + b1[2] * b1[2]).sqrt();
    let b1 = b1.map(|x| x / n);
    (b1, cross(e, b1))
}
