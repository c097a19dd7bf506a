//! `hzn calibrate rig`: the mounts of the heads of a rig, from the limbs that they see together.

use std::path::{Path, PathBuf};

use hzn_calib::rig::{Adjusted, Check, check, noticed};
use hzn_core::status::Status;
use hzn_files::rig::{Head, HeadMount};
use hzn_run::disk;
use hzn_run::engine::{self, End, Turns};
use hzn_run::explain::counted;
use hzn_run::rig::{self, Epochs, HeadPlan, Opened, Plan, Request};
use nalgebra::{Matrix3, UnitQuaternion};

use super::rig_text;
use crate::commands::run::cores;
use crate::doubts::Contradictions;
use crate::exit::{Exit, Outcome, Stop, failed, usage};
use crate::files;
use crate::limbs_of_rig::{LimbsOfRig, PRIOR_DEG};
use crate::progress::Progress;
use crate::setup::stop_flag;
use crate::tell;

/// Find how the heads of a rig are mounted to each other, from the limbs that they see together
///
/// The pictures of rig.toml are processed. Its mounts are the start, and may be wrong by some degrees; their sigmas are
/// not used. The turns of all heads, the half-angle of each epoch and a height of the limb for each head are adjusted
/// together, so that neither the altitude nor the limb height needs to be known. The mean of all turns stays zero: the
/// limb says nothing about the attitude of the whole rig on the vehicle.
///
/// The heads see a turn about the direction to the Earth only while the vehicle turns under it. The report names the
/// turns that the pictures do not determine. With --check, nothing is adjusted: the command says whether the told
/// mounts still hold within their sigmas, and which head has turned if three or more heads tell it. Exit code 0 for
/// `holds`, 1 for `does not hold`. Mounts do not hold either if the joint answer of `hzn run` refuses more epochs, or
/// excludes a head from more of them, than chance explains with `false_alarm` of rig.toml.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The rig.toml
    #[arg(value_name = "RIG.TOML")]
    rig: PathBuf,
    /// Write a rig.toml with these mounts and their covariance, next to the one that is read
    #[arg(short, long, value_name = "TOML", conflicts_with = "check")]
    output: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    /// Say whether the mounts of rig.toml still hold
    #[arg(long)]
    check: bool,
    /// 1-sigma of each mount about each axis before the adjustment, in degrees
    #[arg(long, value_name = "DEG", default_value_t = PRIOR_DEG)]
    prior_deg: f64,
    /// frames.csv of the vehicle; without it, the one next to rig.toml
    #[arg(long, value_name = "CSV")]
    frames: Option<PathBuf>,
    /// Altitude in kilometres, if sensor.toml and frames.csv have none
    #[arg(long, value_name = "KM")]
    altitude_km: Option<f64>,
    /// Number of threads; without it, all cores
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Print no progress on stderr
    #[arg(short, long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Outcome {
    if !(args.prior_deg > 0.0 && args.prior_deg <= 90.0) {
        return Err(usage("--prior-deg: must be above 0 and at most 90"));
    }
    let outputs: Vec<PathBuf> = args.output.iter().cloned().collect();
    files::check_outputs(std::slice::from_ref(&args.rig), &outputs, args.force)?;
    let opened = rig::open(&Request {
        rig: args.rig.clone(),
        frames: args.frames.clone(),
        altitude_km: args.altitude_km,
        ..Request::default()
    })?;
    check_output(args, &opened)?;
    opened.warnings.iter().for_each(tell::warning);
    if opened.heads.len() < 2 {
        return Err(usage(format!("{}: one head has no mount relative to another one", args.rig.display())));
    }
    let (names, false_alarm) = (opened.rig.heads.clone(), opened.rig.rig.false_alarm);
    let Some(found) = look(args, opened)? else {
        tell::line("interrupted; nothing was measured");
        return Ok(Exit::Interrupted);
    };
    let adjusted = found.limbs.adjust(args.prior_deg).map_err(|why| {
        let heads: Vec<&str> = names.iter().map(|head| head.name.as_str()).collect();
        let epochs = counted(found.count, "epoch");
        failed(format!("{}: of {epochs}: {}", args.rig.display(), why.describe(&heads)))
    })?;
    if args.check {
        let told_rad2 = found.limbs.told_rad2();
        let checked = check(&adjusted, &told_rad2);
        // The joint answer compares the heads with the told mounts, too, and may refuse what the turns leave open.
        let refused = found.contradictions.describe(false_alarm);
        tell::report(rig_text::check_report(
            &names,
            &adjusted,
            (&checked, &noticed(&adjusted, &told_rad2)),
            refused.as_deref(),
        ))?;
        let holds = matches!(checked, Check::Holds(_)) && refused.is_none();
        return Ok(if holds { Exit::Done } else { Exit::Failed });
    }
    tell::report(rig_text::report(&names, &adjusted))?;
    if let Some(why) = rig_text::contradicts_told(&names, &check(&adjusted, &found.limbs.told_rad2())) {
        tell::warning(why);
    }
    if let Some(path) = &args.output {
        refuse_wider(&names, &adjusted, &found.limbs.told_rad2())?;
        write(args, path, &adjusted)?;
    }
    Ok(Exit::Done)
}

