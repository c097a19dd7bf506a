//! The adjustment of all epochs.

use core::fmt;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::epoch::Epoch;
use super::reduced::{OF_HEAD, Place, Reduced};
use crate::quantile::chi2;

/// Number of steps; a wrong mount of ten degrees needs six.
const STEPS: usize = 30;
/// Steps with all epochs, before those that contradict the others are left out.
const STEPS_WITH_ALL: usize = 8;
/// A step that is smaller ends the adjustment, radians.
const SMALLEST_STEP_RAD: f64 = 1e-10;
/// Smallest number of epochs with two heads.
pub(super) const FEWEST: usize = 5;
/// An epoch whose χ² is beyond this number of sigmas does not count. One of a thousand good ones is left out.
const LEFT_OUT_SIGMAS: f64 = 3.09;

/// Largest χ² for each degree of freedom: errors that are twice as large as told. Larger ones are no noise, and a sigma
/// that is widened for them means nothing.
const LARGEST_CHI2: f64 = 4.0;

/// The told mounts, and the sigmas that the adjustment begins with.
#[derive(Debug, Clone)]
pub struct Settings {
    /// The told rotation from each camera to the rig.
    pub told: Vec<Rotation3<f64>>,
    /// 1-sigma of each mount about each axis before the adjustment, radians.
    pub prior_rad: f64,
    /// 1-sigma of the limb height that each head has for itself in all pictures, kilometres.
    pub own_sigma_km: Vec<f64>,
    /// Distance of the limb from the centre of the body, kilometres.
    pub radius_km: f64,
    /// The number of independent epochs divided by that of the epochs: pictures that follow each other fast see the
    /// same weather of the limb.
    pub independent: f64,
}

/// The result of the adjustment. Rotations are about the axes of the rig, and the mean of all turns is zero.
#[derive(Debug, Clone)]
pub struct Adjusted {
    /// The rotation from each camera to the rig.
    pub mounts: Vec<Rotation3<f64>>,
    /// The turns of the told mounts, radians, relative to the first head.
    pub(super) turns: Vec<Vector3<f64>>,
    /// Their covariance, rad²; the rows of the first head are zero.
    pub(super) covariance: DMatrix<f64>,
    /// The height of each head's limb above the common one, and its 1-sigma, kilometres.
    pub heights_km: Vec<(f64, f64)>,
    /// Number of epochs that count, and of those that contradict them.
    pub epochs: [usize; 2],
    /// χ² for each degree of freedom.
    pub chi2: f64,
    prior_rad: f64,
}

/// Why there is no adjustment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// Too few epochs have answers of two heads.
    TooFew(usize),
    /// A head has no answer together with another one.
    Alone(usize),
    /// The steps do not end.
    NoConvergence,
    /// Most epochs contradict every mount near the told ones, or too few are left.
    Contradict {
        /// Number of epochs that agree with each other.
        used: usize,
        /// Number of epochs that contradict them.
        left_out: usize,
        /// The only head without which the others agree.
        head: Option<usize>,
    },
}

impl Refused {
    /// Returns the reason, with the names of the heads.
    pub fn describe(&self, names: &[&str]) -> String {
        let head = |k: usize| names.get(k).map_or_else(|| format!("head {}", k + 1), |name| (*name).to_owned());
        match self {
            Self::TooFew(epochs) => {
                format!("only {epochs} epochs have answers of two heads; at least {FEWEST} are needed")
            }
            Self::Alone(k) => format!("{} has no answer at an epoch at which another head has one", head(*k)),
            Self::NoConvergence => "the mounts do not converge: are they wrong by tens of degrees?".into(),
            Self::Contradict { used, left_out, head: wrong } => {
                let without = wrong.map(|k| format!("without {} the others agree; ", head(k))).unwrap_or_default();
                format!(
                    "the heads contradict each other ({left_out} epochs are left out, {used} count): {without}a mount \
                     is wrong by more than an adjustment finds, heads are exchanged, a picture is mirrored, or a clock \
                     is late"
                )
            }
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.describe(&[]))
    }
}

