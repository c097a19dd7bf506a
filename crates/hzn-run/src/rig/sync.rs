//! Whether pictures belong to one epoch.

/// Returns whether times that are this far apart belong to one epoch. Times that a table gives to the millisecond, such
/// as 20.0 s and 20.1 s, differ by a little more than 0.1 s in binary numbers; a microsecond is allowed for that.
pub(super) fn is_in_sync(apart_s: f64, sync_s: f64) -> bool {
    apart_s <= sync_s + 1e-6
}

#[cfg(test)]
mod tests {
    use super::is_in_sync;

    #[test]
    fn times_of_a_table_that_are_just_in_sync_are() {
        for k in 0..100 {
            let time_s = 10.0 * f64::from(k);
            assert!(is_in_sync(time_s + 0.1 - time_s, 0.1) && !is_in_sync(time_s + 0.101 - time_s, 0.1));
        }
        // Seconds since 1970.
        assert!(is_in_sync(1_605_861_000.1 - 1_605_861_000.0, 0.1));
    }
}
