//! Prints the presets beside each other on the same rendered scenes. An argument is the number of pictures of each kind.

fn main() {
    let count = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(24);
    print!("{}", hzn_tests::methods::markdown(count));
}
