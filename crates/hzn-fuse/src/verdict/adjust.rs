//! One adjustment of a flight's directions: attitudes of windows, mounts, clocks, and errors of the gyros at once.
//!
//! A filter takes a wrong mount or clock for a right one, bit by bit, and its gates hide the rest. The adjustment has
//! all directions at once and starts again for each suspicion: the cause whose error explains the directions best is
//! the likeliest one. Its cost is χ² with the settings' sigmas, so that the difference of two costs is χ² with the
//! number of the freed errors. Between two windows the gyros carry the attitude, with their noise.
//!
//! Here the vectors have no frames in their types: all derivatives are in the frame that does not turn.

use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

use super::motion::Integrals;
use super::problem::{Look, Problem, Tracked};
use super::state::{Sighted, State};

/// Square of the error over its sigma at which an error counts half (Cauchy's loss): 3σ.
const CAUCHY: f64 = 9.0;
/// Most steps of an adjustment, and the relative change of the cost that ends it.
const STEPS: (usize, f64) = (15, 1e-4);

/// Derivatives of an error, with the places of their unknowns.
type Columns = Vec<(usize, Vector3<f64>)>;

/// The normal equations at a state.
struct Normal {
    /// Only the lower triangle has values: the factor reads no other.
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    cost: f64,
}

impl Normal {
    /// Adds an error of three numbers with its derivatives: one column for each unknown, and each unknown at most once.
    fn add(&mut self, error: &Vector3<f64>, sigma: f64, is_robust: bool, columns: &[(usize, Vector3<f64>)]) {
        let square = error.norm_squared() / (sigma * sigma);
        let (cost, weight) =
            if is_robust { (CAUCHY * (square / CAUCHY).ln_1p(), 1.0 / (1.0 + square / CAUCHY)) } else { (square, 1.0) };
        self.cost += cost;
        let weight = weight / (sigma * sigma);
        for (k, (i, a)) in columns.iter().enumerate() {
            self.gradient[*i] += weight * a.dot(error);
            for (j, b) in columns.iter().take(k + 1) {
                self.matrix[(*i.max(j), *i.min(j))] += weight * a.dot(b);
            }
        }
    }
}

impl Problem {
    /// Returns the cost at a state.
    pub(super) fn cost(&self, state: &State) -> f64 {
        self.normal(state).cost
    }