impl core::error::Error for Refused {}

/// Adjusts the mounts of the heads to the cones that they see together.
///
/// # Errors
/// See [`Refused`].
pub fn adjust(settings: &Settings, epochs: &[Epoch]) -> Result<Adjusted, Refused> {
    adjust_all(settings, epochs).map_err(|why| match why {
        Refused::Contradict { used, left_out, .. } => {
            Refused::Contradict { used, left_out, head: the_wrong_head(settings, epochs) }
        }
        Refused::NoConvergence => match the_wrong_head(settings, epochs) {
            Some(k) => Refused::Contradict { used: 0, left_out: epochs.len(), head: Some(k) },
            None => Refused::NoConvergence,
        },
        other => other,
    })
}

/// Returns the only head without which the others agree; `None` with two heads, which nothing tells apart.
fn the_wrong_head(settings: &Settings, epochs: &[Epoch]) -> Option<usize> {
    let heads = settings.told.len();
    let agree_without = |k: &usize| {
        let (mut told, mut own_sigma_km) = (settings.told.clone(), settings.own_sigma_km.clone());
        told.remove(*k);
        own_sigma_km.remove(*k);
        let others = epochs.iter().map(|epoch| {
            let mut epoch = epoch.clone();
            epoch.remove(*k);
            epoch
        });
        adjust_all(&Settings { told, own_sigma_km, ..settings.clone() }, &others.collect::<Vec<_>>()).is_ok()
    };
    let mut all = (0..heads).filter(|_| heads > 2).filter(agree_without);
    all.next().filter(|_| all.next().is_none())
}

fn adjust_all(settings: &Settings, epochs: &[Epoch]) -> Result<Adjusted, Refused> {
    let heads = settings.told.len();
    let together: Vec<&Epoch> = epochs.iter().filter(|epoch| epoch.iter().flatten().count() > 1).collect();
    if together.len() < FEWEST {
        return Err(Refused::TooFew(together.len()));
    }
    let is_seen = |k: &usize| together.iter().any(|epoch| epoch.get(*k).is_some_and(Option::is_some));
    if let Some(alone) = (0..heads).find(|k| !is_seen(k)) {
        return Err(Refused::Alone(alone));
    }
    let radius_km = settings.radius_km;
    let mut place = Place { mounts: settings.told.clone(), heights_km: vec![0.0; heads], radius_km };
    let mut counts = vec![true; together.len()];
    for step in 0..STEPS {
        let reduced: Vec<Option<Reduced>> = together.iter().map(|epoch| place.reduce(epoch)).collect();
        if step == STEPS_WITH_ALL {
            counts = find_counting(&reduced);
        }
        let sums = Sums::new(settings, &reduced, &counts, step < STEPS_WITH_ALL);
        let moved = sums.step(settings, &place).ok_or(Refused::NoConvergence)?;
        let largest = place.take(&moved);
        if step > STEPS_WITH_ALL && largest < SMALLEST_STEP_RAD {
            let reduced: Vec<Option<Reduced>> = together.iter().map(|epoch| place.reduce(epoch)).collect();
            let sums = Sums::new(settings, &reduced, &counts, false);
            let [used, left_out] = sums.epochs;
            // The median of the epochs sets the scale, so a good flight leaves far fewer than half of them out.
            if used < FEWEST || left_out > used || sums.ratio() > LARGEST_CHI2 {
                return Err(Refused::Contradict { used, left_out, head: None });
            }
            return sums.finish(settings, place).ok_or(Refused::NoConvergence);
        }
    }
    Err(Refused::NoConvergence)
}

