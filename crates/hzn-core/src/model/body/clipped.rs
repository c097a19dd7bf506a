//! Clipping at full scale: an overexposed limb appears higher, and by how much changes along it.

use super::Expected;
use super::position::Target;
use crate::base::real::Real;

impl<T: Real> Expected<T> {
    /// Returns the expected cone for a limb of which the fraction `part`, 0 to 1, is clipped at full scale.
    ///
    /// Full scale cuts the light off at 1/B of its peak. The limb in the picture, at half of full scale, then lies
    /// h ln B higher than the limb at half of the peak, where h is the scale height of the air. B is unknown and varies
    /// along the limb. This variation counts as harmonics in azimuth, to which three sources contribute:
    ///
    /// - The difference between clipped and unclipped points has the variance `part` (1 − `part`) times the height
    ///   squared. The first and the second harmonic have half of it each.
    /// - If the heights at the two ends vary independently by σ each, half of their difference has the sigma σ/√2. This
    ///   is a first harmonic.
    /// - Air scatters the light of the Sun by 1 + cos² of the angle to it: twice as much towards the Sun and away from
    ///   it as across. The amplitude of this second harmonic is h ln 2/2.
    pub(crate) fn clipped(&self, part: T) -> Self {
        if self.free || !(part > T::zero()) {
            return *self;
        }
        let [height, sigma] = self.clipped_m.map(|h| h * part);
        let distance = (self.radius_m + self.limb_m) / self.sin;
        // The limit keeps cos α above 0 for a camera just above the limb, where a higher limb would enclose it.
        let sin = (self.sin + height / distance).min(T::one() - T::from_f64(1e-6));
        let cos = (T::one() - sin * sin).sqrt();
        // ∂cos/∂d = −tan/(R + H), as in `of_limb`.
        let scale = sin / (cos * distance);
        let [limb, altitude, radius, _] = self.limb_sigma_parts_m;
        let limb_sigma_parts_m = [limb, altitude, radius, sigma];
        let one = T::one();
        let apart = self.clipped_m[0] * (part * (one - part)).max(T::zero()).sqrt();
        let scattered = self.scale_height_m * part * T::from_f64(0.5 * core::f64::consts::LN_2);
        let root = |parts: &[T]| parts.iter().fold(T::zero(), |sum, s| sum + *s * *s).sqrt();
        let [first, second] = self.unknown_harmonics_cos;
        let target =
            self.target().map(|t| Target { raised_m: height, limb_sigma_m: root(&[t.limb_sigma_m, sigma]), ..*t });
        // Without a known distance there is no expected half-angle that a higher limb could change.
        if target.is_some_and(|target| target.range.is_none()) {
            return Self { target, ..*self };
        }
        let mut clipped = Self {
            target,
            cos,
            sin,
            sigma_cos: scale * root(&limb_sigma_parts_m),
            limb_sigma_parts_m,
            ellipsoid: self.ellipsoid_at(cos, sin),
            unknown_harmonics_cos: [
                root(&[first, scale * apart, scale * sigma * T::from_f64(core::f64::consts::FRAC_1_SQRT_2)]),
                root(&[second, scale * apart, scale * scattered]),
            ],
            limb_m: self.limb_m + height,
            limb_sigma_m: root(&[self.limb_sigma_m, sigma]),
            ..*self
        };
        clipped.is_curved = clipped.bends();
        clipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Config, Kind, Prior};

    #[test]
    fn a_clipped_limb_is_expected_higher_and_less_surely() {
        let at = |km: f64, sigma_km: f64, kind| {
            let body = Config { limb_height_km: km, limb_height_sigma_km: sigma_km, kind, ..Config::default() };
            Expected::<f64>::new(&body, &Prior { altitude_m: Some(400e3), ..Prior::default() }).unwrap()
        };
        let told = at(17.0, 7.0, Kind::EarthSphere);
        for part in [0.0, 0.3, 1.0] {
            let higher = at(17.0 + 7.8 * part, libm::hypot(7.0, 4.5 * part), Kind::EarthSphere);
            let clipped = told.clipped(part);
            let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-5;
            assert!(same(clipped.cos, higher.cos) && same(clipped.sin, higher.sin), "{part}");
            assert!(same(clipped.sigma_cos, higher.sigma_cos) && same(clipped.limb_m, higher.limb_m), "{part}");
            // In kilometres of height: 7.8 √(p (1 − p)) in both, σ/√2 in the first, and 7.5 ln 2/2 in the second.
            let by_km = 1e3 * higher.sin / (higher.cos * (6371008.8 + higher.limb_m) / higher.sin);
            let apart_km = 7.8 * f64::sqrt(part * (1.0 - part));
            let first_km = libm::hypot(apart_km, 4.5 * part / core::f64::consts::SQRT_2);
            let second_km = libm::hypot(apart_km, 7.5 * part * core::f64::consts::LN_2 / 2.0);
            for (found, km) in clipped.unknown_harmonics_cos.into_iter().zip([first_km, second_km]) {
                assert!((found / by_km - km).abs() < 0.01, "{part}: {} {km}", found / by_km);
            }
        }
        // No apparent size of the Moon is expected, so clipping changes nothing.
        let moon = at(0.0, 0.0, Kind::Moon);
        assert_eq!(moon.clipped(1.0).cos, moon.cos);
    }
}
