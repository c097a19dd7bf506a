//! How wide an edge is at a point, and how bright its lit side is.

use crate::base::real::Real;

/// Natural logarithm of a quarter of an octave.
const LN_PER_QUARTER: f64 = core::f64::consts::LN_2 / 4.0;

/// Width and contrast of the edge at a point, in quarters of an octave: 4 log₂ of the width in pixels along the axis of
/// the profile, and of the contrast in counts.
// A logarithm needs five and six bits, so that a point that is stored with its border pixel does not grow. The few
// points in whose noise the edge has hardly any slope do not move the mean of the logarithms.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Profile {
    /// 0 to [`Self::WIDEST`].
    pub(crate) width: u8,
    /// 1 to [`Self::BRIGHTEST`]; 0 if the method of the points does not measure a profile.
    pub(crate) contrast: u8,
}

impl Profile {
    pub(crate) const WIDEST: u8 = 31;
    pub(crate) const BRIGHTEST: u8 = 63;

    /// Makes the profile of an edge with this contrast that falls by `fall` over `step_px`; both are in fourths of a
    /// count.
    pub(crate) fn new(contrast4: i32, fall4: i32, step_px: i32) -> Self {
        let sixteenths = |value: i32| {
            let value = value.clamp(1, 1 << 26) as u32;
            let octave = value.ilog2();
            // Between two powers of two the logarithm is taken as a straight line, which is within 1/12 of an octave.
            (16 * octave + ((value << 4) >> octave) - 16) as i32
        };
        let quarters = |sixteenths: i32, least: u8, most: u8| ((sixteenths + 2) >> 2).clamp(least.into(), most.into());
        let width = sixteenths(contrast4) + sixteenths(step_px) - sixteenths(fall4);
        let contrast = sixteenths(contrast4) - sixteenths(4);
        Self { width: quarters(width, 0, Self::WIDEST) as u8, contrast: quarters(contrast, 1, Self::BRIGHTEST) as u8 }
    }
}

/// Means over a third of the points of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part<T> {
    /// Number of the point in the middle.
    pub(crate) place: T,
    /// Natural logarithms of the width, px, and of the contrast, counts.
    pub(crate) ln_width: T,
    pub(crate) ln_contrast: T,
}

/// The profiles of an edge, summed over each third of its points.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Profiles {
    thirds: [Sum; 3],
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sum {
    count: u32,
    places: u32,
    /// Number after that of the last point.
    end: u32,
    width: u32,
    contrast: u32,
}

impl Profiles {
    /// Adds the profile of the point with the number `place`, which is in the third `third` of the edge, 0 to 2.
    #[inline(always)]
    pub(crate) fn add(&mut self, third: usize, place: usize, profile: Profile) {
        if profile.contrast > 0
            && let Some(sum) = self.thirds.get_mut(third)
        {
            sum.count += 1;
            sum.places += place as u32;
            sum.end = place as u32 + 1;
            sum.width += u32::from(profile.width);
            sum.contrast += u32::from(profile.contrast);
        }
    }

    /// Returns the numbers of the points at which the second and the last third begin.
    pub(crate) fn ends(&self) -> [u32; 2] {
        let [first, second, _] = self.thirds.map(|sum| sum.end);
        [first, second]
    }

    /// Returns the means of the thirds; `None` if one of them has no profile.
    pub(crate) fn means<T: Real>(&self) -> Option<[Part<T>; 3]> {
        self.thirds.iter().all(|sum| sum.count > 0).then(|| {
            self.thirds.map(|sum| {
                let mean = |total: u32| T::from_i32(total as i32) / T::from_i32(sum.count as i32);
                let ln = |total: u32| mean(total) * T::from_f64(LN_PER_QUARTER);
                Part { place: mean(sum.places), ln_width: ln(sum.width), ln_contrast: ln(sum.contrast) }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_and_contrast_are_right_within_a_quarter_of_an_octave() {
        for contrast in [6, 10, 50, 199, 255, 4095, 65535] {
            for fall4 in [1, 3, 7, 40, 250, 900] {
                for step_px in 1..=6 {
                    let found = Profile::new(4 * contrast, fall4, step_px);
                    let width = f64::from(4 * contrast * step_px) / f64::from(fall4);
                    let off = |quarters: u8, right: f64| (f64::from(quarters) / 4.0 - right.log2()).abs();
                    assert!(off(found.contrast, f64::from(contrast)) <= 0.25, "{contrast} {found:?}");
                    if (1.0..200.0).contains(&width) {
                        // Three logarithms have an error each.
                        assert!(off(found.width, width) < 0.3, "{contrast} {fall4} {step_px} {found:?}");
                    }
                }
            }
        }
        assert_eq!(Profile::new(4 * 65535, 1, 6), Profile { width: Profile::WIDEST, contrast: Profile::BRIGHTEST });
        assert_eq!(Profile::new(4, 4000, 1), Profile { width: 0, contrast: 1 });
    }

    #[test]
    fn the_means_need_a_profile_in_each_third() {
        let mut profiles = Profiles::default();
        let at = |width, contrast| Profile { width, contrast };
        profiles.add(0, 2, at(4, 8));
        profiles.add(0, 4, at(8, 16));
        profiles.add(1, 6, at(4, 8));
        profiles.add(2, 9, Profile::default());
        assert_eq!(profiles.means::<f64>(), None);
        profiles.add(2, 10, at(12, 20));
        let [first, _, last] = profiles.means().unwrap();
        let octaves = |n: f64| n * core::f64::consts::LN_2;
        assert_eq!(first, Part { place: 3.0, ln_width: octaves(1.5), ln_contrast: octaves(3.0) });
        assert_eq!(last, Part { place: 10.0, ln_width: octaves(3.0), ln_contrast: octaves(5.0) });
    }
}
