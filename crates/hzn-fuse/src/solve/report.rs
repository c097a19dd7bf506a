//! The solution with its covariance, what was determined, and which measurements count less.

use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::layout::{Layout, Place};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::estimates::{Estimates, column};
use super::problem::{Problem, Role, Weighed};
use crate::error::Error;
use crate::results::{CameraState, Determined, Epoch, Lowered, Solved};
use crate::sparse::Marginals;

/// Returns the solutions at the knots, and fills in what else is reported.
pub(super) fn report(
    problem: &Problem<'_>,
    estimates: &Estimates,
    errors: &[Weighed],
    marginals: &Marginals<'_>,
    solved: &mut Solved,
) -> Result<Vec<Epoch>, Error> {
    let missing = || Error::failed("--solve: a covariance is missing");
    let shared_block = estimates.shared_block();
    let shared = marginals.block(shared_block, shared_block).ok_or_else(missing)?;
    let mut epochs = Vec::with_capacity(estimates.knots.len());
    let limb = LimbShare::new(&problem.places().filter, &shared);
    let (mut by_limb, mut total) = (0.0, 0.0);
    for knot in 0..estimates.knots.len() {
        let own = marginals.block(knot, knot).ok_or_else(missing)?;
        let cross = marginals.block(knot, shared_block).ok_or_else(missing)?;
        by_limb += limb.as_ref().map_or(0.0, |limb| limb.variance(&cross));
        total += own.view((Layout::ATTITUDE, Layout::ATTITUDE), (3, 3)).trace();
        epochs.extend(epoch(problem, estimates, knot, &Known { own, cross, shared: &shared }));
    }
    solved.limb_share = limb.and(problem.limb_share_of_directions()).map(|share| [share, by_limb / total]);
    solved.determined = determined(problem, estimates, &shared);
    let lowered = errors.iter().filter(|e| e.weight < 1.0).filter_map(|e| match e.role {
        Role::Model => None,
        Role::Measured(time_s, camera, kind) => {
            let sigmas = e.linear.error.norm();
            Some(Lowered { time_s, camera, kind, sigmas, weight: e.weight })
        }
    });
    solved.lowered = lowered.collect();
    for error in errors {
        if let Role::Measured(_, camera, kind) = error.role {
            *solved.sources.entry((camera, kind)).or_default() += 1;
        }
    }
    Ok(epochs)
}

/// The errors of the limb height, and of its change with the latitude.
struct LimbShare {
    columns: Vec<usize>,
    /// The inverse of their covariance.
    information: DMatrix<f64>,
}

impl LimbShare {
    fn new(layout: &Layout, shared: &DMatrix<f64>) -> Option<Self> {
        let places = [layout.limb_height, layout.limb_latitude].into_iter().flatten();
        let columns: Vec<usize> = places.flat_map(|place| column(place)..column(place) + place.len).collect();
        let covariance = shared.select_rows(&columns).select_columns(&columns);
        let information = covariance.cholesky()?.inverse();
        (!columns.is_empty()).then_some(Self { columns, information })
    }

    /// Returns the part of the attitude's variance that is gone when these errors are known, rad².
    fn variance(&self, cross: &DMatrix<f64>) -> f64 {
        let with = cross.view((Layout::ATTITUDE, 0), (3, cross.ncols())).select_columns(&self.columns);
        (&with * &self.information * with.transpose()).trace()
    }
}

/// Covariances of a knot, of it with the shared errors, and of these.
struct Known<'a> {
    own: DMatrix<f64>,
    cross: DMatrix<f64>,
    shared: &'a DMatrix<f64>,
}

impl Known<'_> {
    fn sigmas(&self, place: Option<Place>) -> Vector3<f64> {
        place.map_or_else(Vector3::zeros, |place| {
            let at = |i: usize| if i < place.len { self.shared[(column(place) + i, column(place) + i)] } else { 0.0 };
            Vector3::from_fn(|i, _| at(i).max(0.0).sqrt())
        })
    }

    fn part(&self, first: usize) -> Covariance<Fixed> {
        let part: Matrix3<f64> = self.own.fixed_view::<3, 3>(first, first).into_owned();
        ((part + part.transpose()) * 0.5).into()
    }

    /// Returns the largest sigma of the attitude of a camera: attitude and mount have common errors.
    fn camera(&self, to_camera: &Matrix3<f64>, misalignment: Option<Place>) -> f64 {
        let mut total = to_camera * self.part(Layout::ATTITUDE).as_inner() * to_camera.transpose();
        if let Some(place) = misalignment {
            let first = column(place);
            let cross = to_camera * self.cross.fixed_view::<3, 3>(Layout::ATTITUDE, first);
            total += cross + cross.transpose() + self.shared.fixed_view::<3, 3>(first, first);
        }
        total.symmetric_eigenvalues().max().max(0.0).sqrt()
    }
}

