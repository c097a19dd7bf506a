//! What `hzn fuse` prints.

use std::collections::BTreeMap;

use hzn_files::vehicle::VehicleRow;
use hzn_fuse::Fused;
use hzn_fuse::finding::Level;
use hzn_fuse::results::{Counts, Determined, Epoch, Kind, Orbit, ReceiverLag, Solved};
use hzn_fuse::truth::{self, Miss};

use crate::exit::Stop;
use crate::tell::{self, one_line};

/// Prints what happened.
pub(super) fn print(fused: &Fused, truth: Option<&[VehicleRow]>) -> Result<(), Stop> {
    for (name, value) in lines(fused, truth) {
        tell::report(format_args!("{:<22} {}\n", one_line(name), one_line(value)))?;
    }
    for note in &fused.notes {
        tell::line(format_args!("note: {note}"));
    }
    Ok(())
}

/// Returns what happened: names and values.
pub(super) fn lines(fused: &Fused, truth: Option<&[VehicleRow]>) -> Vec<(String, String)> {
    let mut out = Vec::new();
    let mut line = |name: &str, value: String| out.push((name.to_owned(), value));
    line("verdict", fused.verdict.level().name().to_owned());
    if let (Some(begin), Some(last)) = (fused.begin, fused.epochs.last()) {
        let from = match begin.directions {
            0 => "an attitude of the star tracker".to_owned(),
            n => format!("{n} directions"),
        };
        line("start", format!("{:.2} s, from {from}", begin.time_s));
        line("end", format!("{:.2} s", last.state.time_s));
        line("attitude, 3 sigma", format!("{} deg at the end, about x, y, z of the vehicle", three(last)));
        for (name, camera) in fused.cameras.iter().zip(&last.cameras) {
            let [a, b] =
                [camera.misalignment_rad.into_inner(), camera.misalignment_sigma_rad].map(|v| v.map(f64::to_degrees));
            line(
                &format!("mount of {name}"),
                format!(
                    "{:+.3} {:+.3} {:+.3} deg, 3 sigma {:.3} {:.3} {:.3}",
                    a.x,
                    a.y,
                    a.z,
                    3.0 * b.x,
                    3.0 * b.y,
                    3.0 * b.z
                ),
            );
            if camera.clock_sigma_s > 0.0 {
                line(
                    &format!("clock of {name}"),
                    format!("{:+.3} s, 3 sigma {:.3}", camera.clock_s, 3.0 * camera.clock_sigma_s),
                );
            }
        }
    }
    for ReceiverLag { camera, lag_s, sigma_s, speed_m_s } in &fused.receiver_lags {
        let name = fused.cameras.get(*camera).map_or("", String::as_str);
        let away_m = lag_s.abs() * speed_m_s;
        let text = format!("{lag_s:+.3} s late, 3 sigma {:.3}; {away_m:.0} m along the path", 3.0 * sigma_s);
        line(&format!("receiver against {name}"), text);
    }
    for (name, Tally { taken, refused, nis, freedom }) in tallies(fused) {
        let mean = nis / (taken + refused).max(1) as f64;
        line(
            &name,
            format!(
                "{taken} taken, {refused} refused; squared innovation of all over its covariance {mean:.2} (ideal \
                 {freedom})"
            ),
        );
    }
    for (name, value) in fused.solved.iter().flat_map(|solved| solve(fused, solved)) {
        line(&name, value);
    }
    for (name, value) in counts(&fused.counts) {
        line(&name, value);
    }
    out.extend(truth.into_iter().flat_map(|truth| against(fused, truth)));
    out
}

/// Returns the errors of the solutions against the truth: names and values.
fn against(fused: &Fused, truth: &[VehicleRow]) -> Vec<(String, String)> {
    // Where the inputs contradict each other, a large error is no surprise.
    let is_doubted = fused.verdict.level() == Level::Contradicts;
    let later = if fused.solved.is_some() { "solve" } else { "smoother" };
    let all = [("filter", &fused.epochs), (later, &fused.smoothed)].into_iter();
    let named = all.filter_map(|(name, epochs)| {
        Some((format!("error of the {name}"), errors(&truth::compare(epochs, truth), is_doubted)?))
    });
    named.collect()
}

