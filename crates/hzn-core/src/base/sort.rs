//! Sorting that cannot panic. The sort of the standard library can panic when the comparison is not a total order.

use core::mem::swap;

/// Sorts in place by `less` with a heap sort: it needs no extra memory and n log n steps for every input order. Equal
/// items may change places. If `less` is not an order, the result is some permutation of the items.
pub(crate) fn by<X>(items: &mut [X], less: impl Fn(&X, &X) -> bool) {
    let n = items.len();
    // The heap is built from its last parent upwards, so that both branches below a root are heaps already.
    for root in (0..n / 2).rev() {
        sink(items, root, n, &less);
    }
    for end in (1..n).rev() {
        exchange(items, 0, end);
        sink(items, 0, end, &less);
    }
}

/// Moves the item at `root` down the heap of the first `end` items until no item below it is larger.
fn sink<X>(items: &mut [X], mut root: usize, end: usize, less: &impl Fn(&X, &X) -> bool) {
    loop {
        let left = 2 * root + 1;
        if left >= end {
            return;
        }
        // `get` instead of an index: the compiler cannot see that both are within the list, and would link a panic
        // path.
        let is_less = |a: usize, b: usize| items.get(a).zip(items.get(b)).is_some_and(|(a, b)| less(a, b));
        let child = if left + 1 < end && is_less(left, left + 1) { left + 1 } else { left };
        if !is_less(root, child) {
            return;
        }
        exchange(items, root, child);
        root = child;
    }
}

fn exchange<X>(items: &mut [X], a: usize, b: usize) {
    // `swap` of a slice would panic for an index outside it; here nothing happens.
    if let Ok([a, b]) = items.get_disjoint_mut([a, b]) {
        swap(a, b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn as_the_standard_library_sorts(items: Vec<u16>) {
            let (mut ours, mut theirs) = (items.clone(), items);
            by(&mut ours, |a, b| a < b);
            theirs.sort_unstable();
            prop_assert_eq!(ours, theirs);
        }

        #[test]
        fn no_order_is_survived(items: Vec<f32>) {
            let mut sorted = items.clone();
            by(&mut sorted, |a, b| a < b || b.is_nan());
            let bits = |mut v: Vec<u32>| {
                v.sort_unstable();
                v
            };
            prop_assert_eq!(
                bits(sorted.iter().map(|x| x.to_bits()).collect()),
                bits(items.iter().map(|x| x.to_bits()).collect())
            );
        }
    }

    #[test]
    fn every_short_list_is_sorted() {
        for length in 0..=7u32 {
            for number in 0..4u32.pow(length) {
                let mut items: Vec<u32> = (0..length).map(|k| number / 4u32.pow(k) % 4).collect();
                let mut sorted = items.clone();
                sorted.sort_unstable();
                by(&mut items, |a, b| a < b);
                assert_eq!(items, sorted);
            }
        }
    }
}
