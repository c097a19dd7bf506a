//! Heads that should have seen the limb of the answer, and have none.
//!
//! N heads have N chances of a false answer. If the edge of one head is the limb, the others should see this limb,
//! too. A head in whose picture it should lie, and that has no answer, is therefore evidence against the answer: by
//! Bayes' rule it multiplies the odds of the limb by the ratio of the probabilities of such a picture with and without
//! the limb.

use core::f64::consts::TAU;

use super::coarse::{Light, SURELY_LIT};
use super::epoch::EpochAnswer;
use super::mount::Mount;
use crate::base::linalg::{V3, basis};
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, UnitVec3, Vehicle};
use crate::geometry::pixel::ImagePoint;
use crate::image::region::Region;

/// Number of azimuths at which the limb is looked for.
const AZIMUTHS: i32 = 90;

/// Shortest part of the limb that a head surely answers to, five azimuths or 20 degrees: on a shorter arc the gates
/// refuse many limbs.
const FEWEST: i32 = 5;

/// What a head without an answer leaves of the odds. Of the epochs of two visible heads, with clouds, the Sun and its
/// ghosts in view, 9 % have a head without an answer (`pair` in the guide to several heads). Without a limb, nearly all
/// pictures have no answer.
const LEFT: f64 = 0.1;

/// A head that has a picture and no answer.
#[derive(Debug, Clone, Copy)]
pub struct Unanswered<'a, T> {
    /// The camera of the head.
    pub camera: &'a Camera<T>,
    /// The part of the picture in which the head looks.
    pub region: &'a Region<T>,
    /// Its attitude on the vehicle.
    pub mount: &'a Mount<T>,
}

impl<T: Real> EpochAnswer<T> {
    /// Lowers [`p_limb`](Self::p_limb) for each head that should see the limb of the answer and has none.
    ///
    /// The limb counts where it lies in the picture and outside of its masks, and where the body is lit. Without the
    /// direction to the Sun, a body in sunlight may be dark, so nothing is expected. A head that has the Sun in its
    /// picture may be blinded: it does not count either.
    pub fn doubted_by<'a>(mut self, heads: impl IntoIterator<Item = Unanswered<'a, T>>, light: &Light<T>) -> Self {
        let count = heads.into_iter().filter(|head| head.should_answer(&self.axis, self.half_angle_rad, light)).count();
        let left = (0..count).fold(T::one(), |left, _| left * T::from_f64(LEFT));
        // With the odds p/(1 − p) times `left`.
        self.p_limb = self.p_limb.map(|p| p * left / (p * left + (T::one() - p)));
        self
    }
}

impl<T: Real> Unanswered<'_, T> {
    fn should_answer(&self, axis: &UnitVec3<Vehicle, T>, half_angle_rad: T, light: &Light<T>) -> bool {
        let Some(turn) = self.mount.after(T::ZERO, None).map(|turn| turn.inverse()) else { return false };
        let e = *turn.apply(axis).v();
        let sun = match light {
            Light::Own => None,
            Light::Sun(None) => return false,
            Light::Sun(Some(sun)) => Some(turn.apply(sun)),
        };
        if sun.is_some_and(|sun| self.sees(&sun)) {
            return false;
        }
        let (b1, b2) = basis(&e);
        let (sin, cos) = half_angle_rad.sin_cos();
        let is_good = |i: &i32| {
            let (s, c) = (T::from_i32(*i) * T::from_f64(TAU / f64::from(AZIMUTHS))).sin_cos();
            let across: V3<T> = b1 * c + b2 * s;
            // The normal of the body where the ray touches it.
            let normal = across * cos - e * sin;
            let is_lit = sun.is_none_or(|sun| normal.dot(sun.v()) > T::from_f64(SURELY_LIT));
            is_lit && self.sees(&UnitVec3::assume_unit(e * cos + across * sin))
        };
        (0..AZIMUTHS).filter(is_good).count() as i32 >= FEWEST
    }

    /// Returns whether a direction lies in the picture, and outside of its masks.
    fn sees(&self, direction: &UnitVec3<Cam, T>) -> bool {
        let Some(ImagePoint { u, v }) = self.camera.project(direction) else { return false };
        let half = T::from_f64(0.5);
        let pixel = |x: T| u16::try_from((x + half).max(-T::one()).to_i32()).ok();
        let is_in = |x: T| x >= -half;
        let Some((x, y)) = pixel(u).zip(pixel(v)).filter(|_| is_in(u) && is_in(v)) else { return false };
        self.region.contains(x, y) && !self.region.masked(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{Config, Model};
    use crate::geometry::frames::Cov3;

    /// Half-angle of the limb from 500 km.
    const HALF_ANGLE_RAD: f64 = 1.19;

    fn answer(p_limb: Option<f64>) -> EpochAnswer<f64> {
        EpochAnswer {
            axis: UnitVec3::try_new([0.0, 0.0, 1.0]).unwrap(),
            covariance: Cov3::from_upper([0.0; 6]),
            common: None,
            p_limb,
            half_angle_rad: HALF_ANGLE_RAD,
            cos_sigma: None,
            heads_used: 1,
            heads_excluded: 0,
            separation_rad: None,
            protection_rad: None,
        }
    }

    /// Returns the probability after a head that looks `down_rad` from the direction z towards x has no answer.
    fn after(down_rad: f64, region: &Region<f64>, light: &Light<f64>) -> f64 {
        let camera = Camera::try_new(&Config::ideal(Model::Pinhole, 640, 480, 500.0)).unwrap();
        let half = 0.5 * down_rad;
        let mount = Mount::new([1.0, 0.0, 0.0, 0.0], [half.cos(), 0.0, half.sin(), 0.0], &[0.0; 6]).unwrap();
        let head = Unanswered { camera: &camera, region, mount: &mount };
        answer(Some(0.99)).doubted_by([head], light).p_limb.unwrap()
    }

    fn sun(x: f64, z: f64) -> Light<f64> {
        Light::Sun(Some(UnitVec3::try_new([x, 0.0, z]).unwrap()))
    }

    #[test]
    fn a_head_that_looks_at_the_limb_and_has_no_answer_is_evidence_against_it() {
        let whole = Region::whole(640, 480);
        let doubted = after(HALF_ANGLE_RAD, &whole, &Light::Own);
        assert!((doubted - 0.908_256_880_733_944_9).abs() < 1e-12, "odds of 99 are left as 9.9: {doubted}");
        // The head looks to the sky, or to the ground.
        assert_eq!(after(3.0, &whole, &Light::Own), 0.99);
        assert_eq!(after(0.0, &whole, &Light::Own), 0.99);
        assert_eq!(answer(None).doubted_by([], &Light::Own).p_limb, None);
    }

    #[test]
    fn a_dark_limb_a_masked_one_and_a_blinded_head_say_nothing() {
        let whole = Region::whole(640, 480);
        // The Sun is high where the head looks, and behind it.
        assert!(after(HALF_ANGLE_RAD, &whole, &sun(0.3, -1.0)) < 0.95);
        assert_eq!(after(HALF_ANGLE_RAD, &whole, &sun(0.0, 1.0)), 0.99, "night");
        assert_eq!(after(HALF_ANGLE_RAD, &whole, &Light::Sun(None)), 0.99, "the Sun is not known");
        assert_eq!(after(HALF_ANGLE_RAD, &whole, &sun(1.0, 0.2)), 0.99, "the Sun is in the picture");
        let small = Region::whole(40, 40);
        assert_eq!(after(HALF_ANGLE_RAD, &small, &Light::Own), 0.99, "the head looks only into a corner");
    }
}