fn three(epoch: &Epoch) -> String {
    let sigma = epoch.attitude_sigma_rad().map(|s| 3.0 * s.to_degrees());
    format!("{:.3} {:.3} {:.3}", sigma.x, sigma.y, sigma.z)
}

/// What became of the measurements of one source.
#[derive(Default)]
struct Tally {
    taken: usize,
    refused: usize,
    /// Sum of the squares of the innovations over their covariance, taken or not.
    nis: f64,
    /// Numbers in an innovation: the ideal mean of those squares.
    freedom: usize,
}

/// Most measurements that are named one by one.
const MOST_NAMED: usize = 5;

/// Returns what the solve of the whole flight found: names and values.
fn solve(fused: &Fused, solved: &Solved) -> Vec<(String, String)> {
    let [before, after] = solved.cost;
    let first = if solved.orbit.is_some() { "first orbit" } else { "filter's solution" };
    let mut out = vec![(
        "solve".to_owned(),
        format!(
            "{} unknowns, {} states, {} steps; squared errors over their sigmas {before:.0} at the {first}, {after:.0} \
             at the end",
            solved.unknowns, solved.knots, solved.steps
        ),
    )];
    out.extend(solved.orbit.iter().flat_map(orbit));
    if let (Some(filter), Some(last)) = (fused.epochs.last(), fused.smoothed.last()) {
        let text = format!("{} deg before (filter), {} after (solve)", three(filter), three(last));
        out.push(("  3 sigma at the end".to_owned(), text));
    }
    out.extend(solved.limb_share.map(|share| {
        let [before, after] = share.map(|share| 100.0 * share);
        let text = format!(
            "causes {before:.1} % of the variance of a limb's direction, and {after:.1} % of that of the attitude"
        );
        ("  unknown limb height".to_owned(), text)
    }));
    out.extend(solved.determined.iter().map(determined));
    for ((camera, kind), count) in &solved.sources {
        let lowered: Vec<_> = solved.lowered.iter().filter(|l| (l.camera, l.kind) == (*camera, *kind)).collect();
        if lowered.is_empty() {
            continue;
        }
        let mut worst = lowered.clone();
        worst.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas));
        let named: Vec<String> =
            worst.iter().take(MOST_NAMED).map(|l| format!("{:.1} s: {:.0} sigma", l.time_s, l.sigmas)).collect();
        let text = format!("{} of {count} count less, they are too far off: {}", lowered.len(), named.join(", "));
        out.push((format!("  {}", source_name(fused, *camera, *kind)), text));
    }
    out
}

/// Returns what is known of an orbit: names and values.
fn orbit(orbit: &Orbit) -> [(String, String); 3] {
    let km = |m: [f64; 3]| m.map(|m| format!("{:.2}", 1e-3 * m)).join(" ");
    [
        (
            "  orbit at the end".to_owned(),
            format!(
                "semi-major axis {:.1} km, eccentricity {:.4}, inclination {:.2} deg",
                1e-3 * orbit.semi_axis_m,
                orbit.eccentricity,
                orbit.inclination_rad.to_degrees()
            ),
        ),
        ("  position, sigma".to_owned(), format!("{} km radial, along, across the orbit", km(orbit.sigma_m))),
        (
            "  Cramer-Rao bound".to_owned(),
            format!(
                "{} km: no smaller sigma is possible with the told limb height, mounts and clocks",
                km(orbit.bound_m)
            ),
        ),
    ]
}

