//! The filter's solution: estimates against what was known before, refusals, innovations.

use std::collections::BTreeMap;

use hzn_nav::filter::chi2_limit;
use hzn_nav::frames::Vector;
use hzn_nav::options::{Block, CameraOptions, Mode, Options};

use super::receiver::median;
use crate::finding::{Cause, Finding, Level, Source};
use crate::results::{Determined, Epoch, Fused, Innovation, Kind, Solved};

/// Sigmas of an estimate above which it contradicts what was known before.
const FAR: f64 = 4.0;
/// Sigmas of the mean of all clocks above which they are in doubt: clocks of cameras on one computer are late together.
const CLOCKS: f64 = 1.5;
/// Largest share of refused measurements of a source, and the fewest that count.
const REFUSED: (f64, usize) = (0.2, 5);
/// Most new starts.
const RESTARTS: usize = 2;
/// Length of a block of innovations, s: the correlation time of slow errors.
const BLOCK_S: f64 = 20.0;

/// Tests the solution.
pub(super) fn test(fused: &Fused, cameras: &[CameraOptions], options: &Options) -> Vec<Finding> {
    let mut all = Vec::new();
    if let Some(last) = fused.epochs.last() {
        estimates("the filter", fused, last, cameras, options, &mut all);
    }
    if let (Some(solved), Some(last)) = (&fused.solved, fused.smoothed.last()) {
        estimates("the solve", fused, last, cameras, options, &mut all);
        all.extend(fused.cameras.iter().filter_map(|name| lens(solved, name)));
        all.extend(solved.sources.iter().filter_map(|(source, count)| lowered(fused, solved, *source, *count)));
    }
    for ((camera, kind), innovations) in &by_source(fused) {
        all.extend(source(fused, *camera, *kind, innovations));
    }
    let restarts = fused.counts.restarts_when_wrong;
    if restarts > RESTARTS {
        let what = format!(
            "the filter began again {restarts} times, because its attitude was refused: the directions do not stay \
             with one attitude"
        );
        all.push(Finding { level: Level::Contradicts, cause: Cause::Unknown, source: Source::All, what });
    }
    all
}

/// Compares the estimates at the end with what was known before.
fn estimates(
    who: &str,
    fused: &Fused,
    last: &Epoch,
    cameras: &[CameraOptions],
    options: &Options,
    all: &mut Vec<Finding>,
) {
    let is_estimated = |block: &Block| block.mode == Mode::Estimated && block.sigma > 0.0;
    let mut far = |cause: Cause, source: Source, name: &str, sigmas: f64| {
        if sigmas > FAR {
            let what = format!("{who} estimates {name} {sigmas:.1} sigma from what was known before");
            all.push(Finding { level: Level::Contradicts, cause, source, what });
        }
    };
    let largest = |v: &Vector<_>, sigma: f64| v.as_inner().amax() / sigma;
    let mut clocks = Vec::new();
    for ((name, camera), state) in fused.cameras.iter().zip(cameras).zip(&last.cameras) {
        if is_estimated(&camera.misalignment) {
            let sigmas = state.misalignment_rad.as_inner().amax() / camera.misalignment.sigma;
            far(Cause::Mount, Source::Camera(name.clone()), &format!("the mount of {name}"), sigmas);
        }
        if is_estimated(&camera.clock) {
            let sigmas = state.clock_s / camera.clock.sigma;
            far(Cause::CameraClock, Source::Camera(name.clone()), &format!("the clock of {name}"), sigmas.abs());
            clocks.push((state.clock_s, sigmas));
        }
    }
    let imu = &options.imu;
    if is_estimated(&imu.gyro_bias) {
        far(Cause::GyroBias, Source::Imu, "the gyros' bias", largest(&last.corrections.gyro_bias, imu.gyro_bias.sigma));
    }
    if is_estimated(&imu.accel_bias) {
        let sigmas = largest(&last.corrections.accel_bias, imu.accel_bias.sigma);
        far(Cause::AccelBias, Source::Imu, "the accelerometers' bias", sigmas);
    }
    let n = clocks.len() as f64;
    let [mean_s, sigmas] = [clocks.iter().map(|c| c.0).sum::<f64>() / n, clocks.iter().map(|c| c.1).sum::<f64>() / n];
    if clocks.len() > 1 && sigmas.abs() > CLOCKS {
        let what = format!(
            "{who}: all cameras' clocks together are {mean_s:+.2} s off, {sigmas:+.1} of their sigma: is their latency \
             known?"
        );
        all.push(Finding { level: Level::Doubtful, cause: Cause::CameraClock, source: Source::Cameras, what });
    }
}

