//! The orbit with its covariance, and what was determined.

use std::collections::BTreeMap;

use hzn_nav::filter::Corrections;
use hzn_nav::frames::{Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::earth_rate;
use hzn_nav::strapdown::Nominal;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};

use super::adjust::{Covariances, with_covariances};
use super::case::{Case, Solution};
use super::dynamics::{GM_M3_S2, Motion, carried_with_derivative, noise};
use super::estimates::LensPlace;
use super::problem::position;
use crate::error::Error;
use crate::input::Body;
use crate::results::{self, CameraState, Determined, Epoch, Kind, Lowered, Solved};
use crate::settings::Orbit;

/// Returns the solutions at the pictures, and how they were found.
pub(super) fn report(case: &Case<'_>, solution: &Solution, names: &[String]) -> Result<(Vec<Epoch>, Solved), Error> {
    let at = &solution.adjusted;
    let missing = || Error::failed("--solve: a covariance is missing");
    let (mut epochs, mut solved) = with_covariances(at, &case.places, true, |covariances, factor, pattern| {
        let shared = covariances.of_shared(at.estimates.shared_block())?;
        let considered: BTreeMap<usize, f64> = case.places.considered().collect();
        let estimated = |i: usize| shared.get((i, i)).copied().unwrap_or(0.0).max(0.0).sqrt();
        let sigma = |i: usize| considered.get(&i).copied().unwrap_or_else(|| estimated(i));
        let cameras = cameras(case, solution, &sigma);
        let mut epochs = epochs(case, solution, covariances, &cameras)?;
        let of_limb = |place: Option<usize>| place.map_or(0.0, sigma);
        for epoch in &mut epochs {
            epoch.limb_height_sigma_km = of_limb(case.places.height);
            epoch.limb_latitude_sigma_km =
                [of_limb(case.places.latitude), of_limb(case.places.latitude.map(|i| i + 1))];
        }
        let solved = Solved {
            unknowns: pattern.len(),
            knots: at.estimates.knots.len(),
            factor_numbers: factor.len(),
            steps: at.steps,
            is_converged: at.is_converged,
            cost: at.cost,
            determined: determined(case, solution, names, (&sigma, &shared)),
            lowered: lowered(solution),
            limb_share: None,
            sources: BTreeMap::new(),
            orbit: None,
        };
        Some((epochs, solved))
    })?
    .ok_or_else(missing)?;
    let corrections = Corrections {
        limb_height_km: at.estimates.height_km(&case.places),
        limb_latitude_km: at.estimates.latitude_km(&case.places),
        ..Corrections::default()
    };
    epochs.iter_mut().for_each(|epoch| epoch.corrections = corrections);
    let bound =
        with_covariances(at, &case.places, false, |covariances, _, _| self::epochs(case, solution, covariances, &[]))?
            .ok_or_else(missing)?;
    solved.orbit = orbit(&epochs, &bound);
    for sight in &solution.sights {
        *solved.sources.entry((Some(sight.camera), Kind::Direction(Body::Limb))).or_default() += 1;
    }
    Ok((epochs, solved))
}

/// Returns the axes radial, along and across the orbit, as columns in ECEF.
fn orbit_axes(state: &Nominal) -> Matrix3<f64> {
    let inertial = (state.velocity_m_s + earth_rate().cross(&state.position_m)).into_inner();
    let radial = state.position_m.into_inner().normalize();
    let across = radial.cross(&inertial).normalize();
    Matrix3::from_columns(&[radial, across.cross(&radial), across])
}