/// Returns which epochs agree with the others. The scale of the errors is that of the median epoch, if it is larger
/// than the told one.
fn find_counting(reduced: &[Option<Reduced>]) -> Vec<bool> {
    let scale = scale(reduced);
    let is_good = |r: &Reduced| r.chi2 <= scale * chi2(r.freedom, LEFT_OUT_SIGMAS);
    reduced.iter().map(|r| r.as_ref().is_some_and(is_good)).collect()
}

/// Returns the median of χ² over its own median, at least 1.
fn scale(reduced: &[Option<Reduced>]) -> f64 {
    let mut ratios: Vec<f64> = reduced.iter().flatten().map(|r| r.chi2 / chi2(r.freedom, 0.0)).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(1.0).max(1.0)
}

/// The equations of all epochs.
struct Sums {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    chi2: f64,
    freedom: usize,
    epochs: [usize; 2],
}

impl Sums {
    /// Adds the epochs. With `soft`, an epoch that contradicts the others has a smaller weight (Huber 1964).
    fn new(settings: &Settings, reduced: &[Option<Reduced>], counts: &[bool], soft: bool) -> Self {
        let size = OF_HEAD * settings.told.len();
        let scale = scale(reduced);
        let mut sums = Self {
            normal: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
            chi2: 0.0,
            freedom: 0,
            epochs: [0, reduced.iter().zip(counts).filter(|(r, counts)| !**counts || r.is_none()).count()],
        };
        for r in reduced.iter().zip(counts).filter_map(|(r, counts)| r.as_ref().filter(|_| *counts)) {
            let limit = scale * chi2(r.freedom, LEFT_OUT_SIGMAS);
            let soft = if soft { (limit / r.chi2).sqrt().min(1.0) } else { 1.0 };
            let weight = soft * settings.independent;
            sums.normal += &r.normal * weight;
            sums.right += &r.right * weight;
            sums.chi2 += r.chi2;
            sums.freedom += r.freedom;
            sums.epochs[0] += 1;
        }
        sums
    }

    /// Returns the inverse of the equations with the priors, and the right side. Errors that are larger than told widen
    /// the covariance.
    fn solve(&self, settings: &Settings, place: &Place, scale: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let (mut normal, mut right) = (&self.normal / scale, &self.right / scale);
        for (k, (mount, told)) in place.mounts.iter().zip(&settings.told).enumerate() {
            let turn = (mount * told.inverse()).scaled_axis();
            // The first head is held, because a turn of all heads moves nothing.
            let sigma_rad = if k == 0 { 1e-9 } else { settings.prior_rad };
            for axis in 0..3 {
                let i = OF_HEAD * k + axis;
                normal[(i, i)] += sigma_rad.powi(-2);
                right[i] -= turn[axis] * sigma_rad.powi(-2);
            }
            let i = OF_HEAD * k + 3;
            // A height that is told exactly is nearly fixed.
            let sigma_km = settings.own_sigma_km.get(k).copied().unwrap_or_default().max(1e-3);
            normal[(i, i)] += sigma_km.powi(-2);
            right[i] -= place.heights_km[k] * sigma_km.powi(-2);
        }
        Some((normal.cholesky()?.inverse(), right))
    }

    /// Returns χ² for each degree of freedom.
    fn ratio(&self) -> f64 {
        self.chi2 / self.freedom.max(1) as f64
    }

    fn step(&self, settings: &Settings, place: &Place) -> Option<DVector<f64>> {
        let (inverse, right) = self.solve(settings, place, 1.0)?;
        Some(inverse * right)
    }

