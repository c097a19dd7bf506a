//! Fits lens and limb height to the pictures of a flight: Gauss-Newton steps, each linearised anew.

use hzn_core::body;
use hzn_core::camera::{Camera, Config};
use nalgebra::{DMatrix, DVector};

use super::layout::{LATITUDE, Layout};
use super::linear::{self, EdgeNoise, Model, Reduced};
use super::refusal::Refusal;
use super::system::{self, PriorEquations, Solution};
use super::unknowns::Unknowns;
use super::view::View;
use crate::limb_prior::{LimbPrior, unmeasured};
use crate::noise::bend::common_bend_px;
use crate::noise::sighting::Geometry;
use crate::noise::slow;

/// Smallest number of pictures from which the scatter of the limb height is measured. With fewer pictures it is not
/// known to a quarter, and the 1-sigma of the limb height stands for it.
pub const MIN_PICTURES: usize = 12;
/// Largest number of Gauss-Newton steps.
const STEPS: usize = 12;
/// The edge noise is measured anew during these first steps, because errors of the lens add to the residuals.
const NOISE_STEPS: usize = 4;
/// A fit has converged if no unknown moves by more than this fraction of its sigma.
const CONVERGED: f64 = 0.02;
/// Number of halvings of a step that leaves the limits of the lens or of the limb.
const HALVINGS: usize = 8;
/// Sigma of a limb height that is not known, in kilometres: far larger than any limb height.
const FREE_KM: f64 = 1e3;
/// Floor of the common shift of an edge, in pixels. Blur and threshold move the middle of an edge by fractions of a
/// pixel, even if the edge is smooth.
const MIN_SHIFT_PX: f64 = 0.1;
/// Smallest common bend of the edges of a side, as a part of their shift. It is an assumption: what shifts all edges
/// may change along them by a fifth, and not be visible in the residuals. With it no true lens raised the alarm in
/// `cargo xtask campaign check 100`.
const MIN_BEND: f64 = 0.2;
/// Largest distance of a picture's limb height from the fitted one, in sigmas. A picture farther away has another edge.
const MAX_DEVIATION_SIGMAS: f64 = 6.0;
/// Largest fraction of such pictures.
const MAX_INCONSISTENT: f64 = 0.2;

/// One picture of a fit.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    /// Its place in the list of views.
    pub(super) view: usize,
    geometry: Geometry,
    /// Change of its limb height by each coefficient of the latitude; the mean over all pictures is 0.
    latitude: [f64; LATITUDE],
    noise: EdgeNoise,
    pub(super) reduced: Reduced,
    /// Limb height of this picture with the fitted lens, and its 1-sigma from edge noise, in kilometres.
    pub(super) height_km: [f64; 2],
    pub(super) counts: bool,
}

/// A fit that has converged.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) layout: Layout,
    pub(super) pictures: Vec<Fitted>,
    pub(super) solution: Solution,
    /// The limb height with its prior, in kilometres.
    pub(super) limb: LimbPrior,
    /// 1-sigma of the limb height that is assumed for the body without a measurement, in kilometres.
    air_km: f64,
    /// Sigmas of the common shapes, in pixels.
    pub(super) common_px: Vec<f64>,
    /// RMS distance of the edge points from the principal point, in pixels.
    distance_px: f64,
}

impl Fit {
    /// Fits the unknowns to the views.
    ///
    /// # Errors
    /// The pictures are too few, or the fit does not converge: see [`Refusal`].
    pub(super) fn new(
        unknowns: &Unknowns,
        body: &body::Config,
        views: &[View],
        limb: LimbPrior,
    ) -> Result<Self, Refusal> {
        let mut state = State::new(unknowns, body, views, limb)?;
        for step in 0..STEPS {
            if step > 0 && step < NOISE_STEPS {
                state.measure_noise(unknowns, views);
            }
            let fit = state.solve(unknowns)?;
            let moved = state.advance(unknowns, views, &fit)?;
            if step + 1 >= NOISE_STEPS && moved < CONVERGED {
                return state.solve(unknowns);
            }
        }
        Err(Refusal::NotConverged { steps: STEPS })
    }