/// Returns the elements at the end, and the RMS sigmas and bounds of the position.
fn orbit(epochs: &[Epoch], bound: &[Epoch]) -> Option<results::Orbit> {
    let last = epochs.last()?;
    let rms = |all: &[Epoch]| -> [f64; 3] {
        let sum: Vector3<f64> = all
            .iter()
            .map(|epoch| {
                let axes = orbit_axes(&epoch.state);
                (axes.transpose() * epoch.position_covariance_m2.as_inner() * axes).diagonal()
            })
            .sum();
        (sum / all.len().max(1) as f64).map(|v| v.max(0.0).sqrt()).into()
    };
    let x = last.state.position_m.into_inner();
    let v = (last.state.velocity_m_s + earth_rate().cross(&last.state.position_m)).into_inner();
    let semi_axis_m = 1.0 / (2.0 / x.norm() - v.norm_squared() / GM_M3_S2);
    let momentum = x.cross(&v);
    let eccentricity = (v.cross(&momentum) / GM_M3_S2 - x.normalize()).norm();
    Some(results::Orbit {
        semi_axis_m,
        eccentricity,
        inclination_rad: (momentum.z / momentum.norm()).clamp(-1.0, 1.0).acos(),
        sigma_m: rms(epochs),
        bound_m: rms(bound),
    })
}

fn cameras(case: &Case<'_>, solution: &Solution, sigma: &dyn Fn(usize) -> f64) -> Vec<CameraState> {
    let estimates = &solution.adjusted.estimates;
    let camera = |(which, told): (usize, &Rotation<_, Vehicle>)| {
        let mount = estimates.mount(&case.places, which, told);
        let place = case.places.mounts.get(which).copied().flatten();
        let clock = case.places.clocks.get(which).copied().flatten();
        let misalignment_sigma_rad =
            place.map_or_else(Vector3::zeros, |first| Vector3::from_fn(|i, _| sigma(first + i)));
        CameraState {
            misalignment_rad: (told.inverse() * mount).scaled_axis(),
            misalignment_sigma_rad,
            clock_s: estimates.clock_s(&case.places, which),
            clock_sigma_s: clock.map_or(0.0, sigma),
            mount,
            camera_sigma_rad: misalignment_sigma_rad.max(),
        }
    };
    case.mounts.iter().enumerate().map(camera).collect()
}

/// Returns the motion at each picture with its covariance; `None` if a covariance is missing.
fn epochs(
    case: &Case<'_>,
    solution: &Solution,
    covariances: &Covariances<'_>,
    cameras: &[CameraState],
) -> Option<Vec<Epoch>> {
    let estimates = &solution.adjusted.estimates;
    let mut out: Vec<Epoch> = Vec::new();
    for sight in &solution.sights {
        if out.last().is_some_and(|last| last.state.time_s == sight.time_s) {
            continue;
        }
        let knot = estimates.knot_before(sight.time_s);
        let time_s = sight.time_s - estimates.times_s.get(knot)?;
        let Orbit { ballistic_m2_kg, accel_noise_mps2_rthz, .. } = case.settings.orbit;
        let drag = ballistic_m2_kg * (1.0 + estimates.drag(&case.places));
        let now = carried_with_derivative(estimates.knots.get(knot)?, time_s, drag);
        let covariance = covariances.of_motion(knot, &now, case.places.drag)? + noise(time_s, accel_noise_mps2_rthz);
        out.push(epoch(solution, sight, (&now.motion, &covariance), cameras)?);
    }
    Some(out)
}

fn epoch(
    solution: &Solution,
    sight: &super::sights::Sight,
    (motion, covariance): (&Motion, &Matrix6<f64>),
    cameras: &[CameraState],
) -> Option<Epoch> {
    let part = |first: usize| -> Covariance<Fixed> {
        let part: Matrix3<f64> = covariance.fixed_view::<3, 3>(first, first).into_owned();
        ((part + part.transpose()) * 0.5).into()
    };
    let attitudes = &solution.attitudes;
    let attitude = attitudes.at(sight.between, 0.0)?;
    let later = attitudes.at(sight.between, 1.0).unwrap_or(attitude);
    let sigma_rad = attitudes.rows.get(sight.between.row).map_or(0.0, |row| row.2);
    Some(Epoch {
        state: Nominal {
            time_s: sight.time_s,
            attitude,
            velocity_m_s: Vector::from(motion.fixed_rows::<3>(3).into_owned()),
            position_m: position(motion).into(),
        },
        attitude_covariance_rad2: Covariance::isotropic(sigma_rad * sigma_rad),
        velocity_covariance_m2_s2: part(3),
        position_covariance_m2: part(0),
        position_velocity_covariance_m2_s: covariance.fixed_view::<3, 3>(0, 3).into_owned(),
        corrections: Corrections::default(),
        gyro_bias_sigma_rad_s: Vector3::zeros(),
        accel_bias_sigma_m_s2: Vector3::zeros(),
        limb_height_sigma_km: 0.0,
        limb_latitude_sigma_km: [0.0; 2],
        cameras: cameras.to_vec(),
        rate_rad_s: attitude.inverse() * (later * attitude.inverse()).scaled_axis(),
        unaided: None,
    })
}