/// Compares the estimated lens of a camera with its calibration.
pub(crate) fn lens(solved: &Solved, name: &str) -> Option<Finding> {
    let own = [format!("focal length of {name}"), format!("principal point of {name}")];
    let estimates = solved.determined.iter().filter(|one| own.contains(&one.name));
    let sigmas = |one: &Determined| {
        one.estimate.iter().zip(&one.before).map(|(value, sigma)| (value / sigma).abs()).fold(0.0, f64::max)
    };
    let (one, far) = estimates.map(|one| (one, sigmas(one))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (far > FAR).then(|| {
        let what = format!(
            "the solve estimates the {} {far:.1} sigma from what was known before: is its calibration that of this \
             flight?",
            one.name
        );
        Finding { level: Level::Contradicts, cause: Cause::Lens, source: Source::Camera(name.to_owned()), what }
    })
}

type Sources<'a> = BTreeMap<(Option<usize>, Kind), Vec<&'a Innovation>>;

fn by_source(fused: &Fused) -> Sources<'_> {
    let mut all = Sources::new();
    for innovation in &fused.innovations {
        all.entry((innovation.camera, innovation.kind)).or_default().push(innovation);
    }
    all
}

/// Tests how many measurements of a source the solve counts less: as the filter's refusals.
fn lowered(fused: &Fused, solved: &Solved, (camera, kind): (Option<usize>, Kind), count: usize) -> Option<Finding> {
    let lowered = solved.lowered.iter().filter(|l| (l.camera, l.kind) == (camera, kind)).count();
    if lowered < REFUSED.1 || lowered as f64 <= REFUSED.0 * count as f64 {
        return None;
    }
    let About { source, cause, ask, name } = About::new(fused, camera, kind);
    let what = format!("{name}: {lowered} of {count} differ from the solve by more than their sigmas explain: {ask}");
    Some(Finding { level: Level::Contradicts, cause, source, what })
}

/// What a finding about a source says.
struct About {
    source: Source,
    cause: Cause,
    ask: &'static str,
    name: String,
}

impl About {
    fn new(fused: &Fused, camera: Option<usize>, kind: Kind) -> Self {
        let camera = camera.and_then(|c| fused.cameras.get(c));
        let (source, cause, ask) = match (camera, kind) {
            (Some(name), _) => {
                (Source::Camera(name.clone()), Cause::Mount, "are its mount, its clock and its lens right?")
            }
            (None, Kind::Attitude) => {
                (Source::StarTracker, Cause::TrackerFrame, "is the frame of its attitudes right?")
            }
            (None, _) => (Source::Receiver, Cause::Receiver, "are its clock and its frame right?"),
        };
        let name = camera.map_or_else(String::new, |name| format!("{name}, ")) + kind.name();
        Self { source, cause, ask, name }
    }
}

/// Tests the innovations of one source, taken or not.
fn source(fused: &Fused, camera: Option<usize>, kind: Kind, all: &[&Innovation]) -> Option<Finding> {
    let About { source, cause, ask, name } = About::new(fused, camera, kind);
    let refused = all.iter().filter(|i| !i.taken).count();
    let finding = |level, what| Some(Finding { level, cause, source: source.clone(), what });
    if refused >= REFUSED.1 && refused as f64 > REFUSED.0 * all.len() as f64 {
        return finding(Level::Contradicts, format!("{name}: {refused} of {} are refused: {ask}", all.len()));
    }
    // The errors of a block are nearly one: its median is above this once in a hundred blocks.
    let limit = chi2_limit(all.first().map_or(2, |i| i.value.len()), 0.01);
    let mut blocks: BTreeMap<i64, Vec<f64>> = BTreeMap::new();
    for innovation in all {
        blocks.entry((innovation.time_s / BLOCK_S).floor() as i64).or_default().push(innovation.nis);
    }
    let far = blocks.values().filter(|nis| median(nis.iter().copied()).is_some_and(|m| m > limit)).count();
    if far < 3 || far * 5 < blocks.len() {
        return None;
    }
    let what = "differ from the solution by more than the sigmas explain";
    finding(Level::Contradicts, format!("{name}: in {far} of {} spans of {BLOCK_S} s they {what}: {ask}", blocks.len()))
}
