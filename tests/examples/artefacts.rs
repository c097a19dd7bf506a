//! Examines artefacts one by one: which ones are answered as a limb, with which error and by which edges, and their
//! pictures.
//!
//! ```sh
//! cargo run --release -p hzn-tests --example artefacts -- --kind ring,disc --count 200 --threshold 1 --list
//! cargo run --release -p hzn-tests --example artefacts -- --kind ring --first 17 --count 1 --png pictures
//! ```
//! The line of a false answer has: kind, seed, threshold, size and lens of the camera, status, error and sigma in
//! degrees, RMS in pixels, inliers of points, arc in pixels, half-angle in degrees, and every edge as `verdict:points`.
//! A picture shows the chosen edge's inliers in green, its other points in yellow, and the fitted limb in red.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::Parser;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::observer::Border;
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, HostHorizon};
use hzn_core::{
    observer::Observer,
    report::{Candidate, Solution},
};
use hzn_tests::artefact::{Kind, Outcome, PriorKnowledge, Trial, process_trial};
use image::{Rgb, RgbImage};
use rayon::prelude::*;

/// Examines artefacts one by one.
#[derive(Debug, Parser)]
struct Args {
    /// Kinds, separated by commas; without it, all
    #[arg(long, value_delimiter = ',')]
    kind: Vec<String>,
    /// Number of pictures of each kind
    #[arg(long, default_value_t = 100)]
    count: u64,
    /// First seed
    #[arg(long, default_value_t = 0)]
    first: u64,
    /// `consensus.threshold_px`, several separated by commas; without it, the default
    #[arg(long, value_delimiter = ',')]
    threshold: Vec<f64>,
    /// Give a prior attitude with this error, degrees (1σ)
    #[arg(long)]
    attitude: Option<f64>,
    /// Show limbs next to artefacts instead of artefacts alone; the list then has limbs that are lost or answered
    /// falsely
    #[arg(long)]
    limb: bool,
    /// With `--limb`: leave out the artefact
    #[arg(long)]
    clean: bool,
    /// Print a line for each false answer
    #[arg(long)]
    list: bool,
    /// Print a line for each picture
    #[arg(long)]
    all: bool,
    /// Write the listed pictures into this folder, with the fitted limb
    #[arg(long)]
    png: Option<PathBuf>,
    /// Set a key of sensor.toml, for example `gates.max_half_angle_sigma=3`; may be given several times
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// A point of the picture in pixels, and its weight in the fit.
type Weighted = ([f64; 2], f64);

/// Points of each edge with their weights.
#[derive(Default)]
struct Watch {
    edges: RefCell<BTreeMap<u32, Vec<Weighted>>>,
}

impl Observer<f64> for Watch {
    fn edge(&self, candidate: u32, _: Border<'_>) {
        self.edges.borrow_mut().insert(candidate, Vec::new());
    }
    fn point(&self, candidate: u32, p: ImagePoint<f64>) {
        self.edges.borrow_mut().entry(candidate).or_default().push(([p.u, p.v], 0.0));
    }
    fn weight(&self, candidate: u32, point: u32, weight: f64) {
        if let Some(p) = self.edges.borrow_mut().entry(candidate).or_default().get_mut(point as usize) {
            p.1 = weight;
        }
    }
    fn verdict(&self, _: u32, _: &Candidate<f64>, _: Option<&Solution<f64>>) {}
}

struct Examined {
    kind: Kind,
    threshold: Option<f64>,
    outcome: Outcome,
    line: String,
}

#[allow(clippy::print_stdout, reason = "a program of the workshop")]
fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let kinds: Vec<Kind> = match args.kind.is_empty() {
        true => Kind::ALL.to_vec(),
        false => {
            let named = |n: &String| Kind::from_name(n).ok_or_else(|| anyhow!("unknown kind {n:?}"));
            args.kind.iter().map(named).collect::<anyhow::Result<_>>()?
        }
    };
    if let Some(folder) = &args.png {
        std::fs::create_dir_all(folder)?;
    }
    let thresholds: Vec<Option<f64>> =
        if args.threshold.is_empty() { vec![None] } else { args.threshold.iter().copied().map(Some).collect() };
    let trials: Vec<(Kind, u64)> =
        kinds.iter().flat_map(|&k| (args.first..args.first + args.count).map(move |s| (k, s))).collect();
    let make = || HostHorizon::boxed(&Config::new(hzn_core::camera::Config::ideal(Default::default(), 64, 48, 60.0)));
    let examined: Vec<Vec<Examined>> = trials
        .into_par_iter()
        .map_init(make, |horizon, (kind, seed)| {
            let horizon = horizon.as_mut().map_err(|e| *e)?;
            examine(horizon, &args, &thresholds, kind, seed)
        })
        .collect::<anyhow::Result<_>>()?;
    let examined: Vec<Examined> = examined.into_iter().flatten().collect();
    for s in examined.iter().filter(|s| !s.line.is_empty()) {
        println!("{}", s.line);
    }
    println!(
        "{:<10}{:>10}{:>9}{:>9}{:>8}{:>7}{:>10}",
        "kind", "threshold", "pictures", "answered", "right", "false", "matching"
    );
    for &kind in &kinds {
        for &threshold in &thresholds {
            let own: Vec<&Outcome> =
                examined.iter().filter(|s| s.kind == kind && s.threshold == threshold).map(|s| &s.outcome).collect();
            let count = |matches: &dyn Fn(&Outcome) -> bool| own.iter().filter(|o| matches(o)).count();
            println!(
                "{:<10}{:>10}{:>9}{:>9}{:>8}{:>7}{:>10}",
                kind.name(),
                threshold.map_or("default".into(), |t| t.to_string()),
                own.len(),
                count(&|o| o.found.is_some()),
                count(&Outcome::is_right),
                count(&|o| o.is_false() && !o.matching_disc),
                count(&|o| o.is_false() && o.matching_disc),
            );
        }
    }
    Ok(())
}

