//! A flight with drawn errors.

mod draws;

pub(crate) use draws::Draws;

use hzn_fuse::input::Inputs;
use hzn_fuse::simulated::{Errors, Moment, inputs};
use hzn_nav::frames::{Cam, Covariance, Vector};
use hzn_sim::Scenario;

/// Slow errors of limb and Sun with a time constant of 20 s, and a small white part that the sensor does not tell.
pub(crate) struct Slow {
    pub(crate) draws: Draws,
    /// 1-sigma of the slow error, rad.
    pub(crate) sigma_rad: f64,
    /// 1-sigma of white noise that the sensor tells, rad. With 0 it does not tell what is common.
    pub(crate) white_rad: f64,
    last: Vec<(Moment, Vector<Cam>)>,
}

impl Slow {
    pub(crate) fn new(seed: u64, sigma_deg: f64) -> Self {
        Self { draws: Draws(seed), sigma_rad: sigma_deg.to_radians(), white_rad: 0.0, last: Vec::new() }
    }

    fn three(&mut self, sigma: f64) -> Vector<Cam> {
        core::array::from_fn(|_| sigma * self.draws.normal()).into()
    }
}

impl Errors for Slow {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let sigma = self.sigma_rad;
        let place = self.last.iter().position(|(m, _)| (m.camera, m.body) == (at.camera, at.body));
        let error = match place.map(|i| self.last.swap_remove(i)) {
            Some((before, error)) => {
                let keep = (-(at.time_s - before.time_s) / 20.0).exp();
                error * keep + self.three(sigma * (1.0 - keep * keep).sqrt())
            }
            None => self.three(sigma),
        };
        self.last.push((*at, error));
        let white = self.white_rad;
        let covariance = Covariance::across(axis, sigma.powi(2) + white.powi(2));
        (error + self.three(white.hypot(2e-4)), covariance)
    }

    fn common(&mut self, _: &Moment, axis: &Vector<Cam>) -> Option<Covariance<Cam>> {
        (self.white_rad > 0.0).then(|| Covariance::across(axis, self.sigma_rad.powi(2)))
    }

    fn by_limb_height(&mut self, _: &Moment, axis: &Vector<Cam>) -> Vector<Cam> {
        // The limb pulls the axis towards the boresight, by about 0.02 degrees per km.
        let [_, _, z] = axis.xyz();
        (Vector::new(0.0, 0.0, 1.0) - *axis * z).normalize() * 3e-4
    }
}

/// Returns a number of flights: that of the variable `HZN_FLIGHTS`, or `all` with `cargo xtask test --all`, or `few`.
pub(crate) fn flights(few: u64, all: u64) -> u64 {
    let default = if std::env::var_os("HZN_ALL").is_some() { all } else { few };
    std::env::var("HZN_FLIGHTS").map_or(default, |n| n.parse().expect("HZN_FLIGHTS is a number"))
}

/// The scene `atek` with another seed, and pictures every two seconds.
pub(crate) fn scene(seed: u64) -> Scenario {
    let mut scene = Scenario::builtin("atek").unwrap();
    scene.seed = seed;
    scene.capture.frames = 186;
    scene
}

/// The inputs of a flight; its cameras are told a limb height that is 0.5 km too low.
pub(crate) fn flight(scene: &Scenario) -> Inputs {
    inputs(scene, &mut Slow::new(scene.seed, 0.1), 0.5).unwrap()
}
