//! Medians by bisection of the range. A sort would need a panic path and would change the order of the values.

use crate::base::real::Real;

/// Returns the median of values from 0 to `most`, with an error of at most `most`/4096.
pub(crate) fn median_of_reals<T: Real>(values: &[T], most: T) -> T {
    let (mut low, mut high) = (T::ZERO, most);
    // Twelve halvings give 1/4096 of the range. The count is fixed so that the time does not depend on the values.
    for _ in 0..12 {
        let middle = (low + high) * T::from_f64(0.5);
        let below = values.iter().filter(|v| **v <= middle).count();
        // At least half of the values always lie at or below `high`, which is why it is returned and not the middle.
        if 2 * below >= values.len() { high = middle } else { low = middle }
    }
    high
}

/// Returns the smallest value that at least half of the values do not exceed, by bisection; 0 for no values.
pub(crate) fn median_of_counts(values: &[u16]) -> u16 {
    let (mut low, mut high) = (0u32, values.iter().fold(0, |most, &v| most.max(v)).into());
    while low < high {
        let middle = (low + high) / 2;
        let below = values.iter().filter(|&&v| u32::from(v) <= middle).count();
        // The values are whole numbers, so the next candidate is `middle + 1`; with `middle` the loop would not end.
        if 2 * below >= values.len() { high = middle } else { low = middle + 1 }
    }
    low as u16
}

#[cfg(test)]
mod tests {
    use super::{median_of_counts, median_of_reals};
    use std::vec::Vec;

    #[test]
    fn medians_of_few_and_many_counts() {
        assert_eq!(median_of_counts(&[]), 0);
        assert_eq!(median_of_counts(&[7]), 7);
        assert_eq!(median_of_counts(&[9, 1, 5]), 5);
        assert_eq!(median_of_counts(&[65535, 65535, 3, 65535]), 65535);
        assert_eq!(median_of_counts(&[4, 2, 8, 6]), 4);
    }

    #[test]
    fn medians_of_reals() {
        assert_eq!(median_of_reals(&[0.0, 0.0, 4096.0], 4096.0), 1.0);
        assert_eq!(median_of_reals(&[3.0, 1.0, 2.0, 4.0], 4.0), 2.0);
        assert!((median_of_reals(&[0.1, 0.7, 0.3_f32], 0.7) - 0.3).abs() < 2e-4);
    }

    #[test]
    fn every_short_list_has_the_median_of_its_order() {
        for length in 1..=6u32 {
            for number in 0..5u32.pow(length) {
                let mut values: Vec<u16> = (0..length).map(|k| (number / 5u32.pow(k) % 5) as u16).collect();
                let found = median_of_counts(&values);
                values.sort_unstable();
                assert_eq!(found, values[(values.len() - 1) / 2], "{values:?}");
            }
        }
    }
}
