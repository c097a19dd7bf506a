//! Prints the table of accuracy: altitude × noise × visible arc × lens.

fn main() {
    print!("{}", hzn_tests::table::markdown());
}
