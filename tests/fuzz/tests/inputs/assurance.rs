//! The pages about hazards and about reliability name tests. Each of them exists.

use hzn_supply::root;

#[test]
fn every_test_that_is_named_exists() {
    let page = std::fs::read_to_string(root().join("book/results/assurance.md")).unwrap();
    let mut named = 0;
    for code in page.split('`').skip(1).step_by(2) {
        let Some((file, test)) = code.split_once(".rs: ") else { continue };
        let path = root().join(format!("{file}.rs"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(text.contains(&format!("fn {test}(")), "{file}.rs has no test {test}");
        named += 1;
    }
    assert!(named >= 15, "{named}");
}

/// The page about reliability names the tests of the command line by the name of their file.
#[test]
fn every_test_of_the_command_line_that_is_named_exists() {
    let page = std::fs::read_to_string(root().join("book/results/reliability.md")).unwrap();
    let mut named = 0;
    for code in page.split('`').skip(1).step_by(2) {
        let Some((file @ ("faults" | "power_cut"), test)) = code.split_once(": ") else { continue };
        let text = std::fs::read_to_string(root().join(format!("crates/hzn-cli/tests/cli/{file}.rs"))).unwrap();
        assert!(text.contains(&format!("fn {test}(")), "{file}.rs has no test {test}");
        named += 1;
    }
    assert!(named >= 9, "{named}");
}