    /// Solves the same pictures with another prior of the intrinsic parameters and of the limb height, and with the
    /// scatter of this fit.
    pub(super) fn solve_again(&self, lens: &DMatrix<f64>, limb: LimbPrior) -> Option<Solution> {
        let prior = prior_equations(self.layout, lens, limb, self.air_km, &self.common_px)?;
        system::solve(&self.counted(), &prior, self.solution.scatter_km)
    }

    /// Returns the covariance that the errors have in common which edges have in every picture: threshold and blur move
    /// an edge by fractions of a pixel, in a way that depends on its direction and on its place in the picture. A shift
    /// of 0.1 px moves the principal point, and a stretch of 0.1 px at the distance of the edges scales the picture.
    pub(super) fn systematic(&self, unknowns: &Unknowns) -> DMatrix<f64> {
        let part = MIN_SHIFT_PX / self.distance_px.max(1.0);
        let stretch = unknowns.scale_direction() * part;
        let mut covariance = &stretch * stretch.transpose();
        for place in unknowns.centre().into_iter().flatten() {
            covariance[(place, place)] += MIN_SHIFT_PX * MIN_SHIFT_PX;
        }
        covariance
    }

    /// Returns the RMS residual of the pictures that count, in pixels.
    pub(super) fn rms_px(&self) -> f64 {
        let counted: Vec<f64> = self.pictures.iter().filter(|p| p.counts).map(|p| p.noise.rms_px.powi(2)).collect();
        (counted.iter().sum::<f64>() / counted.len().max(1) as f64).sqrt()
    }

    /// Returns the pictures that count.
    pub(super) fn counted(&self) -> Vec<&Reduced> {
        self.pictures.iter().filter(|p| p.counts).map(|p| &p.reduced).collect()
    }

    /// Returns the changes of the intrinsic parameters.
    pub(super) fn changes(&self) -> DVector<f64> {
        self.solution.values.rows(self.layout.first_intrinsic(), self.layout.intrinsics).into_owned()
    }
}

/// The state between two steps.
struct State {
    layout: Layout,
    limb: LimbPrior,
    air_km: f64,
    changes: DVector<f64>,
    height_km: f64,
    pictures: Vec<Fitted>,
    distance_px: f64,
}

impl State {
    fn new(unknowns: &Unknowns, body: &body::Config, views: &[View], limb: LimbPrior) -> Result<Self, Refusal> {
        let camera = Camera::try_new(&unknowns.before).map_err(|why| Refusal::Lens { why: why.to_string() })?;
        let changes = DVector::zeros(unknowns.list.len());
        let height_km = limb.km;
        let model = Model::new(&camera, &unknowns.before, unknowns, changes.clone(), height_km);
        let measured = views.iter().enumerate().filter_map(|(view, of)| {
            let geometry = linear::geometry(body, of)?;
            let noise = linear::measure_noise(&model, &geometry, of)?;
            Some((view, of, geometry, noise))
        });
        let measured: Vec<_> = measured.collect();
        let by_latitude = by_latitude(measured.iter().map(|(_, _, geometry, _)| geometry));
        let pictures = measured.into_iter().zip(by_latitude).filter_map(|((view, of, geometry, noise), latitude)| {
            let reduced = linear::reduce(&model, &geometry, latitude, of, noise)?;
            Some(Fitted { view, geometry, latitude, noise, reduced, height_km: [f64::NAN; 2], counts: true })
        });
        let pictures: Vec<Fitted> = pictures.collect();
        if pictures.is_empty() || (pictures.len() < MIN_PICTURES && !limb.sigma_km.is_finite()) {
            return Err(Refusal::TooFew { answered: pictures.len(), min_pictures: MIN_PICTURES });
        }
        let used = pictures.iter().filter_map(|p| views.get(p.view));
        let distance_px = distance_px(&unknowns.before, used);
        let air_km = unmeasured(body)[1];
        Ok(Self { layout: model.layout, limb, air_km, changes, height_km, pictures, distance_px })
    }

