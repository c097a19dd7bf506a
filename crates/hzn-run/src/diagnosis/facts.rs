//! What the fitted half-angles of all pictures say about altitude, focal length and limb height.
//!
//! A wrong value of one of the three makes the fitted half-angle differ from the expected one. Each picture says which
//! value would make them equal. The true cause gives the same value in every picture; for a wrong cause the values
//! scatter, if the pictures differ in altitude or in the place of the limb.

/// A quantity that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suspect {
    /// The altitude, as a correction in km.
    Altitude,
    /// The focal lengths, as a factor.
    Focal,
    /// The limb height in km.
    LimbHeight,
}

impl Suspect {
    /// All quantities.
    pub const ALL: [Self; 3] = [Self::Altitude, Self::Focal, Self::LimbHeight];
    /// Returns the name on the screen.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Altitude => "altitude",
            Self::Focal => "focal length",
            Self::LimbHeight => "limb height",
        }
    }
}

/// A value that makes the fitted half-angle of a picture equal to the expected one, with its 1-sigma from the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Implied {
    /// The value.
    pub value: f64,
    /// Its 1-sigma.
    pub sigma: f64,
}

/// What the fit of one picture says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitFacts {
    /// Expected half-angle in degrees.
    pub expected_deg: f64,
    /// Fitted half-angle in degrees.
    pub fitted_deg: f64,
    /// Its 1-sigma in degrees, with all terms except that of the expected half-angle.
    pub fitted_sigma_deg: f64,
    /// 1-sigma of the expected half-angle in degrees.
    pub expected_sigma_deg: f64,
    /// Difference of the cosines of the half-angles in standard deviations; positive if the fitted half-angle is the
    /// larger one.
    pub sigmas: f64,
    /// True if the fit comes from a trial without the expected half-angle, because the picture has no answer.
    pub is_trial: bool,
    /// Altitude that the picture was processed with, in km.
    pub given_altitude_km: Option<f64>,
    /// Altitude that the fit says, in km.
    pub altitude_km: Option<Implied>,
    /// Factor of the focal lengths.
    pub focal_factor: Option<Implied>,
    /// Limb height, in km.
    pub limb_height_km: Option<Implied>,
}

impl FitFacts {
    /// Returns what the picture says about a quantity. The altitude is a correction, because pictures have different
    /// altitudes.
    pub fn implied(&self, suspect: Suspect) -> Option<Implied> {
        match suspect {
            Suspect::Altitude => {
                let Implied { value, sigma } = self.altitude_km?;
                Some(Implied { value: value - self.given_altitude_km?, sigma })
            }
            Suspect::Focal => self.focal_factor,
            Suspect::LimbHeight => self.limb_height_km,
        }
    }

    /// Returns the 1-sigma of what the picture says about a quantity, with all of its sources. The sigma of
    /// [`Self::implied`] comes from the edge and the lens alone; one picture does not show the error of the expected
    /// half-angle (limb height and altitude), which is the same in all of them.
    pub fn total_sigma(&self, suspect: Suspect) -> Option<f64> {
        let of_edge = self.implied(suspect)?.sigma;
        let expected = self.expected_sigma_deg / self.fitted_sigma_deg.max(f64::MIN_POSITIVE);
        Some(of_edge * 1.0f64.hypot(expected))
    }
}

/// Returns the medians of what several pictures say; `None` without pictures. Some of the fits may be of clouds.
///
/// The altitude is the median of the given altitudes with the median of the corrections, because pictures have
/// different altitudes. The sigmas are those of one picture: what all pictures share does not average out.
pub fn median_fit(facts: &[FitFacts]) -> Option<FitFacts> {
    let of = |get: &dyn Fn(&FitFacts) -> Option<f64>| median(&mut facts.iter().filter_map(get).collect::<Vec<_>>());
    let implied = |get: &dyn Fn(&FitFacts) -> Option<Implied>| {
        let value = of(&|f| Some(get(f)?.value))?;
        Some(Implied { value, sigma: of(&|f| Some(get(f)?.sigma))? })
    };
    let given_altitude_km = of(&|f| f.given_altitude_km);
    let correction = implied(&|f| f.implied(Suspect::Altitude));
    Some(FitFacts {
        expected_deg: of(&|f| Some(f.expected_deg))?,
        fitted_deg: of(&|f| Some(f.fitted_deg))?,
        fitted_sigma_deg: of(&|f| Some(f.fitted_sigma_deg))?,
        expected_sigma_deg: of(&|f| Some(f.expected_sigma_deg))?,
        sigmas: of(&|f| Some(f.sigmas))?,
        is_trial: facts.iter().any(|f| f.is_trial),
        given_altitude_km,
        altitude_km: given_altitude_km
            .zip(correction)
            .map(|(km, Implied { value, sigma })| Implied { value: km + value, sigma }),
        focal_factor: implied(&|f| f.focal_factor),
        limb_height_km: implied(&|f| f.limb_height_km),
    })
}

