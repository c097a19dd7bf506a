//! The intrinsic parameters that a flight estimates, with what is known about them before.

use hzn_core::camera::{Config, Covariance, Intrinsic};
use nalgebra::{DMatrix, DVector};

/// 1-sigma of a focal length that nobody states, as a fraction of it. The nominal focal length of a lens differs from
/// the real one by a few percent, up to 7 % among the photographs that were examined.
const UNKNOWN_FOCAL: f64 = 0.1;
/// 1-sigma of a principal point that nobody states, as a fraction of the larger side of the picture. Detectors are
/// centred behind a lens to about a hundred pixels.
const UNKNOWN_CENTRE: f64 = 0.02;
/// 1-sigma of k1 if it is to be estimated and nobody states it: lenses without a calibration are within it of their
/// model.
const UNKNOWN_K1: f64 = 0.1;
/// 1-sigma of the ratio of the two focal lengths if both are to be estimated and nobody states it.
const UNKNOWN_ASPECT: f64 = 0.01;
/// Smallest 1-sigma of the ratio of the two focal lengths: it is far below every effect, and keeps the prior regular.
const MIN_ASPECT: f64 = 1e-5;
/// Smallest 1-sigma of any other parameter, as a fraction of a focal length or of 1, for the same reason.
const MIN_SIGMA: f64 = 1e-7;

/// A parameter that is estimated only on request, because the calibration of a lens usually has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// The ratio of the two focal lengths, that is fx and fy separately.
    Aspect,
    /// The first coefficient of the lens.
    K1,
}

/// The intrinsic parameters of a lens that are estimated, with their values and covariance before the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    /// The calibration before the flight.
    pub(super) before: Config,
    /// The parameters, in the order of the model.
    pub(super) list: Vec<Intrinsic>,
    /// Their covariance before the flight.
    pub(super) covariance: DMatrix<f64>,
    /// Whether the calibration states each parameter's sigma. The other sigmas are assumed.
    pub(super) stated: Vec<bool>,
    /// Number of sides of the Sun whose edges have shapes of their own.
    pub(super) sides: usize,
}

impl Unknowns {
    /// Selects the parameters of a calibration that take part: those with a sigma in `[camera.covariance]` or in the
    /// scalar sigmas, and the focal lengths and the principal point in any case. `requested` adds further ones.
    pub fn new(config: &Config, requested: &[Parameter]) -> Self {
        Self::with_stated(config, requested, &stated_covariance(config))
    }

    /// Does the same as [`Self::new`] without the stated sigmas. The flight alone determines the parameters.
    pub fn ignoring_sigmas(config: &Config, requested: &[Parameter]) -> Self {
        Self::with_stated(config, requested, &Stated::default())
    }

    fn with_stated(config: &Config, requested: &[Parameter], stated: &Stated) -> Self {
        let is_asked = |which: Intrinsic| which == Intrinsic::K1 && requested.contains(&Parameter::K1);
        let always = [Intrinsic::FxPx, Intrinsic::FyPx, Intrinsic::CxPx, Intrinsic::CyPx];
        let list: Vec<Intrinsic> = (config.model.intrinsics().iter().copied())
            .filter(|i| always.contains(i) || stated.has(*i) || is_asked(*i))
            .collect();
        let aspect = if requested.contains(&Parameter::Aspect) { UNKNOWN_ASPECT } else { MIN_ASPECT };
        let mut covariance = assumed_covariance(config, &list, aspect);
        for (i, one) in list.iter().enumerate() {
            for (j, other) in list.iter().enumerate() {
                if stated.has(*one) || stated.has(*other) {
                    covariance[(i, j)] = stated.get(*one, *other);
                }
            }
            let floor = MIN_SIGMA * relative_unit(config, *one);
            covariance[(i, i)] += floor * floor;
            // Two focal lengths with one sigma need a difference, or the matrix is singular.
            if stated.has(*one) && *one == Intrinsic::FyPx {
                covariance[(i, i)] += (aspect * config.fy_px).powi(2);
            }
        }
        let known = list.iter().map(|i| stated.has(*i)).collect();
        Self { before: config.clone(), list, covariance, stated: known, sides: 1 }
    }

    /// Returns whether the calibration states the covariance of all its parameters, as one of boards or stars does.
    pub(super) fn is_calibrated(&self) -> bool {
        let all = self.before.model.intrinsics();
        self.before.covariance.is_some() && self.list.len() == all.len() && self.stated.iter().all(|stated| *stated)
    }

    /// Returns the calibration with changed parameters.
    pub(super) fn changed_by(&self, changes: &[f64]) -> Config {
        let mut config = self.before.clone();
        for (which, change) in self.list.iter().zip(changes) {
            config.set_intrinsic(*which, self.before.intrinsic(*which).unwrap_or(0.0) + change);
        }
        config
    }

    /// Returns the 1-sigma of the focal length before the flight, in percent.
    pub fn focal_sigma_percent(&self) -> f64 {
        let scale = self.scale_weights();
        100.0 * (scale.transpose() * &self.covariance * &scale)[(0, 0)].sqrt()
    }

    /// Returns the weights of the parameters in the relative change of scale of the picture: the mean of the two
    /// relative changes of the focal lengths.
    pub(super) fn scale_weights(&self) -> DVector<f64> {
        let weight = |i: &Intrinsic| match i {
            Intrinsic::FxPx => 0.5 / self.before.fx_px,
            Intrinsic::FyPx => 0.5 / self.before.fy_px,
            _ => 0.0,
        };
        DVector::from_iterator(self.list.len(), self.list.iter().map(weight))
    }

