//! The ranges of sliders.

use hzn_files::keys::Limits;

/// Range of a slider, and whether its scale is logarithmic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliderRange {
    /// Left end.
    pub low: f64,
    /// Right end.
    pub high: f64,
    /// The scale is logarithmic.
    pub logarithmic: bool,
}

impl SliderRange {
    /// Returns the slider of a value with these limits and this usual magnitude, or `None` if the value is no number. A
    /// slider does not reach a limit that is far from the usual value; values beyond the slider can be typed.
    pub fn from_limits(limits: &Limits, magnitude: f64) -> Option<Self> {
        let Limits::Number { low, above, high } = *limits else { return None };
        let magnitude = if magnitude.abs() > 0.0 { magnitude.abs() } else { 1.0 };
        let far = low + magnitude * 30.0;
        if high - low <= 40.0 * magnitude || (high - low <= 1.0) {
            // A limit that the value may not take itself is not offered.
            let low = if above { low + (high - low) * 1e-3 } else { low };
            // On a linear scale, the usual value would be at the very end.
            let logarithmic = !above && low > 0.0 && high >= 50.0 * low;
            return Some(Self { low, high, logarithmic });
        }
        let high = high.min(far);
        let low = if above || low > 0.0 { low.max(magnitude / 30.0) } else { low };
        Some(Self { low, high, logarithmic: low >= 0.0 })
    }

    /// Returns the value that the slider starts with when no value is in effect.
    pub fn middle(&self) -> f64 {
        if self.logarithmic && self.low > 0.0 { (self.low * self.high).sqrt() } else { (self.low + self.high) / 2.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(low: f64, above: bool, high: f64) -> Limits {
        Limits::Number { low, above, high }
    }

    #[test]
    fn near_limits_are_reached_and_far_ones_are_not() {
        let range = |l: Limits, magnitude: f64| SliderRange::from_limits(&l, magnitude).unwrap();
        assert_eq!(range(number(0.0, false, 1.0), 0.15), SliderRange { low: 0.0, high: 1.0, logarithmic: false });
        let threshold = range(number(0.0, true, 1000.0), 3.0);
        assert_eq!((threshold.low, threshold.high, threshold.logarithmic), (0.1, 90.0, true));
        let points = range(number(8.0, false, f64::INFINITY), 40.0);
        assert_eq!((points.low, points.high), (8.0, 1208.0));
        let height = range(number(-50.0, false, 500.0), 10.0);
        assert!(!height.logarithmic && height.low == -50.0 && height.high <= 500.0);
        assert!(range(number(0.0, true, 100.0), 10.0).low > 0.0);
        let scale = range(number(0.1, false, 10.0), 1.0);
        assert_eq!((scale.logarithmic, scale.middle()), (true, 1.0));
        assert!(SliderRange::from_limits(&Limits::Rule("words"), 1.0).is_none());
    }

    #[test]
    fn every_slider_begins_within_its_limits() {
        for key in hzn_files::keys::all() {
            for magnitude in [0.0, 0.01, 1.0, 300.0] {
                let Some(range) = SliderRange::from_limits(&key.limits, magnitude) else { continue };
                let Limits::Number { low, high, .. } = key.limits else { unreachable!() };
                assert!(range.low < range.high && range.low >= low && range.high <= high, "{} {range:?}", key.path);
                assert!((range.low..=range.high).contains(&range.middle()), "{}", key.path);
            }
        }
    }
}
