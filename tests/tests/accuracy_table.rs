//! The table of accuracy, kept as text: what a change does to it is seen in its review.
//!
//! Numbers are rounded to two digits, and scenes and sensor are deterministic, so the text is the same on every
//! machine. To accept a change: `INSTA_UPDATE=always cargo test -p hzn-tests --test accuracy_table`.

#[test]
fn altitude_noise_arc_lens() {
    insta::assert_snapshot!(hzn_tests::table::markdown());
}