/// Says how much better an error is known than before.
fn determined(one: &Determined) -> (String, String) {
    let largest = |all: &[f64]| all.iter().copied().fold(0.0, f64::max);
    let list = |all: &[f64]| all.iter().map(|x| format!("{x:+.3}")).collect::<Vec<_>>().join(" ");
    let share = one.sigma.iter().zip(&one.before).map(|(after, before)| after / before).fold(0.0, f64::max);
    let word = match share {
        s if s < 0.5 => "determined",
        s if s < 0.9 => "partly determined",
        _ => "as before",
    };
    let text = format!(
        "{word}: {} {}, sigma {:.3} (before {:.3})",
        list(&one.estimate),
        one.unit,
        largest(&one.sigma),
        largest(&one.before)
    );
    (format!("  {}", one.name), text)
}

/// Returns the name of a source.
fn source_name(fused: &Fused, camera: Option<usize>, kind: Kind) -> String {
    match camera.and_then(|c| fused.cameras.get(c)) {
        Some(camera) => format!("{camera}, {}", kind.name()),
        None => kind.name().to_owned(),
    }
}

/// Returns the name and the tally of each source.
fn tallies(fused: &Fused) -> Vec<(String, Tally)> {
    let mut all: BTreeMap<(Option<usize>, Kind), Tally> = BTreeMap::new();
    for i in &fused.innovations {
        let tally = all.entry((i.camera, i.kind)).or_default();
        tally.taken += usize::from(i.taken);
        tally.refused += usize::from(!i.taken);
        tally.nis += i.nis;
        tally.freedom = i.value.len();
    }
    all.into_iter().map(|((camera, kind), tally)| (source_name(fused, camera, kind), tally)).collect()
}

fn counts(counts: &Counts) -> Vec<(String, String)> {
    let all = [
        ("samples", counts.samples),
        ("  not finite", counts.samples_not_finite),
        ("  duplicate", counts.samples_duplicate),
        ("  out of order", counts.samples_out_of_order),
        ("  gaps before them", counts.gaps),
        ("  saturated", counts.saturated),
        ("  frozen", counts.frozen),
        ("before the start", counts.before_start),
        ("outside the samples", counts.outside),
        ("without a reference", counts.without_reference),
        ("while unknown", counts.waiting),
        ("new starts", counts.restarts),
        ("not usable", counts.unusable.values().sum()),
    ];
    let shown = all.into_iter().filter(|(name, count)| *count > 0 || *name == "samples");
    let reasons =
        counts.unusable.iter().map(|((source, why), count)| (format!("  {source}"), format!("{count}: {why}")));
    shown.map(|(name, count)| (name.to_owned(), count.to_string())).chain(reasons).collect()
}

/// NEES of a row from which on the truth itself is doubtful.
const OF_ANOTHER_FLIGHT: f64 = 1000.0;

/// Returns the errors against the truth in words.
fn errors(misses: &[Miss], is_doubted: bool) -> Option<String> {
    let n = misses.len() as f64;
    if misses.is_empty() {
        return None;
    }
    let rms =
        |axis: usize| (misses.iter().map(|m| m.attitude_rad.xyz()[axis].powi(2)).sum::<f64>() / n).sqrt().to_degrees();
    let nees = misses.iter().map(|m| m.nees).sum::<f64>() / n;
    let worst = misses.iter().map(|m| m.attitude_rad.norm()).fold(0.0, f64::max).to_degrees();
    let last = misses.last()?.attitude_rad.norm().to_degrees();
    // The largest NEES of a right flight is some tens; that of another clock or frame is in the thousands.
    let is_other = !is_doubted && misses.iter().filter(|m| m.nees > OF_ANOTHER_FLIGHT).count() * 2 > misses.len();
    let doubt = if is_other {
        "; is the truth of this flight (its clock, its frame, the sign of its quaternions)?"
    } else {
        ""
    };
    let position = (misses.iter().map(|m| m.position_m.norm_squared()).sum::<f64>() / n).sqrt();
    Some(format!(
        "{:.3} {:.3} {:.3} deg RMS, largest {worst:.3}, at the end {last:.3}; NEES {nees:.2} (ideal 3); position \
         {position:.1} m{doubt}",
        rms(0),
        rms(1),
        rms(2)
    ))
}