    /// Returns the change of the parameters that scales the picture by 1 (100 %).
    pub(super) fn scale_direction(&self) -> DVector<f64> {
        let direction = |i: &Intrinsic| match i {
            Intrinsic::FxPx => self.before.fx_px,
            Intrinsic::FyPx => self.before.fy_px,
            _ => 0.0,
        };
        DVector::from_iterator(self.list.len(), self.list.iter().map(direction))
    }

    /// Returns the places of the principal point in the list.
    pub(super) fn centre(&self) -> [Option<usize>; 2] {
        [Intrinsic::CxPx, Intrinsic::CyPx].map(|which| self.list.iter().position(|i| *i == which))
    }

    /// Returns the unknowns for a test of the calibration: the scale is free, and all others keep the sigmas of the
    /// calibration. A principal point without a sigma gets one pixel.
    ///
    /// Bend and asymmetry of the limb are unknowns for each side of the Sun.
    pub(super) fn for_check(config: &Config) -> Self {
        let mut unknowns = Self { sides: 2, ..Self::of_calibration(config) };
        let direction = unknowns.scale_direction() * UNKNOWN_FOCAL;
        unknowns.covariance += &direction * direction.transpose();
        unknowns
    }

    /// Returns the parameters with the sigmas that the calibration claims. A principal point without a sigma gets one
    /// pixel, and a focal length without a sigma is exact.
    pub(super) fn of_calibration(config: &Config) -> Self {
        let mut stated = stated_covariance(config);
        for (which, sigma) in
            [(Intrinsic::CxPx, 1.0), (Intrinsic::CyPx, 1.0), (Intrinsic::FxPx, 0.0), (Intrinsic::FyPx, 0.0)]
        {
            stated.require(which, sigma);
        }
        Self::with_stated(config, &[], &stated)
    }

    /// Returns the covariance with a free principal point.
    pub(super) fn with_free_centre(&self) -> DMatrix<f64> {
        let mut covariance = self.covariance.clone();
        for place in self.centre().into_iter().flatten() {
            covariance[(place, place)] += unknown_centre_px(&self.before).powi(2);
        }
        covariance
    }
}

/// Sigmas that a calibration states.
#[derive(Debug, Default)]
struct Stated {
    order: Vec<Intrinsic>,
    rows: Vec<Vec<f64>>,
}

impl Stated {
    fn has(&self, which: Intrinsic) -> bool {
        self.order.contains(&which)
    }
    fn get(&self, one: Intrinsic, other: Intrinsic) -> f64 {
        let place = |which| self.order.iter().position(|i| *i == which);
        let value = || self.rows.get(place(one)?)?.get(place(other)?).copied();
        value().unwrap_or(0.0)
    }
    /// Adds a parameter that is not stated, with this sigma.
    fn require(&mut self, which: Intrinsic, sigma: f64) {
        if !self.has(which) {
            self.rows.iter_mut().for_each(|row| row.push(0.0));
            self.order.push(which);
            let mut row = vec![0.0; self.order.len()];
            if let Some(own) = row.last_mut() {
                *own = sigma * sigma;
            }
            self.rows.push(row);
        }
    }
}

/// Returns what `[camera.covariance]` or the two scalar sigmas state.
fn stated_covariance(config: &Config) -> Stated {
    if let Some(Covariance { order, rows }) = &config.covariance {
        return Stated { order: order.to_vec(), rows: rows.iter().map(|row| row.to_vec()).collect() };
    }
    let mut stated = Stated::default();
    let focal = config.focal_sigma_percent * 0.01;
    if focal > 0.0 {
        let sigmas = [focal * config.fx_px, focal * config.fy_px];
        stated.order = vec![Intrinsic::FxPx, Intrinsic::FyPx];
        stated.rows = sigmas.iter().map(|a| sigmas.iter().map(|b| a * b).collect()).collect();
    }
    if config.centre_sigma_px > 0.0 {
        stated.require(Intrinsic::CxPx, config.centre_sigma_px);
        stated.require(Intrinsic::CyPx, config.centre_sigma_px);
    }
    stated
}

/// Returns the covariance of parameters whose sigmas nobody states.
fn assumed_covariance(config: &Config, list: &[Intrinsic], aspect: f64) -> DMatrix<f64> {
    let mut covariance = DMatrix::zeros(list.len(), list.len());
    let focal = |i: Intrinsic| match i {
        Intrinsic::FxPx => UNKNOWN_FOCAL * config.fx_px,
        Intrinsic::FyPx => UNKNOWN_FOCAL * config.fy_px,
        _ => 0.0,
    };
    for (i, one) in list.iter().enumerate() {
        for (j, other) in list.iter().enumerate() {
            covariance[(i, j)] = focal(*one) * focal(*other);
        }
        let own = match one {
            Intrinsic::FxPx => 0.0,
            Intrinsic::FyPx => aspect * config.fy_px,
            Intrinsic::CxPx | Intrinsic::CyPx => unknown_centre_px(config),
            _ => UNKNOWN_K1,
        };
        covariance[(i, i)] += own * own;
    }
    covariance
}

/// Returns the 1-sigma of a principal point that nobody states, in pixels.
fn unknown_centre_px(config: &Config) -> f64 {
    UNKNOWN_CENTRE * f64::from(config.width.max(config.height))
}

/// Returns the unit in which the smallest sigma of a parameter is stated.
fn relative_unit(config: &Config, which: Intrinsic) -> f64 {
    match which {
        Intrinsic::FxPx | Intrinsic::CxPx => config.fx_px,
        Intrinsic::FyPx | Intrinsic::CyPx => config.fy_px,
        _ => 1.0,
    }
}