fn examine(
    horizon: &mut HostHorizon,
    args: &Args,
    thresholds: &[Option<f64>],
    kind: Kind,
    seed: u64,
) -> anyhow::Result<Vec<Examined>> {
    let trial = if args.limb { Trial::with_limb(kind, seed)? } else { Some(Trial::without_limb(kind, seed)?) };
    let Some(trial) = trial else { return Ok(Vec::new()) };
    let trial = if args.clean { trial.cleaned() } else { trial };
    let picture = trial.render()?;
    let mut out = Vec::new();
    for &threshold in thresholds {
        let mut config = set(&Config::new(trial.scene.camera.clone()), &args.set)?;
        if let Some(px) = threshold {
            config.consensus.threshold_px = px;
        }
        let watch = Watch::default();
        let prior = PriorKnowledge { attitude_sigma_deg: args.attitude };
        let outcome = process_trial(horizon, &config, &trial, &picture, prior, &watch)?;
        let bad = outcome.is_false() || args.limb && !outcome.is_right();
        let listed = args.all || bad && (args.list || args.png.is_some());
        let line = if listed { line(&trial, threshold, &outcome) } else { String::new() };
        if listed && let Some(folder) = &args.png {
            let px = threshold.map_or("default".into(), |t| t.to_string());
            let path = folder.join(format!("{}-{seed}-{px}.png", kind.name()));
            draw(&trial, &picture, &outcome, &watch).save(&path).with_context(|| path.display().to_string())?;
        }
        out.push(Examined { kind, threshold, outcome, line });
    }
    Ok(out)
}

/// Returns the configuration with keys set as in sensor.toml.
fn set(config: &Config, keys: &[String]) -> anyhow::Result<Config> {
    if keys.is_empty() {
        return Ok(config.clone());
    }
    let mut table = toml::Table::try_from(config)?;
    for key in keys {
        let (path, _) = key.split_once('=').ok_or_else(|| anyhow!("{key}: must have the form KEY=VALUE"))?;
        let given: toml::Table = key.parse().with_context(|| path.to_owned())?;
        merge(&mut table, given);
    }
    Ok(table.try_into()?)
}

fn merge(into: &mut toml::Table, from: toml::Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => drop(into.insert(key, value)),
        }
    }
}

fn line(trial: &Trial, threshold: Option<f64>, o: &Outcome) -> String {
    let camera = &trial.scene.camera;
    let edges: Vec<String> = o.candidates.iter().map(|c| format!("{}:{}", c.verdict.name(), c.points)).collect();
    let found = o.found.map_or(String::new(), |f| {
        let points = o.candidates.iter().find(|c| c.verdict.name() == "chosen").map_or(0, |c| c.points);
        format!(
            " error {:.2}° sigma {:.3}° ({:.1}σ) rms {:.3} px inliers {}/{points} arc {:.0} px half-angle {:.2}°{}",
            f.miss.angle_deg,
            f.miss.sigma_max_deg,
            f.miss.nees.unwrap_or(f64::NAN).sqrt(),
            f.rms_px,
            f.inliers,
            f.arc_px,
            f.half_angle_rad.to_degrees(),
            if o.matching_disc { " MATCHING" } else { "" },
        )
    });
    format!(
        "{} {} t={} {}x{} {} f={:.0} {}{found} [{}]",
        trial.kind.name(),
        trial.seed,
        threshold.map_or("default".into(), |t| t.to_string()),
        camera.width,
        camera.height,
        camera.model.name(),
        camera.fx_px,
        o.status.name(),
        edges.join(" ")
    )
}

fn draw(trial: &Trial, picture: &hzn_sim::Picture, o: &Outcome, watch: &Watch) -> RgbImage {
    let (w, h) = (u32::from(picture.width()), u32::from(picture.height()));
    let mut out = RgbImage::from_fn(w, h, |x, y| Rgb([picture.at(x as u16, y as u16) as u8; 3]));
    let mut dot = |x: f64, y: f64, colour: [u8; 3]| {
        let (x, y) = (x.round(), y.round());
        if x >= 0.0 && y >= 0.0 && x < f64::from(w) && y < f64::from(h) {
            out.put_pixel(x as u32, y as u32, Rgb(colour));
        }
    };
    let chosen = o.candidates.iter().find(|c| c.verdict.name() == "chosen").map(|c| c.number);
    for (number, points) in watch.edges.borrow().iter() {
        for &([x, y], weight) in points {
            let colour = match (Some(*number) == chosen, weight > 0.0) {
                (true, true) => [0, 255, 0],
                (true, false) => [255, 255, 0],
                (false, true) => [0, 160, 255],
                (false, false) => [255, 0, 255],
            };
            dot(x, y, colour);
        }
    }
    if let (Some(f), Ok(lens)) = (o.found, Camera::<f64>::try_new(&trial.scene.camera)) {
        let e = f.axis;
        let helper = if e[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let unit = |v: [f64; 3]| {
            let n = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| x / n)
        };
        let a = unit(cross(e, helper));
        let b = cross(e, a);
        let (sin, cos) = f.half_angle_rad.sin_cos();
        for i in 0..8000 {
            let (s, c) = (std::f64::consts::TAU * f64::from(i) / 8000.0).sin_cos();
            let ray = [0, 1, 2].map(|k| e[k] * cos + (a[k] * c + b[k] * s) * sin);
            if let Some(p) = UnitVec3::try_new(ray).and_then(|r| lens.project(&r)) {
                dot(p.u, p.v, [255, 0, 0]);
            }
        }
    }
    out
}
