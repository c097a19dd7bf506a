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
        Some(Consensus { suspect, value, scatter, disagreement, pictures: values.len() })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(altitude: f64, correction: f64, focal: f64) -> FitFacts {
        FitFacts {
            expected_deg: 80.0,
            fitted_deg: 78.0,
            fitted_sigma_deg: 0.2,
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
    fn a_few_fits_of_clouds_change_little() {
        let mut all: Vec<FitFacts> = (0..20).map(|_| facts(200.0, 30.0, 0.9)).collect();
        all.extend((0..5).map(|_| facts(200.0, -900.0, 3.0)));
        let altitude = summarise(all.iter()).into_iter().find(|s| s.suspect == Suspect::Altitude).unwrap();
        assert_eq!(altitude.value, 30.0);
    }
}
