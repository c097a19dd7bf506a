//! The order of file names as people count: `img2.png` before `img10.png`.

use std::cmp::Ordering;
use std::path::Path;

/// Compares two paths part by part. Numbers in names are compared by value. Everything else is compared by bytes, and
/// so are numbers that differ only in their leading zeros.
pub(super) fn compare(a: &Path, b: &Path) -> Ordering {
    let parts = |p: &Path| p.components().map(|c| c.as_os_str().as_encoded_bytes().to_vec()).collect::<Vec<_>>();
    let (a, b) = (parts(a), parts(b));
    for (a, b) in a.iter().zip(&b) {
        let order = compare_names(a, b);
        if order.is_ne() {
            return order;
        }
    }
    a.len().cmp(&b.len())
}

fn compare_names(a: &[u8], b: &[u8]) -> Ordering {
    let (mut left, mut right) = (a, b);
    while let (Some(x), Some(y)) = (left.first(), right.first()) {
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let (m, n) = (take_number(&mut left), take_number(&mut right));
            m.len().cmp(&n.len()).then(m.cmp(n))
        } else {
            (left, right) = (&left[1..], &right[1..]);
            x.cmp(y)
        };
        if order.is_ne() {
            return order;
        }
    }
    left.len().cmp(&right.len()).then(a.cmp(b))
}

/// Returns the digits at the beginning without leading zeros, and removes all these digits from `rest`.
fn take_number<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let end = rest.iter().position(|c| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (digits, after) = rest.split_at(end);
    *rest = after;
    let zeros = digits.iter().position(|c| *c != b'0').unwrap_or(digits.len());
    &digits[zeros..]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_by_value() {
        let sorted = |mut names: Vec<&str>| {
            names.sort_by(|a, b| compare(Path::new(a), Path::new(b)));
            names.join(" ")
        };
        assert_eq!(sorted(vec!["img10", "img2", "img1", "img02"]), "img1 img02 img2 img10");
        assert_eq!(sorted(vec!["b/1", "a/10", "a/9", "a"]), "a a/9 a/10 b/1");
        assert_eq!(
            sorted(vec!["t-12.5.png", "t-2.50.png", "t-2.5.png", "t-2.png"]),
            "t-2.5.png t-2.50.png t-2.png t-12.5.png"
        );
        // These numbers do not fit into any integer type.
        assert_eq!(
            sorted(vec!["100000000000000000000001", "99999999999999999999999"]),
            "99999999999999999999999 100000000000000000000001"
        );
        // The order is total: a name is equal only to itself.
        let names = ["", "0", "00", "a", "a0", "a00b", "a0b", "1a", "01a"];
        for (i, a) in names.iter().enumerate() {
            for (j, b) in names.iter().enumerate() {
                let order = compare(Path::new(a), Path::new(b));
                assert_eq!(order, compare(Path::new(b), Path::new(a)).reverse());
                assert_eq!(order.is_eq(), i == j, "{a} {b}");
            }
        }
    }
}