/// What all pictures say together about one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consensus {
    /// The quantity.
    pub suspect: Suspect,
    /// Median of the values of the pictures.
    pub value: f64,
    /// 1.4826 times the median distance from the median: the scatter of one picture as a 1-sigma.
    pub scatter: f64,
    /// 1-sigma of the value for the user: the scatter, but at least the median of the total sigmas of the pictures. A
    /// single picture has no scatter, and pictures that are alike have too little.
    pub sigma: f64,
    /// Scatter divided by the median sigma of the pictures: about 1 if the quantity explains the differences.
    pub disagreement: f64,
    /// Number of pictures.
    pub pictures: usize,
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    values.get(middle).copied()
}

/// Returns what all pictures say about each quantity, the one that explains the differences best first. Medians are
/// used, because some fits may be of clouds.
pub fn summarise<'a>(facts: impl Iterator<Item = &'a FitFacts> + Clone) -> Vec<Consensus> {
    let one = |suspect: Suspect| {
        let (mut values, mut sigmas): (Vec<f64>, Vec<f64>) = facts
            .clone()
            .filter_map(|f| f.implied(suspect))
            .filter(|i| i.value.is_finite() && i.sigma.is_finite())
            .map(|i| (i.value, i.sigma))
            .unzip();
        let (value, sigma) = (median(&mut values)?, median(&mut sigmas)?);
        let scatter = 1.4826 * median(&mut values.iter().map(|v| (v - value).abs()).collect::<Vec<_>>())?;
        let disagreement = scatter / sigma.max(f64::MIN_POSITIVE);
        let mut totals: Vec<f64> =
            facts.clone().filter_map(|f| f.total_sigma(suspect)).filter(|s| s.is_finite()).collect();
        let sigma = scatter.max(median(&mut totals)?);
        Some(Consensus { suspect, value, scatter, sigma, disagreement, pictures: values.len() })
    };
    let mut all: Vec<_> = Suspect::ALL.into_iter().filter_map(one).collect();
    all.sort_by(|a, b| a.disagreement.total_cmp(&b.disagreement));
    all
}

/// Returns the median size of the difference in standard deviations, or `None` without pictures. Above 3 the
/// half-angles disagree. The sign does not count: a wrong focal length makes it differ from picture to picture.
pub fn typical_sigmas<'a>(facts: impl Iterator<Item = &'a FitFacts>) -> Option<f64> {
    median(&mut facts.map(|f| f.sigmas.abs()).filter(|s| s.is_finite()).collect::<Vec<_>>())
}

/// Part of the variance of the expected half-angle that is the same in all pictures of a flight: the limb height.
const COMMON: f64 = 0.97;
/// Part of the fits that agree with the expected half-angle if nothing is wrong. Of normally distributed differences,
/// 95 % lie within two sigmas; the rest may be of clouds.
const AGREEING: f64 = 0.6;

/// Largest mean difference that counts as agreement, in sigmas of what does not average out. A right limb height stays
/// within it in 87 % of all flights; an error of two sigmas that all pictures share lies beyond it.
const MOST_SHARED: f64 = 1.5;

