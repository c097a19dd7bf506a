//! The lens at the temperature of one picture.

use super::Camera;
use super::config::Config;
use super::intrinsic::INTRINSICS;
use super::temperature::MAX_CHANGE;
use crate::base::error::{ConfigError, Limit, require};
use crate::base::real::Real;

impl Config {
    /// Returns the calibration at a temperature of the camera, °C, as `[camera.temperature]` says; the result has no
    /// such section. Without the section nothing changes.
    #[must_use]
    pub fn at_temperature(&self, temperature_c: f64) -> Self {
        let Some(lens) = self.temperature else { return self.clone() };
        let (factor, [cx, cy]) = lens.change(temperature_c);
        Self {
            fx_px: self.fx_px * factor,
            fy_px: self.fy_px * factor,
            cx_px: self.cx_px + cx,
            cy_px: self.cy_px + cy,
            temperature: None,
            ..self.clone()
        }
    }

    pub(super) fn check_temperature(&self) -> Result<(), ConfigError> {
        let Some(lens) = self.temperature else { return Ok(()) };
        lens.check()?;
        // The sigma is a mode of its own, next to one mode for each row of the covariance.
        let is_full = self.covariance.as_ref().is_some_and(|given| given.order.len() >= INTRINSICS);
        let rule = "cannot be next to a covariance of nine parameters; add its part to that covariance";
        let is_possible = !(is_full && lens.untold_sigma_k > 0.0);
        require(is_possible, "camera.temperature.untold_sigma_k", lens.untold_sigma_k, Limit::Rule(rule))
    }
}

impl<T: Real> Camera<T> {
    /// Returns this camera at the temperature of one picture, °C. Without a temperature, or without
    /// `[camera.temperature]`, the lens stays as it is. A temperature must be one that [`Self::accepts_temperature`].
    #[must_use]
    pub fn with_temperature(mut self, temperature_c: Option<T>) -> Self {
        let (Some(lens), Some(temperature)) = (self.temperature, temperature_c) else { return self };
        // The change is computed in f64, as that of a configuration, so that both give the same lens.
        let (factor, [cx, cy]) = lens.change(temperature.to_f64());
        let [fx, fy] = [self.fx, self.fy].map(|f| f.to_f64() * factor);
        (self.fx, self.fy) = (T::from_f64(fx), T::from_f64(fy));
        (self.inv_fx, self.inv_fy) = (T::from_f64(1.0 / fx), T::from_f64(1.0 / fy));
        (self.cx, self.cy) = (T::from_f64(self.cx.to_f64() + cx), T::from_f64(self.cy.to_f64() + cy));
        if lens.untold_sigma_k > 0.0 {
            // The last mode is that of an unknown temperature.
            let _ = self.modes.pop();
        }
        self.temperature = None;
        self
    }

    /// Returns whether the lens can have this temperature, °C: a finite number, at which the focal lengths change by at
    /// most 1 %, and the principal point by at most 1 % of the focal length.
    pub fn accepts_temperature(&self, temperature_c: T) -> bool {
        let Some(lens) = self.temperature else { return temperature_c.is_finite() };
        let (factor, [cx, cy]) = lens.change(temperature_c.to_f64());
        let relative = [factor - 1.0, cx / self.fx.to_f64(), cy / self.fy.to_f64()];
        // The comparison refuses NaN.
        temperature_c.is_finite() && relative.iter().all(|change| change.abs() <= MAX_CHANGE)
    }

