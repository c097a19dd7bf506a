//! The flight of a satellite as a sum of squares.

use hzn_nav::filter::{LatitudeTerm, chi2_limit, predict_direction};
use hzn_nav::frames::{Cam, Fixed, Rotation, Vector, Vehicle};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::dynamics::{Carried, Motion, carried, carried_with_derivative, noise};
use super::estimates::{Estimates, Places, SHARE};
use super::sights::{Attitudes, Sight};
use crate::input::Body;
use crate::reference::limb_axis;
use crate::solve::Loss;
use crate::solve::slow::Link;
use crate::sparse::Linear;

/// 1-sigma of the first knot: position (m), velocity (m/s). The measurements say where the satellite is; these keep the
/// equations regular where they do not.
const FIRST: [f64; 2] = [6.4e6, 1e4];
/// Steps of the derivatives of a direction: of the position, m, and of the clock, s.
const DIFFERENCE: [f64; 2] = [100.0, 0.1];

/// An error at the estimates with the weight of its loss.
#[derive(Debug, Clone)]
pub(super) struct Weighed {
    /// The number of the sight; `None` for what was known before.
    pub(super) sight: Option<usize>,
    pub(super) linear: Linear,
    pub(super) weight: f64,
    pub(super) cost: f64,
}

/// The flight as a sum of squares.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub(super) sights: &'a [Sight],
    pub(super) attitudes: &'a Attitudes,
    pub(super) told: &'a [Rotation<Cam, Vehicle>],
    pub(super) places: &'a Places,
    /// The slow errors that follow each other, two for each sight of a camera that has them.
    pub(super) links: &'a [Link],
    /// The first slow error of each sight.
    pub(super) slow: &'a [Option<usize>],
    /// Accelerations that the dynamics do not have, m/s²/√Hz.
    pub(super) density: f64,
    /// Drag area over mass, m²/kg.
    pub(super) ballistic_m2_kg: f64,
    pub(super) gate_probability: f64,
}

/// Returns the direction of the limb's axis from a position.
pub(super) fn axis(position_m: &Vector3<f64>) -> Option<Vector<Fixed>> {
    limb_axis(Body::Limb, &Vector::from(*position_m))
}

pub(super) fn position(motion: &Motion) -> Vector3<f64> {
    motion.fixed_rows::<3>(0).into_owned()
}

/// Returns the derivative of the axis by the position, 1/m.
fn axis_by_position(position_m: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let mut out = Matrix3::zeros();
    for i in 0..3 {
        let mut step = Vector3::zeros();
        step[i] = DIFFERENCE[0];
        let difference = axis(&(position_m + step))?.into_inner() - axis(&(position_m - step))?.into_inner();
        out.set_column(i, &(difference / (2.0 * DIFFERENCE[0])));
    }
    Some(out)
}

fn dense<const R: usize, const C: usize>(matrix: &SMatrix<f64, R, C>) -> DMatrix<f64> {
    DMatrix::from_column_slice(R, C, matrix.as_slice())
}

fn vector<const R: usize>(v: &SVector<f64, R>) -> DVector<f64> {
    DVector::from_column_slice(v.as_slice())
}

