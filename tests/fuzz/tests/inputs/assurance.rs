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

/// The page about reliability names the tests of the command line and of the Python package by the name of their file,
/// and others by their path. The first test of a table's cell has the file, and others of the same file may follow.
#[test]
fn every_test_that_the_page_about_reliability_names_exists() {
    let page = std::fs::read_to_string(root().join("book/results/reliability.md")).unwrap();
    let (mut named, mut python) = (0, 0);
    for code in page.split('`').skip(1).step_by(2) {
        let Some((file, test)) = code.split_once(": ") else { continue };
        let (path, begin) = match file {
            "faults" | "power_cut" | "hostile" | "resume" | "rewritten" | "rig_resume" | "terminal" => {
                (format!("crates/hzn-cli/tests/cli/{file}.rs"), "fn")
            }
            _ if file.starts_with("test_") && file.ends_with(".py") => (format!("crates/hzn-py/tests/{file}"), "def"),
            _ if file.contains('/') && file.ends_with(".rs") => (file.to_owned(), "fn"),
            _ => continue,
        };
        let text = std::fs::read_to_string(root().join(&path)).unwrap_or_else(|e| panic!("{path}: {e}"));
        assert!(text.contains(&format!("{begin} {test}(")), "{path} has no test {test}");
        named += 1;
        python += usize::from(begin == "def");
    }
    assert!(named - python >= 28 && python >= 5, "{named} {python}");
}
