//! Keeps the accuracy table as text, so that a review shows what a change does to it.
//!
//! Numbers are rounded to two digits, and scenes and sensor are deterministic, so the text is the same on every
//! machine. To accept a change, run `INSTA_UPDATE=always cargo test -p hzn-tests --test chain accuracy_table::`.

#[test]
fn altitude_noise_arc_lens() {
    insta::assert_snapshot!(hzn_tests::table::markdown());
}