impl Problem<'_> {
    /// Returns all errors at the estimates; `None` if a state left the Earth's surroundings.
    pub(super) fn errors(&self, estimates: &Estimates, begin: &Motion, loss: Loss) -> Option<Vec<Weighed>> {
        let known = |linear: Linear| {
            let cost = linear.error.norm_squared();
            Weighed { sight: None, linear, weight: 1.0, cost }
        };
        let mut all = vec![known(first(estimates.knots.first()?, begin))];
        let sigmas = DVector::from_vec(self.places.holding_sigmas());
        let by = DMatrix::from_diagonal(&sigmas.map(|s| 1.0 / s));
        all.push(known(Linear {
            error: estimates.shared.component_div(&sigmas),
            derivatives: vec![(estimates.shared_block(), by)],
        }));
        for i in 1..estimates.knots.len() {
            all.push(known(self.between(estimates, i)?));
        }
        all.extend(self.links.iter().map(|link| known(link.error(&estimates.slow, |i| estimates.slow_block(i)))));
        for (row, error) in estimates.attitudes.iter().enumerate() {
            let sigma = self.attitudes.rows.get(row)?.2;
            all.push(known(Linear {
                error: vector(&(error / sigma)),
                derivatives: vec![(estimates.attitude_block(row), dense(&(Matrix3::identity() / sigma)))],
            }));
        }
        let mut from: Option<(usize, Carried, f64)> = None;
        for (number, sight) in self.sights.iter().enumerate() {
            let knot = estimates.knot_before(sight.time_s);
            let (at_s, state) = (*estimates.times_s.get(knot)?, estimates.knots.get(knot)?);
            // From sight to sight, so that each second is integrated once.
            let (before, since_s) = match from.filter(|(k, ..)| *k == knot) {
                Some((_, before, since_s)) => (before, since_s),
                None => (Carried::at_rest(state), at_s),
            };
            let now = before.further(sight.time_s - since_s, self.ballistic(estimates));
            let linear = self.sighted(estimates, number, (knot, &now))?;
            from = Some((knot, now, sight.time_s));
            let limit = chi2_limit(linear.error.len(), self.gate_probability);
            let (cost, weight) = loss.of(linear.error.norm_squared(), limit);
            all.push(Weighed { sight: Some(number), linear, weight, cost });
        }
        Some(all)
    }

    /// Returns the error of the dynamics up to a knot.
    fn between(&self, estimates: &Estimates, to: usize) -> Option<Linear> {
        let time_s = estimates.times_s.get(to)? - estimates.times_s.get(to - 1)?;
        let before = estimates.knots.get(to - 1)?;
        let Carried { motion, by, by_drag } = carried_with_derivative(before, time_s, self.ballistic(estimates));
        let factor = noise(time_s, self.density).cholesky()?.l();
        let error: Vector6<f64> = factor.solve_lower_triangular(&(estimates.knots.get(to)? - motion))?;
        let own = factor.solve_lower_triangular(&Matrix6::identity())?;
        let mut derivatives = vec![(to - 1, dense(&(own * -by))), (to, dense(&own))];
        if let Some(drag) = self.places.drag {
            let mut by_shared = DMatrix::zeros(6, self.places.len());
            by_shared.set_column(drag, &(own * -by_drag));
            derivatives.push((estimates.shared_block(), by_shared));
        }
        Some(Linear { error: vector(&error), derivatives })
    }

    /// Returns the drag area over mass at the estimates, m²/kg.
    fn ballistic(&self, estimates: &Estimates) -> f64 {
        self.ballistic_m2_kg * (1.0 + estimates.drag(self.places))
    }

    /// Returns a motion a little later or earlier.
    fn shifted(&self, motion: &Motion, shift_s: f64, estimates: &Estimates) -> Motion {
        if shift_s == 0.0 { *motion } else { carried(motion, shift_s, self.ballistic(estimates)) }
    }

    /// Returns the first slow error of a sight.
    fn slow_of(&self, number: usize) -> Option<usize> {
        self.slow.get(number).copied().flatten()
    }

    /// Returns the error of a sight from the motion at its time, with the motion's derivative by its knot.
    fn sighted(
        &self,
        estimates: &Estimates,
        number: usize,
        (knot, Carried { motion, by, by_drag }): (usize, &Carried),
    ) -> Option<Linear> {
        let sight = self.sights.get(number)?;
        let mount = estimates.mount(self.places, sight.camera, self.told.get(sight.camera)?);
        let clock_s = estimates.clock_s(self.places, sight.camera);
        let rows = [(sight.between.row, 1.0 - sight.between.part), (sight.between.row + 1, sight.between.part)];
        let error_at = |row: usize| estimates.attitudes.get(row).copied().unwrap_or_default();
        let turned: Vector3<f64> = rows.iter().map(|(row, share)| error_at(*row) * *share).sum();
        let seen = |shift_s: f64| {
            let attitude = self.attitudes.at(sight.between, shift_s)?;
            let attitude: Rotation<Vehicle, Fixed> = Rotation::from_scaled_axis(turned.into()) * attitude;
            let place = position(&self.shifted(motion, shift_s, estimates));
            Some((predict_direction(&attitude, &mount, &axis(&place)?), place, attitude))
        };
        let ((predicted, by_attitude, by_mount), place, attitude) = seen(clock_s)?;
        let to_camera = (attitude * mount).inverse().to_matrix();
        let by_position = to_camera * axis_by_position(&place)?;
        let mut by_shared = DMatrix::zeros(2, self.places.len());
        let mut put = |first: Option<usize>, matrix: DMatrix<f64>| {
            if let Some(first) = first {
                by_shared.view_mut((0, first), matrix.shape()).copy_from(&matrix);
            }
        };
        put(self.places.mounts.get(sight.camera).copied().flatten(), dense(&(sight.across * by_mount)));
        if let Some(clock) = self.places.clocks.get(sight.camera).copied().flatten() {
            let [((later, ..), ..), ((earlier, ..), ..)] =
                [seen(clock_s + DIFFERENCE[1])?, seen(clock_s - DIFFERENCE[1])?];
            let by_clock = (later - earlier).into_inner() / (2.0 * DIFFERENCE[1]);
            put(Some(clock), dense(&(sight.across * by_clock)));
        }
        let mut expected = predicted.into_inner() + self.shift(estimates, sight, (&to_camera, &place), &mut put);
        if let Some(slow) = self.slow_of(number) {
            put(self.places.lasting.get(sight.camera).copied().flatten(), dense(&(sight.across * sight.root)));
            expected += sight.root * estimates.slow(self.places, sight.camera, slow);
        }
        put(self.places.drag, dense(&(sight.across * by_position * by_drag.fixed_rows::<3>(0))));
        let by_position: SMatrix<f64, 3, 6> = by_position * by.fixed_rows::<3>(0);
        let mut derivatives = vec![(knot, dense(&(sight.across * by_position))), (estimates.shared_block(), by_shared)];
        for (row, share) in rows.into_iter().filter(|(row, share)| *share > 0.0 && *row < estimates.attitudes.len()) {
            derivatives.push((estimates.attitude_block(row), dense(&(sight.across * by_attitude * share))));
        }
        if let Some(slow) = self.slow_of(number) {
            let by = sight.across * sight.root * SHARE.sqrt();
            derivatives.extend([slow, slow + 1].map(|i| (estimates.slow_block(i), dense(&by))));
        }
        let error = sight.across * (expected - sight.measured.as_inner());
        error.iter().all(|x| x.is_finite()).then(|| Linear { error: vector(&error), derivatives })
    }
}

