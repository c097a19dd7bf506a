//! Prints the accuracy table: altitude × noise × visible arc × lens.

fn main() {
    print!("{}", hzn_tests::table::markdown());
}