fn epoch(problem: &Problem<'_>, estimates: &Estimates, knot: usize, known: &Known<'_>) -> Option<Epoch> {
    let state = *estimates.knots.get(knot)?;
    let (layout, shared) = (&problem.places().filter, &estimates.shared);
    let to_vehicle: Rotation<Fixed, Vehicle> = state.attitude.inverse();
    let told = problem.told();
    let camera = |which: usize| {
        let (mount, places) = (shared.mounts.get(which)?, layout.cameras.get(which)?);
        let misalignment: Vector<Cam> = (told.get(which)?.inverse() * *mount).scaled_axis();
        Some(CameraState {
            misalignment_rad: misalignment,
            misalignment_sigma_rad: known.sigmas(places.misalignment),
            clock_s: *shared.clocks_s.get(which)?,
            clock_sigma_s: known.sigmas(places.clock).x,
            mount: *mount,
            camera_sigma_rad: known.camera(&(state.attitude * *mount).inverse().to_matrix(), places.misalignment),
        })
    };
    let latitude = known.sigmas(layout.limb_latitude);
    Some(Epoch {
        state,
        attitude_covariance_rad2: known.part(Layout::ATTITUDE).rotated(&to_vehicle),
        velocity_covariance_m2_s2: known.part(Layout::VELOCITY),
        position_covariance_m2: known.part(Layout::POSITION),
        position_velocity_covariance_m2_s: known
            .own
            .fixed_view::<3, 3>(Layout::POSITION, Layout::VELOCITY)
            .into_owned(),
        corrections: shared.corrections,
        gyro_bias_sigma_rad_s: known.sigmas(layout.gyro_bias),
        accel_bias_sigma_m_s2: known.sigmas(layout.accel_bias),
        limb_height_sigma_km: known.sigmas(layout.limb_height).x,
        limb_latitude_sigma_km: [latitude.x, latitude.y],
        cameras: (0..).map_while(camera).collect(),
        rate_rad_s: problem.turning().at(&state, &shared.corrections, state.time_s).1,
        unaided: None,
    })
}

/// Returns what was known of the shared errors before and afterwards.
fn determined(problem: &Problem<'_>, estimates: &Estimates, shared: &DMatrix<f64>) -> Vec<Determined> {
    let (places, known) = (problem.places(), problem.known());
    let layout = &places.filter;
    let since: DVector<f64> = estimates.shared.since(&problem.told(), places);
    let mut out = Vec::new();
    let mut add = |name: String, unit: &'static str, factor: f64, place: Option<Place>| {
        let Some(place) = place else { return };
        let each = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (column(place)..column(place) + place.len).map(|i| factor * value(i)).collect()
        };
        out.push(Determined {
            name,
            unit,
            estimate: each(&|i| since[i]),
            sigma: each(&|i| shared[(i, i)].max(0.0).sqrt()),
            before: each(&|i| known[i]),
        });
    };
    let per_hour = 1f64.to_degrees() * 3600.0;
    add("gyro bias".into(), "deg/h", per_hour, layout.gyro_bias);
    add("gyro scale".into(), "ppm", 1e6, layout.gyro_scale);
    add("gyro axes".into(), "mrad", 1e3, layout.gyro_misalignment);
    add("accel bias".into(), "m/s2", 1.0, layout.accel_bias);
    add("accel scale".into(), "ppm", 1e6, layout.accel_scale);
    add("accel axes".into(), "mrad", 1e3, layout.accel_misalignment);
    add("limb height".into(), "km", 1.0, layout.limb_height);
    add("limb by latitude".into(), "km", 1.0, layout.limb_latitude);
    for (name, places) in problem.cameras().iter().zip(&layout.cameras) {
        add(format!("mount of {name}"), "deg", 1f64.to_degrees(), places.misalignment);
        add(format!("clock of {name}"), "s", 1.0, places.clock);
    }
    for (name, places) in problem.cameras().iter().zip(&places.lenses) {
        add(format!("focal length of {name}"), "%", 100.0, places.focal);
        add(format!("principal point of {name}"), "px", 1.0, places.centre);
    }
    out
}