/// Puts the derivative by an error of the whole flight into its columns, if the error is unknown.
type Put<'a> = &'a mut dyn FnMut(Option<usize>, DMatrix<f64>);

impl Problem<'_> {
    /// Returns by how much limb height and lens move the axis of a limb, and puts the derivatives.
    fn shift(
        &self,
        estimates: &Estimates,
        sight: &Sight,
        (to_camera, place): (&Matrix3<f64>, &Vector3<f64>),
        put: Put<'_>,
    ) -> Vector3<f64> {
        let mut shift = sight.by_limb_height.as_inner() * estimates.height_km(self.places);
        put(self.places.height, dense(&(sight.across * sight.by_limb_height.as_inner())));
        if let (Some(first), Some(terms)) = (self.places.latitude, LatitudeTerm::both(&(*place).into())) {
            for (i, (term, coefficient)) in terms.iter().zip(estimates.latitude_km(self.places)).enumerate() {
                let by = sight.by_limb_height.into_inner() * term.height + to_camera * term.tilt.as_inner();
                put(Some(first + i), dense(&(sight.across * by)));
                shift += by * coefficient;
            }
        }
        if let Some((lens, by)) = self.places.lenses.get(sight.camera).and_then(Option::as_ref).zip(sight.by_lens) {
            let across = sight.across * by * &lens.root;
            put(Some(lens.first), DMatrix::from_column_slice(2, across.ncols(), across.as_slice()));
            shift += by * estimates.lens(lens);
        }
        shift
    }
}

fn first(knot: &Motion, begin: &Motion) -> Linear {
    let [position, velocity] = FIRST.map(|s| 1.0 / s);
    let scale = Vector6::new(position, position, position, velocity, velocity, velocity);
    Linear {
        error: vector(&(knot - begin).component_mul(&scale)),
        derivatives: vec![(0, dense(&Matrix6::from_diagonal(&scale)))],
    }
}
