//! Numbers, lists and ranges on the command line.

use std::str::FromStr;

/// Approximate number of values of a range without a step.
const STEPS: f64 = 15.0;
/// Largest number of values of a range; more are a typing error.
const MAX_VALUES: usize = 10_000;

/// The values of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Values(pub(super) Vec<f64>);

impl FromStr for Values {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |t: &str| match t.trim().parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(x),
            _ => Err(format!("{t:?} is not a number; expected a number, a list A,B,C or a range A:B or A:B:STEP")),
        };
        let mut values = Vec::new();
        for part in text.split(',') {
            match part.split(':').map(number).collect::<Result<Vec<_>, _>>()?.as_slice() {
                [one] => values.push(*one),
                [from, to] => values.extend(range(*from, *to, None)?),
                [from, to, step] => values.extend(range(*from, *to, Some(*step))?),
                _ => return Err(format!("{part:?}: a range has two or three numbers, A:B or A:B:STEP")),
            }
        }
        Ok(Self(values))
    }
}

fn range(from: f64, to: f64, step: Option<f64>) -> Result<Vec<f64>, String> {
    if !(to > from) {
        return Err(format!("{from}:{to}: a range must go from the lower to the higher value"));
    }
    let step = step.unwrap_or_else(|| nice((to - from) / STEPS));
    let count = ((to - from) / step + 1e-9).floor();
    if !(step > 0.0 && count < MAX_VALUES as f64) {
        return Err(format!("{from}:{to}:{step}: the step must be above 0 and give fewer than {MAX_VALUES} values"));
    }
    // Values are rounded to nine decimals, so that 0.1 does not become 0.30000000000000004.
    let tidy = |x: f64| (x * 1e9).round() / 1e9;
    let mut values: Vec<f64> = (0..=count as usize).map(|i| tidy(from + i as f64 * step)).collect();
    // The end belongs to the range, even if no step reaches it.
    if values.last().is_some_and(|last| to - last > 1e-6 * step) {
        values.push(to);
    }
    Ok(values)
}

/// Returns the smallest value of at least `at_least` among 1, 2 and 5 times a power of ten.
fn nice(at_least: f64) -> f64 {
    let decade = 10f64.powf(at_least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * decade).find(|s| *s >= at_least * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Result<Vec<f64>, String> {
        text.parse::<Values>().map(|v| v.0)
    }

    #[test]
    fn numbers_lists_and_ranges() {
        assert_eq!(values("94.4").unwrap(), [94.4]);
        assert_eq!(values("60,90,120").unwrap(), [60.0, 90.0, 120.0]);
        assert_eq!(values("60:150:30").unwrap(), [60.0, 90.0, 120.0, 150.0]);
        assert_eq!(values("0:0.3:0.1").unwrap(), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(values("60:145:30,170").unwrap(), [60.0, 90.0, 120.0, 145.0, 170.0]);
        let v = values("60:150").unwrap();
        assert_eq!((v[0], v[1], v[v.len() - 1]), (60.0, 70.0, 150.0));
        assert_eq!(values("-90:90:90").unwrap(), [-90.0, 0.0, 90.0]);
    }

    #[test]
    fn wrong_values_are_refused() {
        assert!(values("wide").unwrap_err().contains("\"wide\" is not a number"));
        assert!(values("150:60").unwrap_err().contains("from the lower to the higher"));
        assert!(values("1:2:3:4").unwrap_err().contains("two or three numbers"));
        assert!(values("1:2:0").unwrap_err().contains("above 0"));
        assert!(values("1:2:-1").unwrap_err().contains("above 0"));
        assert!(values("0:1:1e-9").unwrap_err().contains("fewer than"));
        assert!(values("nan").is_err() && values("").is_err());
    }
}