    /// Adjusts from a state on; returns the state and its cost.
    pub(super) fn adjust(&self, mut state: State) -> (State, f64) {
        let mut normal = self.normal(&state);
        let mut damping = 1e-6;
        for _ in 0..STEPS.0 {
            let mut matrix = normal.matrix.clone();
            for i in 0..matrix.nrows() {
                matrix[(i, i)] *= 1.0 + damping;
                matrix[(i, i)] += 1e-12;
            }
            let Some(factor) = matrix.cholesky() else { break };
            let next = self.moved(&state, &factor.solve(&-&normal.gradient));
            let better = self.normal(&next);
            if better.cost < normal.cost {
                let gain = normal.cost - better.cost;
                let is_done = gain < STEPS.1 * (1.0 + normal.cost);
                (state, normal, damping) = (next, better, (damping * 0.1).max(1e-9));
                if is_done {
                    break;
                }
            } else {
                damping *= 100.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        let cost = normal.cost;
        (state, cost)
    }

    fn moved(&self, state: &State, step: &DVector<f64>) -> State {
        let at = |i: usize| Vector3::new(step[i], step[i + 1], step[i + 2]);
        let turn = |(w, q): (usize, &UnitQuaternion<f64>)| UnitQuaternion::from_scaled_axis(at(3 * w)) * q;
        let windows: Vec<_> = state.windows.iter().enumerate().map(turn).collect();
        let shared = &state.shared + step.rows(3 * windows.len(), state.shared.len());
        State { windows, shared }
    }

    fn normal(&self, state: &State) -> Normal {
        let (first, n) = (3 * self.windows.len(), 3 * self.windows.len() + self.shared.len());
        let mut normal = Normal { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n), cost: 0.0 };
        for look in &self.looks {
            let (error, columns) = self.look_error(state, look);
            normal.add(&error, look.sigma, true, &columns);
        }
        for tracked in &self.tracked {
            let (error, columns) = self.tracker_error(state, tracked);
            normal.add(&error, tracked.sigma, true, &columns);
        }
        for later in 1..self.windows.len() {
            let (error, columns) = self.carried_error(state, later);
            let sigma = self.carried_sigma(&self.windows[later - 1], &self.windows[later]);
            normal.add(&error, sigma, false, &columns);
        }
        for (i, (value, sigma)) in state.shared.iter().zip(&self.sigmas).enumerate() {
            normal.cost += (value / sigma).powi(2);
            normal.gradient[first + i] += value / (sigma * sigma);
            normal.matrix[(first + i, first + i)] += 1.0 / (sigma * sigma);
        }
        normal
    }

    /// Returns a direction in the frame of the first sample, with the attitude's integrals at its time.
    pub(super) fn on_unit(&self, shared: &DVector<f64>, look: &Look) -> (Sighted, Integrals) {
        let s = self.shared;
        let three = |i: usize| Vector3::new(shared[i], shared[i + 1], shared[i + 2]);
        let clock_s = shared[s.clock(look.camera)] + shared[s.clocks()];
        let now = self.reckoning.at(look.time_s + clock_s).unwrap_or(look.integrals);
        let window = &self.windows[look.window];
        let by_latitude = look.by_latitude.iter().enumerate().map(|(i, (height, _))| height * shared[s.latitude() + i]);
        let height_km = shared[s.height()] + by_latitude.sum::<f64>();
        let in_camera = (look.measured - look.by_height * height_km).normalize();
        let mount = look.mount * UnitQuaternion::from_scaled_axis(three(s.mount(look.camera)));
        let unit = UnitQuaternion::from_scaled_axis(three(s.unit()));
        let on_vehicle = unit * mount * in_camera;
        let drift =
            -((now.by_bias - window.by_bias) * three(s.bias()) + (now.by_scale - window.by_scale) * three(s.scale()));
        let attitude = UnitQuaternion::from_scaled_axis(drift) * now.attitude.into_inner();
        (Sighted { direction: attitude * on_vehicle, on_vehicle, in_camera, attitude, mount: unit * mount }, now)
    }

    /// Returns the reference of a direction at the UTC of the state and with its limb heights by latitude.
    pub(super) fn reference(&self, shared: &DVector<f64>, look: &Look) -> Vector3<f64> {
        let late_s = if look.is_celestial { shared[self.shared.utc()] } else { 0.0 };
        let coefficients = look.by_latitude.iter().enumerate();
        let tilt: Vector3<f64> = coefficients.map(|(i, (_, tilt))| tilt * shared[self.shared.latitude() + i]).sum();
        super::problem::about_pole(late_s) * look.reference + tilt
    }

    /// Returns measured minus known direction, with its derivatives.
    fn look_error(&self, state: &State, look: &Look) -> (Vector3<f64>, Columns) {
        let (first, s) = (3 * self.windows.len(), self.shared);
        let (seen, now) = self.on_unit(&state.shared, look);
        let to_fixed = state.windows[look.window];
        let direction = to_fixed * seen.direction;
        let reference = self.reference(&state.shared, look);
        let mut columns = Vec::with_capacity(20);
        three(&mut columns, 3 * look.window, &-direction.cross_matrix());
        let turned = (to_fixed * seen.attitude).to_rotation_matrix().into_inner();
        let by_mount = -(turned * seen.mount.to_rotation_matrix().into_inner()) * seen.in_camera.cross_matrix();
        three(&mut columns, first + s.mount(look.camera), &by_mount);
        three(&mut columns, first + s.unit(), &(-turned * seen.on_vehicle.cross_matrix()));
        let by_clock = turned * now.rate_rad_s.as_inner().cross(&seen.on_vehicle);
        columns.push((first + s.clock(look.camera), by_clock));
        columns.push((first + s.clocks(), by_clock));
        let window = &self.windows[look.window];
        let by_drift = to_fixed.to_rotation_matrix().into_inner() * seen.direction.cross_matrix();
        three(&mut columns, first + s.bias(), &(by_drift * (now.by_bias - window.by_bias)));
        three(&mut columns, first + s.scale(), &(by_drift * (now.by_scale - window.by_scale)));
        let by_height = -(turned * (seen.mount * look.by_height));
        columns.push((first + s.height(), by_height));
        for (i, (height, tilt)) in look.by_latitude.iter().enumerate() {
            columns.push((first + s.latitude() + i, by_height * *height - tilt));
        }
        if look.is_celestial {
            let rate = super::problem::EARTH_RATE_RAD_S;
            columns.push((first + s.utc(), -(Vector3::z() * rate).cross(&reference)));
        }
        (direction - reference, columns)
    }

    /// Returns the rotation from the predicted attitude to that of the star tracker.
    fn tracker_error(&self, state: &State, tracked: &Tracked) -> (Vector3<f64>, Columns) {
        let (first, s) = (3 * self.windows.len(), self.shared);
        let at = |i: usize| Vector3::new(state.shared[i], state.shared[i + 1], state.shared[i + 2]);
        let (window, now) = (&self.windows[tracked.window], &tracked.integrals);
        let by = (now.by_bias - window.by_bias, now.by_scale - window.by_scale);
        let drift = UnitQuaternion::from_scaled_axis(-(by.0 * at(s.bias()) + by.1 * at(s.scale())));
        let to_fixed = state.windows[tracked.window];
        let attitude = to_fixed * drift * now.attitude.into_inner();
        // The attitude is that of the unit, and the tracker's that of the vehicle.
        let of_vehicle = attitude * UnitQuaternion::from_scaled_axis(at(s.unit()));
        let turned = of_vehicle * UnitQuaternion::from_scaled_axis(at(s.tracker()));
        let error = (tracked.attitude * turned.inverse()).scaled_axis();
        let matrix = to_fixed.to_rotation_matrix().into_inner();
        let mut columns = Vec::with_capacity(12);
        three(&mut columns, 3 * tracked.window, &-Matrix3::identity());
        three(&mut columns, first + s.bias(), &(matrix * by.0));
        three(&mut columns, first + s.scale(), &(matrix * by.1));
        three(&mut columns, first + s.unit(), &-attitude.to_rotation_matrix().into_inner());
        three(&mut columns, first + s.tracker(), &-of_vehicle.to_rotation_matrix().into_inner());
        (error, columns)
    }

    /// Returns the rotation between two windows that the gyros' errors do not explain.
    fn carried_error(&self, state: &State, later: usize) -> (Vector3<f64>, Columns) {
        let (first, s) = (3 * self.windows.len(), self.shared);
        let at = |i: usize| Vector3::new(state.shared[i], state.shared[i + 1], state.shared[i + 2]);
        let (a, b) = (&self.windows[later - 1], &self.windows[later]);
        let (from, to) = (state.windows[later - 1], state.windows[later]);
        let matrix = from.to_rotation_matrix().into_inner();
        let by = (matrix * (b.by_bias - a.by_bias), matrix * (b.by_scale - a.by_scale));
        let error = (to * from.inverse()).scaled_axis() + by.0 * at(s.bias()) + by.1 * at(s.scale());
        let mut columns = Vec::with_capacity(12);
        three(&mut columns, 3 * later, &Matrix3::identity());
        three(&mut columns, 3 * (later - 1), &-Matrix3::identity());
        three(&mut columns, first + s.bias(), &by.0);
        three(&mut columns, first + s.scale(), &by.1);
        (error, columns)
    }
}

/// Adds the columns of a matrix.
fn three(columns: &mut Columns, first: usize, matrix: &Matrix3<f64>) {
    columns.extend(matrix.column_iter().enumerate().map(|(i, column)| (first + i, column.into_owned())));
}