fn lowered(solution: &Solution) -> Vec<Lowered> {
    let errors = solution.adjusted.errors.iter().filter(|e| e.weight < 1.0);
    let one = |e: &super::problem::Weighed| {
        let sight = solution.sights.get(e.sight?)?;
        Some(Lowered {
            time_s: sight.time_s,
            camera: Some(sight.camera),
            kind: Kind::Direction(Body::Limb),
            sigmas: e.linear.error.norm(),
            weight: e.weight,
        })
    };
    errors.filter_map(one).collect()
}

/// Returns what was known of the errors of the whole flight before and afterwards: `sigma` is that of each, and
/// `covariance` that of all of them.
fn determined(
    case: &Case<'_>,
    solution: &Solution,
    names: &[String],
    (sigma, covariance): (&dyn Fn(usize) -> f64, &DMatrix<f64>),
) -> Vec<Determined> {
    let (places, estimates) = (&case.places, &solution.adjusted.estimates);
    let mut out = Vec::new();
    let mut add = |name: String, unit: &'static str, factor: f64, first: Option<usize>, len: usize| {
        let Some(first) = first else { return };
        let each = |value: &dyn Fn(usize) -> f64| (first..first + len).map(|i| factor * value(i)).collect();
        out.push(Determined {
            name,
            unit,
            estimate: each(&|i| estimates.shared.get(i).copied().unwrap_or(0.0)),
            sigma: each(sigma),
            before: each(&|i| places.sigmas.get(i).copied().unwrap_or(0.0)),
        });
    };
    add("limb height".into(), "km", 1.0, places.height, 1);
    add("limb by latitude".into(), "km", 1.0, places.latitude, 2);
    add("drag".into(), "%", 100.0, places.drag, 1);
    for ((name, mount), clock) in names.iter().zip(&places.mounts).zip(&places.clocks) {
        add(format!("mount of {name}"), "deg", 1f64.to_degrees(), *mount, 3);
        add(format!("clock of {name}"), "s", 1.0, *clock, 1);
    }
    for (name, place) in names.iter().zip(&places.lenses) {
        out.extend(place.iter().flat_map(|place| lens(name, place, &estimates.lens(place), covariance)));
    }
    out
}

/// Returns what was known of a lens before and afterwards.
fn lens(name: &str, place: &LensPlace, estimate: &Vector3<f64>, covariance: &DMatrix<f64>) -> Vec<Determined> {
    let n = place.root.ncols();
    let own = &place.root * covariance.view((place.first, place.first), (n, n)) * place.root.transpose();
    let before = &place.root * place.root.transpose();
    let parts = [("focal length", "%", 100.0, 0..1), ("principal point", "px", 1.0, 1..3)];
    let parts = parts.into_iter().map(|(what, unit, factor, rows)| {
        let each = |value: &dyn Fn(usize) -> f64| rows.clone().map(|i| factor * value(i)).collect();
        Determined {
            name: format!("{what} of {name}"),
            unit,
            estimate: each(&|i| estimate[i]),
            sigma: each(&|i| own[(i, i)].max(0.0).sqrt()),
            before: each(&|i| before[(i, i)].sqrt()),
        }
    });
    parts.filter(|one| one.before.iter().all(|sigma| *sigma > 0.0)).collect()
}