    fn solve(&mut self, unknowns: &Unknowns) -> Result<Fit, Refusal> {
        let counted: Vec<&Fitted> = self.pictures.iter().filter(|p| p.counts).collect();
        let common_px = common_sigmas_px(self.layout, &counted);
        let prior = prior_equations(self.layout, &unknowns.covariance, self.limb, self.air_km, &common_px);
        let reduced: Vec<&Reduced> = counted.iter().map(|p| &p.reduced).collect();
        let solved = prior.and_then(|prior| {
            if reduced.len() < MIN_PICTURES {
                system::solve(&reduced, &prior, 0.0)
            } else {
                system::solve_with_scatter(&reduced, &prior)
            }
        });
        let solution = solved.ok_or(Refusal::Singular)?;
        self.find_heights(&solution);
        Ok(Fit {
            layout: self.layout,
            pictures: self.pictures.clone(),
            solution,
            limb: self.limb,
            air_km: self.air_km,
            common_px,
            distance_px: self.distance_px,
        })
    }

    /// Computes the limb height of each picture with the fitted lens.
    fn find_heights(&mut self, solution: &Solution) {
        for picture in &mut self.pictures {
            let (n, b) = (&picture.reduced.information, &picture.reduced.right);
            let own = n[(Layout::HEIGHT, Layout::HEIGHT)];
            let others = n.row(Layout::HEIGHT).transpose().dot(&solution.values) - own * solution.values[0];
            picture.height_km = [(b[Layout::HEIGHT] - others) / own, 1.0 / own.sqrt()];
        }
    }

    /// Moves to the solution and linearises the pictures there. Returns the largest move in sigmas.
    fn advance(&mut self, unknowns: &Unknowns, views: &[View], fit: &Fit) -> Result<f64, Refusal> {
        let (from, from_km) = (self.changes.clone(), self.height_km);
        let target = fit.changes();
        let target_km = fit.solution.values[Layout::HEIGHT];
        let mut part = 1.0;
        for _ in 0..HALVINGS {
            self.changes = &from + (&target - &from) * part;
            self.height_km = from_km + (target_km - from_km) * part;
            if self.linearise(unknowns, views) {
                self.exclude_inconsistent(&fit.solution)?;
                let sigma = |place: usize| fit.solution.covariance[(place, place)].sqrt();
                let lens = (0..target.len()).map(|i| (target[i] - from[i]).abs() / sigma(1 + i));
                return Ok(lens.fold((target_km - from_km).abs() / sigma(Layout::HEIGHT), f64::max));
            }
            part *= 0.5;
        }
        Err(Refusal::NotConverged { steps: STEPS })
    }

    /// Linearises all pictures at the state. Returns `false` if the lens or the limb height is outside its limits.
    fn linearise(&mut self, unknowns: &Unknowns, views: &[View]) -> bool {
        let config = unknowns.changed_by(self.changes.as_slice());
        let Ok(camera) = Camera::try_new(&config) else { return false };
        let model = Model::new(&camera, &config, unknowns, self.changes.clone(), self.height_km);
        let each = self.pictures.iter().map(|picture| {
            views
                .get(picture.view)
                .and_then(|view| linear::reduce(&model, &picture.geometry, picture.latitude, view, picture.noise))
        });
        let Some(reduced) = each.collect::<Option<Vec<_>>>() else { return false };
        for (picture, reduced) in self.pictures.iter_mut().zip(reduced) {
            picture.reduced = reduced;
        }
        true
    }

    /// Measures the edge noise again, with the lens of the state.
    fn measure_noise(&mut self, unknowns: &Unknowns, views: &[View]) {
        let config = unknowns.changed_by(self.changes.as_slice());
        let Ok(camera) = Camera::try_new(&config) else { return };
        let model = Model::new(&camera, &config, unknowns, self.changes.clone(), self.height_km);
        for picture in &mut self.pictures {
            let Some(view) = views.get(picture.view) else { continue };
            if let Some(noise) = linear::measure_noise(&model, &picture.geometry, view) {
                picture.noise = noise;
            }
        }
        self.linearise(unknowns, views);
    }

    /// Marks the pictures whose limb height disagrees with the fitted one.
    fn exclude_inconsistent(&mut self, solution: &Solution) -> Result<(), Refusal> {
        self.find_heights(solution);
        let median = |values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let middle = median(&mut self.pictures.iter().map(|p| p.height_km[0]).collect());
        let typical = 1.4826 * median(&mut self.pictures.iter().map(|p| (p.height_km[0] - middle).abs()).collect());
        for picture in &mut self.pictures {
            let [km, sigma] = picture.height_km;
            picture.counts = (km - middle).abs() <= MAX_DEVIATION_SIGMAS * typical.hypot(sigma).max(0.1);
        }
        let inconsistent = self.pictures.iter().filter(|p| !p.counts).count();
        if inconsistent as f64 > MAX_INCONSISTENT * self.pictures.len() as f64 {
            return Err(Refusal::Inconsistent { inconsistent, pictures: self.pictures.len() });
        }
        Ok(())
    }
}

