//! The orbit of a satellite from limbs and attitudes alone, without an inertial unit and a receiver.
//!
//! The unknowns are position and velocity at knots, which the motion in the Earth's gravity joins, mounts and clocks of
//! the cameras, the limb height, the slow error of each direction, and the errors of the attitudes. See
//! `book/theory/solve.md`.

mod adjust;
mod case;
mod dynamics;
mod estimates;
mod problem;
mod report;
mod sights;
mod start;
mod told;
mod verdict;

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::gravity::earth_rate;

use crate::error::Error;
use crate::input::Inputs;
use crate::results::{Begin, Counts, Epoch, Fused};
use crate::settings::{Limb, Settings};
use case::{Case, Solution};

/// Finds the orbit. `mounts` are those of the recordings.
///
/// # Errors
/// There are too few limbs with an attitude, or they do not determine an orbit.
pub(crate) fn fuse(inputs: &Inputs, settings: &Settings, mounts: &[Rotation<Cam, Vehicle>]) -> Result<Fused, Error> {
    check(inputs, settings)?;
    let case = Case::new(inputs, settings, mounts)?;
    let mut counts = Counts::default();
    let solution = case.solve(&inputs.attitudes, &mut counts)?;
    let names: Vec<String> = inputs.recordings.iter().map(|r| r.name.clone()).collect();
    let (epochs, solved) = report::report(&case, &solution, &names)?;
    let verdict = verdict::verdict(&case, &solution, &names, (&epochs, &solved));
    let mut notes = vec![
        "the orbit is that of limbs and attitudes alone; the longitude is that of the attitudes, whose frame no limb \
         can test"
            .to_owned(),
    ];
    notes.extend(told(&case, &solution, &names, &epochs));
    if !solved.is_converged {
        notes.push(format!("--solve did not converge in {} steps", solved.steps));
    }
    let first_s = solution.sights.first().map_or(0.0, |sight| sight.time_s);
    Ok(Fused {
        cameras: names,
        told_mounts: mounts.to_vec(),
        begin: Some(Begin { time_s: first_s, directions: 0, chi2: 0.0 }),
        smoothed: epochs,
        solved: Some(solved),
        counts,
        verdict,
        notes,
        ..Fused::default()
    })
}

/// Refuses inputs that give no orbit, and says what is needed.
fn check(inputs: &Inputs, settings: &Settings) -> Result<(), Error> {
    if inputs.has_receiver() {
        return Err(Error::unusable("a receiver needs the samples of an inertial unit; give --imu FILE too"));
    }
    if inputs.attitudes.is_empty() {
        return Err(Error::unusable(
            "without an inertial unit, limbs give an orbit only with attitudes; give --attitude FILE, or --imu FILE",
        ));
    }
    if inputs.recordings.is_empty() {
        return Err(Error::unusable("an orbit needs limbs; give --nadir FILE, the results of `hzn run`"));
    }
    match inputs.recordings.iter().find(|r| settings.camera(&r.name).limb == Limb::Position) {
        Some(one) => Err(Error::unusable(format!(
            "{}: limb = \"position\" in fuse.toml needs an inertial unit and a receiver; the orbit takes the axes",
            one.name
        ))),
        None => Ok(()),
    }
}

/// Returns what an error of the told mounts, clocks and lenses does to the position along the orbit. A limb that stays
/// in its place in the picture does not tell them apart.
fn told(case: &Case<'_>, solution: &Solution, names: &[String], epochs: &[Epoch]) -> Vec<String> {
    let Some(state) = epochs.last().map(|epoch| epoch.state) else { return Vec::new() };
    let speed_m_s = (state.velocity_m_s + earth_rate().cross(&state.position_m)).norm();
    let sigma = |place: Option<usize>| place.and_then(|i| case.places.sigmas.get(i)).copied().unwrap_or(0.0);
    let distance_km = state.position_m.norm() * 1e-3;
    let of_camera = |(camera, name): (usize, &String)| {
        let of = |all: &[Option<usize>]| sigma(all.get(camera).copied().flatten());
        let (mount_rad, clock_s) = (of(&case.places.mounts), of(&case.places.clocks));
        let lens = by_lens_rad(case, solution, camera).map_or_else(String::new, |rad| {
            format!(", and the {:.3}° of its told lens {:.1} km", rad.to_degrees(), rad * distance_km)
        });
        format!(
            "along the orbit, a position looks like an error of mount or clock: the told {:.3}° of the mount of \
             {name} are {:.1} km, and the told {clock_s} s of its clock {:.1} km{lens}",
            mount_rad.to_degrees(),
            mount_rad * distance_km,
            clock_s * speed_m_s * 1e-3
        )
    };
    names.iter().enumerate().map(of_camera).collect()
}

/// Returns the largest sigma of a limb's direction by the told lens of a camera, as the root of the mean square over
/// its pictures, rad; `None` if the lens is no unknown.
fn by_lens_rad(case: &Case<'_>, solution: &Solution, camera: usize) -> Option<f64> {
    let root = &case.places.lenses.get(camera)?.as_ref()?.root;
    let sights = solution.sights.iter().filter(|sight| sight.camera == camera).filter_map(|sight| sight.by_lens);
    let variances = sights.map(|by| {
        let by = by * root;
        (&by * by.transpose()).symmetric_eigenvalues().max()
    });
    let (count, sum) = variances.fold((0.0, 0.0), |(count, sum), variance| (count + 1.0, sum + variance));
    (count > 0.0).then(|| f64::sqrt(sum / count))
}