    fn finish(self, settings: &Settings, place: Place) -> Option<Adjusted> {
        let ratio = self.ratio();
        let (inverse, _) = self.solve(settings, &place, ratio.max(1.0))?;
        let heads = settings.told.len();
        let turn = |k: usize| (place.mounts[k] * settings.told[k].inverse()).scaled_axis();
        let turns: Vec<Vector3<f64>> = (0..heads).map(turn).collect();
        let index = |i: usize| OF_HEAD * (i / 3) + i % 3;
        let covariance = DMatrix::from_fn(3 * heads, 3 * heads, |i, j| match i < 3 || j < 3 {
            true => 0.0,
            false => inverse[(index(i), index(j))],
        });
        let mean = Rotation3::new(-turns.iter().sum::<Vector3<f64>>() / heads as f64);
        let height = |k: usize| (place.heights_km[k], inverse[(OF_HEAD * k + 3, OF_HEAD * k + 3)].sqrt());
        Some(Adjusted {
            mounts: place.mounts.iter().map(|mount| mean * mount).collect(),
            turns,
            covariance,
            heights_km: (0..heads).map(height).collect(),
            epochs: self.epochs,
            chi2: ratio,
            prior_rad: settings.prior_rad,
        })
    }
}

impl Place {
    /// Takes a step, and returns its largest rotation, radians.
    fn take(&mut self, step: &DVector<f64>) -> f64 {
        let mut largest: f64 = 0.0;
        for (k, (mount, height)) in self.mounts.iter_mut().zip(&mut self.heights_km).enumerate() {
            let turn = Vector3::from_fn(|axis, _| step[OF_HEAD * k + axis]);
            *mount = Rotation3::new(turn) * *mount;
            *height += step[OF_HEAD * k + 3];
            largest = largest.max(turn.norm());
        }
        largest
    }
}

impl Adjusted {
    /// Returns the covariance of a head's mount for a file that has a covariance for each head and none between heads:
    /// a small rotation about the axes of the rig, rad².
    ///
    /// The turns of all heads have the mean zero. For n equally known heads, this takes away the part 1/n of the
    /// variance of each and correlates them by −1/(n − 1). Without these correlations, n/(n − 1) times the variance
    /// gives the relative mounts the right one.
    pub fn block(&self, k: usize) -> Matrix3<f64> {
        let heads = self.mounts.len();
        let mut gain = DMatrix::zeros(3, 3 * heads);
        for j in 0..heads {
            let part = if j == k { 1.0 } else { 0.0 } - 1.0 / heads as f64;
            (0..3).for_each(|axis| gain[(axis, 3 * j + axis)] = part);
        }
        let block = &gain * &self.covariance * gain.transpose() * (heads as f64 / (heads - 1) as f64);
        Matrix3::from_fn(|i, j| 0.5 * (block[(i, j)] + block[(j, i)]))
    }

    /// Returns the turn of a head against its told mount, relative to another head, with its covariance: about the axes
    /// of the rig, radians.
    pub fn relative(&self, k: usize, to: usize) -> (Vector3<f64>, Matrix3<f64>) {
        let part = |i: usize, j: usize| self.covariance.fixed_view::<3, 3>(3 * i, 3 * j).into_owned();
        let covariance = part(k, k) + part(to, to) - part(k, to) - part(to, k);
        (self.turns[k] - self.turns[to], 0.5 * (covariance + covariance.transpose()))
    }

    /// Returns the principal axes of a head's mount relative to the first head (or of the first one relative to the
    /// second), about the axes of the rig: 1-sigma in radians, and whether the data determine it. They do if they
    /// halve the sigma of the prior.
    pub fn axes(&self, k: usize) -> [(Vector3<f64>, f64, bool); 3] {
        let (_, covariance) = self.relative(k, usize::from(k == 0));
        let eigen = covariance.symmetric_eigen();
        core::array::from_fn(|i| {
            let sigma_rad = eigen.eigenvalues[i].max(0.0).sqrt();
            (eigen.eigenvectors.column(i).into(), sigma_rad, self.is_determined(sigma_rad))
        })
    }

    /// Returns whether the data determine a turn with this 1-sigma.
    pub(super) fn is_determined(&self, sigma_rad: f64) -> bool {
        sigma_rad < 0.5 * self.prior_rad
    }
}