    /// Returns whether the lens changes with the temperature.
    pub(crate) fn has_temperature(&self) -> bool {
        self.temperature.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{Model, Temperature};
    use crate::geometry::pixel::ImagePoint;

    /// A lens with an image circle; all of its numbers are exact in single precision.
    fn lens() -> Config {
        let k = heapless::Vec::from_slice(&[-0.055, 0.011]).unwrap();
        let of_temperature = Temperature {
            reference_c: 20.0,
            focal_ppm_per_k: 31.0,
            cx_px_per_k: 0.02,
            cy_px_per_k: -0.01,
            untold_sigma_k: 8.0,
        };
        let ideal = Config::ideal(Model::KannalaBrandt, 640, 480, 250.0);
        Config { k, theta_max_deg: Some(50.0), temperature: Some(of_temperature), ..ideal }
    }

    /// Fails unless the camera at -17.25 °C is that of the changed configuration, to the last bit.
    fn is_the_changed_lens<T: Real>() {
        let config = lens();
        let camera = Camera::<T>::try_new(&config).unwrap();
        let told = camera.clone().with_temperature(Some(T::from_f64(-17.25)));
        let changed = config.at_temperature(-17.25);
        assert!((changed.fx_px - 250.0 * (1.0 - 37.25 * 31e-6)).abs() < 1e-12);
        assert!((changed.cx_px - 318.755).abs() < 1e-12 && (changed.cy_px - 239.8725).abs() < 1e-12);
        assert_eq!(told, Camera::<T>::try_new(&changed).unwrap());
        let p = ImagePoint { u: T::from_f64(400.0), v: T::from_f64(180.0) };
        assert_ne!(told.ray(p).unwrap().s, camera.ray(p).unwrap().s);
        // Without a temperature, or for a lens that does not change, nothing is different.
        assert_eq!(camera.clone().with_temperature(None), camera);
        let plain = Camera::<T>::try_new(&Config { temperature: None, ..config }).unwrap();
        assert_eq!(plain.clone().with_temperature(Some(T::zero())), plain);
    }

    #[test]
    fn a_temperature_equals_a_configuration_with_the_changed_lens() {
        is_the_changed_lens::<f64>();
        is_the_changed_lens::<f32>();
    }

    #[test]
    fn only_an_untold_temperature_widens_the_covariance() {
        let camera = Camera::<f64>::try_new(&lens()).unwrap();
        let [mode] = camera.intrinsic_modes().unwrap() else { panic!("one mode is expected") };
        let want = [8.0 * 31e-6, 8.0 * 31e-6, 0.16 / 250.0, -0.08 / 250.0];
        assert!(mode.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-12), "{mode:?}");
        assert!(camera.with_temperature(Some(30.0)).intrinsic_modes().is_none());
        let of_temperature = lens().temperature.map(|lens| Temperature { untold_sigma_k: 0.0, ..lens });
        let silent = Camera::<f64>::try_new(&Config { temperature: of_temperature, ..lens() }).unwrap();
        assert!(silent.intrinsic_modes().is_none());
    }

    #[test]
    fn the_corner_has_a_ray_at_every_temperature_that_is_accepted() {
        let camera = Camera::<f64>::try_new(&Config { theta_max_deg: None, ..lens() }).unwrap();
        let corner = ImagePoint { u: -0.5, v: 479.5 };
        // 1 % of the focal length are 322 K.
        for at in [-90.0, -300.0 + 20.0, 140.0] {
            assert!(camera.accepts_temperature(at) == (at > -100.0), "{at}");
            assert!(camera.clone().with_temperature(Some(at)).ray(corner).is_some(), "{at}");
        }
        for at in [f64::NAN, f64::INFINITY, 400.0] {
            assert!(!camera.accepts_temperature(at));
        }
    }

    #[test]
    fn a_smaller_copy_of_the_picture_changes_as_the_picture() {
        let camera = Camera::<f64>::try_new(&lens()).unwrap();
        let crop = crate::geometry::crop::Crop::whole([640, 480], Some(240));
        let (at, p) = (Some(-17.25), ImagePoint { u: 100.0, v: 90.0 });
        let of_copy = camera.for_crop(&crop).with_temperature(at).ray(p).unwrap();
        let of_picture = camera.clone().with_temperature(at).for_crop(&crop).ray(p).unwrap();
        assert!((of_copy.s - of_picture.s).norm() < 1e-12);
        assert!((of_copy.s - camera.for_crop(&crop).ray(p).unwrap().s).norm() > 1e-4);
    }
}