/// Returns true if the pictures show that the expected half-angle is right. An edge of another half-angle is then
/// probably not the limb. Three things have to hold, because a small error that all pictures share must not look like
/// agreement: most fits lie within two sigmas, their mean is small against what does not average out, and at least
/// half of the `pictures` have an answer.
pub fn is_limb_as_expected<'a>(facts: impl Iterator<Item = &'a FitFacts>, answered: usize, pictures: usize) -> bool {
    let all: Vec<&FitFacts> = facts.filter(|f| f.sigmas.is_finite()).collect();
    if all.is_empty() || 2 * answered < pictures {
        return false;
    }
    let n = all.len() as f64;
    let close = all.iter().filter(|f| f.sigmas.abs() <= 2.0).count() as f64;
    let (mut sum, mut common) = (0.0, 0.0);
    // The fits of clouds say nothing about the mean.
    for f in all.iter().filter(|f| f.sigmas.abs() <= 3.0) {
        let [edge, expected] = [f.fitted_sigma_deg, f.expected_sigma_deg].map(|s| s * s);
        sum += f.sigmas;
        common += COMMON * expected / (edge + expected).max(f64::MIN_POSITIVE);
    }
    let used = all.iter().filter(|f| f.sigmas.abs() <= 3.0).count().max(1) as f64;
    let (mean, common) = (sum / used, common / used);
    close >= AGREEING * n && mean.abs() <= MOST_SHARED * (common + (1.0 - common) / used).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_that_all_pictures_share_is_no_agreement() {
        let with = |sigmas: f64| FitFacts { sigmas, ..facts(200.0, 0.0, 1.0) };
        let of = |sigmas: &[f64], answered| {
            let all: Vec<FitFacts> = sigmas.iter().map(|s| with(*s)).collect();
            is_limb_as_expected(all.iter(), answered, all.len())
        };
        assert!(of(&[0.2, -0.9, 1.1, -0.3, 0.6, 9.0], 5));
        assert!(!of(&[0.2, -0.9, 1.1, -0.3, 0.6, 9.0], 2), "most pictures have no answer");
        assert!(!of(&[2.4, 2.6, 2.2, 2.5, 2.7, 9.0], 6), "the shift is 2 to 3 sigma in every picture");
        assert!(!of(&[1.7, 1.6, 1.9, 1.8, 1.5, 1.7], 6), "so is a shift of 1.7 sigma");
        assert!(!of(&[0.1, 0.2, 9.0, 8.0, -7.0, 6.0], 6) && !of(&[], 0));
    }

    fn facts(altitude: f64, correction: f64, focal: f64) -> FitFacts {
        FitFacts {
            expected_deg: 80.0,
            fitted_deg: 78.0,
            fitted_sigma_deg: 0.2,
            expected_sigma_deg: 0.1,
            sigmas: -9.0,
            is_trial: false,
            given_altitude_km: Some(altitude),
            altitude_km: Some(Implied { value: altitude + correction, sigma: 2.0 }),
            focal_factor: Some(Implied { value: focal, sigma: 0.01 }),
            limb_height_km: None,
        }
    }

    #[test]
    fn the_true_cause_says_the_same_in_every_picture() {
        // The altitudes differ, the factor does not.
        let all: Vec<FitFacts> = (0..20)
            .map(|i| facts(200.0 + 10.0 * f64::from(i), 5.0 * f64::from(i), 0.75 + 0.001 * f64::from(i % 3)))
            .collect();
        let summary = summarise(all.iter());
        assert_eq!(summary.len(), 2, "nothing is said about the limb height");
        assert_eq!(summary[0].suspect, Suspect::Focal);
        assert!((summary[0].value - 0.751).abs() < 1e-9 && summary[0].disagreement < 1.0);
        assert!(summary[1].disagreement > 5.0 && summary[1].pictures == 20);
        assert_eq!(typical_sigmas(all.iter()), Some(9.0));
        assert!(summarise([].iter()).is_empty());
    }

    #[test]
    fn one_picture_has_the_sigma_of_its_fit_and_of_the_expected_half_angle() {
        let one = facts(200.0, 30.0, 0.9);
        for all in [vec![one], vec![one; 2], vec![one; 9]] {
            let altitude = summarise(all.iter()).into_iter().find(|c| c.suspect == Suspect::Altitude).unwrap();
            // The expected half-angle is half as uncertain as the fitted one.
            let sigma = 2.0 * 1.25f64.sqrt();
            assert!(altitude.scatter == 0.0 && (altitude.sigma - sigma).abs() < 1e-9, "{altitude:?}");
        }
    }

    #[test]
    fn the_median_of_the_pictures_is_told() {
        let all = [facts(200.0, 30.0, 0.9), facts(220.0, 32.0, 0.9), facts(260.0, -900.0, 3.0)];
        let fit = median_fit(&all).unwrap();
        assert_eq!((fit.given_altitude_km, fit.altitude_km.unwrap().value), (Some(220.0), 250.0));
        assert_eq!(fit.focal_factor, Some(Implied { value: 0.9, sigma: 0.01 }));
        assert_eq!(median_fit(&[]), None);
    }

    #[test]
    fn a_few_fits_of_clouds_change_little() {
        let mut all: Vec<FitFacts> = (0..20).map(|_| facts(200.0, 30.0, 0.9)).collect();
        all.extend((0..5).map(|_| facts(200.0, -900.0, 3.0)));
        let altitude = summarise(all.iter()).into_iter().find(|s| s.suspect == Suspect::Altitude).unwrap();
        assert_eq!(altitude.value, 30.0);
    }
}