/// Refuses an output that is read, that exists, or whose paths would lead elsewhere.
fn check_output(args: &Args, opened: &Opened) -> Result<(), Stop> {
    let Some(output) = &args.output else { return Ok(()) };
    files::check_outputs(&opened.files, std::slice::from_ref(output), args.force)?;
    let folder = |path: &Path| path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_owned();
    let (own, other) = (folder(output).canonicalize().ok(), folder(&args.rig).canonicalize().ok());
    if own.is_none() || own != other {
        let what = "its paths are relative to its folder, so write it next to";
        return Err(usage(format!("{}: {what} {}", output.display(), args.rig.display())));
    }
    Ok(())
}

/// The limbs of a run.
struct Found {
    limbs: LimbsOfRig,
    count: u64,
    contradictions: Contradictions,
}

/// Processes the pictures. `None` if the run was interrupted.
fn look(args: &Args, opened: Opened) -> Result<Option<Found>, Stop> {
    let (joiner, total) = (opened.joiner()?, opened.pictures());
    let limbs = LimbsOfRig::new(&opened.rig, &joiner);
    let sync_s = opened.rig.rig.sync_s;
    let head = |head: &rig::OpenHead| HeadPlan {
        name: head.name.clone(),
        plan: engine::Plan {
            config: head.sensor.config.clone(),
            flight: false,
            threads: if head.sensor.config.tracks() { 1 } else { args.jobs.map_or_else(cores, usize::from) },
            frames: None,
            fps: 1.0,
            trace: false,
            keep_traces: false,
            // A picture that repeats the one before it is found by its bytes.
            keep_picture: true,
            overlay: None,
            masks: None,
            last: Vec::new(),
            turns: Turns::default(),
        },
    };
    let heads: Vec<HeadPlan> = opened.heads.iter().map(head).collect();
    let threads = heads.iter().map(|head| head.plan.threads).min().unwrap_or(1);
    let plan = Plan { heads, joiner, threads, keep_pictures: false };
    let mut epochs = Epochs::new(opened.heads, sync_s)?;
    let mut progress = Progress::new(total, 0, args.quiet);
    let mut found = Found { limbs, count: 0, contradictions: Contradictions::default() };
    let end = rig::look(&plan, &mut epochs, &stop_flag(), &mut |epoch| {
        found.count += 1;
        for frame in epoch.heads.iter().flatten() {
            progress.count(frame.outcomes.iter().map(|outcome| outcome.status()).take(1));
        }
        // A head that repeats a picture is excluded, too, and says nothing about its mount.
        let excluded = epoch.joint.heads_excluded.is_some() && epoch.repeats.iter().all(Option::is_none);
        found.contradictions.count(epoch.joint.status == Status::Ok, &epoch.joint.detail, excluded);
        found.limbs.add(epoch, &plan.joiner, false);
    })?;
    progress.finish();
    epochs.warnings().iter().for_each(tell::warning);
    Ok((end == End::Complete).then_some(found))
}

/// Refuses to write mounts whose sigmas are all larger than those of rig.toml: the joint answers would be less sure.
fn refuse_wider(heads: &[Head], adjusted: &Adjusted, told_rad2: &[Matrix3<f64>]) -> Result<(), Stop> {
    let sigma_deg = |p: &Matrix3<f64>| (p.trace() / 3.0).sqrt().to_degrees();
    let both: Vec<[f64; 2]> =
        told_rad2.iter().enumerate().map(|(k, told)| [sigma_deg(told), sigma_deg(&adjusted.block(k))]).collect();
    // Told mounts that are wrong, or that have no sigma, are no better.
    let is_told = both.iter().all(|[told, _]| *told > 0.0) && matches!(check(adjusted, told_rad2), Check::Holds(_));
    if !is_told || both.iter().any(|[told, found]| found < told) {
        return Ok(());
    }
    let each = heads.iter().zip(&both).map(|(head, [told, found])| format!("{} {told:.2} -> {found:.2}", head.name));
    let largest = both.iter().map(|[told, _]| *told).fold(0.0, f64::max);
    Err(failed(format!(
        "nothing is written: the pictures do not determine the mounts better than rig.toml tells them (1-sigma of each \
         head, deg: {}); give --prior-deg {largest:.2}, which keeps what rig.toml knows of the other turns, or turn \
         the vehicle about other axes",
        each.collect::<Vec<_>>().join(", ")
    )))
}

fn write(args: &Args, path: &Path, adjusted: &Adjusted) -> Result<(), Stop> {
    let mut rig = hzn_files::rig::load(&args.rig)?;
    let deg2 = 1f64.to_degrees().powi(2);
    for (k, (head, mount)) in rig.heads.iter_mut().zip(&adjusted.mounts).enumerate() {
        let q = UnitQuaternion::from_rotation_matrix(mount);
        let p = adjusted.block(k) * deg2;
        head.mount = Some(HeadMount {
            q_rig_from_camera_wxyz: [q.w, q.i, q.j, q.k],
            sigma_deg: (p.trace() / 3.0).sqrt(),
            covariance_deg2: Some([p.m11, p.m12, p.m13, p.m22, p.m23, p.m33]),
        });
    }
    let [used, _] = adjusted.epochs;
    let text = hzn_files::rig::to_text(&rig).map_err(|e| failed(format!("{}: {e}", path.display())))?;
    let text = format!("# The mounts are those of hzn calibrate rig, from {}.\n{text}", counted(used as u64, "epoch"));
    disk::write_whole(path, &text)?;
    tell::line(format_args!("wrote {}", path.display()));
    Ok(())
}