/// Returns the RMS distance of the edge points from the principal point, in pixels.
fn distance_px<'a>(lens: &Config, views: impl Iterator<Item = &'a View>) -> f64 {
    let (mut square, mut total) = (0.0, 0.0);
    for ([u, v], weight) in views.flat_map(|view| &view.points) {
        square += weight * ((u - lens.cx_px).powi(2) + (v - lens.cy_px).powi(2));
        total += weight;
    }
    (square / f64::max(total, 1e-12)).sqrt()
}

/// Returns the change of each picture's limb height by the coefficients of the latitude, without their means: the limb
/// height is that of the middle of the flight. It is 0 for a picture without a position.
fn by_latitude<'a>(pictures: impl Iterator<Item = &'a Geometry>) -> Vec<[f64; LATITUDE]> {
    let each: Vec<_> = pictures.map(Geometry::limb_by_latitude).collect();
    let known = each.iter().flatten().count().max(1) as f64;
    let mean: [f64; LATITUDE] =
        core::array::from_fn(|i| each.iter().flatten().map(|terms| terms[i]).sum::<f64>() / known);
    each.iter()
        .map(|terms| terms.map_or([0.0; LATITUDE], |terms| core::array::from_fn(|i| terms[i] - mean[i])))
        .collect()
}

/// Returns the sigmas of the common shapes: for the shift the RMS of the residuals, for all others the common bend of
/// their side ([`common_bend_px`]).
fn common_sigmas_px(layout: Layout, pictures: &[&Fitted]) -> Vec<f64> {
    let n = pictures.len().max(1) as f64;
    let rms_of = |px: &dyn Fn(&Fitted) -> f64| (pictures.iter().map(|p| px(p).powi(2)).sum::<f64>() / n).sqrt();
    let rms_px = rms_of(&|p| p.noise.rms_px);
    let common_px = slow::sigma_px(pictures.iter().map(|p| p.noise.slow_px2), rms_px).max(MIN_SHIFT_PX);
    let mut sigmas = vec![f64::NAN; layout.common()];
    for side in 0..layout.sides {
        let of_side: Vec<_> = pictures.iter().filter(|p| layout.sides == 1 || p.reduced.side == side).collect();
        let bend = common_bend_px(of_side.iter().map(|p| &p.noise.shapes_px), MIN_BEND * common_px);
        layout.shapes(side).iter().for_each(|place| sigmas[place - layout.first_common()] = bend);
    }
    sigmas[0] = rms_px.max(MIN_SHIFT_PX);
    sigmas
}

/// Returns the prior of all unknowns; `None` if the covariance of the lens is singular.
///
/// The sigma of the limb height is that of a picture at any latitude, so that the coefficients of the latitude have it,
/// too. If the height is free, they have that of the body's air, `air_km`: air differs over the latitude by no more.
fn prior_equations(
    layout: Layout,
    lens: &DMatrix<f64>,
    limb: LimbPrior,
    air_km: f64,
    common_px: &[f64],
) -> Option<PriorEquations> {
    let mut prior = PriorEquations::new(layout.len());
    let sigma = limb.sigma_km.clamp(1e-6, FREE_KM);
    prior.add(Layout::HEIGHT, &DVector::from_element(1, limb.km), &DMatrix::from_element(1, 1, sigma * sigma))?;
    prior.add(layout.first_intrinsic(), &DVector::zeros(layout.intrinsics), lens)?;
    for (i, sigma) in common_px.iter().enumerate() {
        prior.add_zero(layout.first_common() + i, *sigma);
    }
    prior.add_zero(layout.radius(), 1.0);
    let of_latitude = if limb.sigma_km.is_finite() { sigma } else { air_km.max(1e-6) };
    (0..LATITUDE).for_each(|i| prior.add_zero(layout.latitude() + i, of_latitude));
    Some(prior)
}
