//! The header agrees with the library.

use std::path::Path;

use hzn::types::{HznAnswer, HznEdge, HznKnown, HznPicture, HznRigAnswer, HznRigSetup};
use hzn_core::verdict::Verdict;
use hzn_flight::{Parameters, parameters};

/// `HZN_BLESS=1` writes the header anew.
#[test]
fn the_header_is_up_to_date() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(here.join("cbindgen.toml")).unwrap();
    let bindings = cbindgen::Builder::new().with_src(here.join("src/lib.rs")).with_src(here.join("src/types.rs"));
    let bindings = bindings.with_config(config).generate().unwrap();
    let mut made = Vec::new();
    bindings.write(&mut made);
    let made = for_c(&String::from_utf8(made).unwrap());
    let (structures, functions) = made.split_once("#ifdef __cplusplus\n").unwrap();
    compare(&here.join("include/hzn.h"), &format!("{structures}{}#ifdef __cplusplus\n{functions}", assertions()));
}

/// Returns the lines with which a C compiler checks that its structures have the sizes of the library's.
fn assertions() -> String {
    // A picture has a pointer and two lengths.
    assert_eq!(size_of::<HznPicture>(), 3 * size_of::<usize>() + 8);
    let sizes = [
        ("HznKnown", size_of::<HznKnown>().to_string()),
        ("HznPicture", "3 * sizeof(size_t) + 8".to_owned()),
        ("HznEdge", size_of::<HznEdge>().to_string()),
        ("HznAnswer", size_of::<HznAnswer>().to_string()),
        ("HznRigSetup", size_of::<HznRigSetup>().to_string()),
        ("HznRigAnswer", size_of::<HznRigAnswer>().to_string()),
    ];
    let check =
        |(name, size): (&str, String)| format!("HZN_ASSERT(sizeof({name}) == {size}, \"the size of {name}\");\n");
    format!(
        "// The structures have the sizes that they have in the library. C99 cannot check this.\n\
         #if defined(__cplusplus)\n\
         #define HZN_ASSERT static_assert\n\
         #elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L\n\
         #define HZN_ASSERT _Static_assert\n\
         #else\n\
         #define HZN_ASSERT(condition, message) struct HznSensor\n\
         #endif\n\
         {}#undef HZN_ASSERT\n\n",
        sizes.into_iter().map(check).collect::<String>()
    )
}

/// Returns the header without the marks of Rust's documentation, and with negative numbers in parentheses: `x HZN_NULL`
/// would otherwise be the difference `x - 1`.
fn for_c(made: &str) -> String {
    let line = |line: &str| {
        let line = line
            .replace("[`", "")
            .replace("`]", "")
            .replace("rows::", "")
            .replace("(crate::hzn_open)", "")
            .replace("(crate::hzn_process)", "")
            .replace('`', "");
        let line = line.replace("// # Safety", "// Safety:");
        match line.strip_prefix("#define ").and_then(|rest| rest.split_once(' ')) {
            Some((name, value)) if value.starts_with('-') => format!("#define {name} ({value})\n"),
            _ => line + "\n",
        }
    };
    made.lines().map(line).collect()
}

#[test]
fn the_header_is_plain_c() {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("include/hzn.h")).unwrap();
    assert!(text.contains("#define HZN_NULL (-1)"));
    let marked: Vec<&str> = text.lines().filter(|line| line.contains('`') || line.contains("// #")).collect();
    assert!(marked.is_empty(), "{marked:#?}");
}

/// `HZN_BLESS=1` writes the list anew.
#[test]
fn the_parameters_are_up_to_date() {
    let mut made =
        "/* The numbers of the parameters of hzn, by their names in sensor.toml. Made by tests/c/header.rs; do \
                    not edit.\n   Of a parameter with several numbers, such as camera.k, this is the first. */\n\
                    #ifndef HZN_PARAMETERS_H\n#define HZN_PARAMETERS_H\n\n"
            .to_owned();
    let mut names = std::collections::BTreeSet::new();
    for id in Parameters::defaults().sensor_numbers().chain([1000]) {
        let name = parameters::name(id).unwrap().to_uppercase().replace(['.', ' '], "_");
        if names.insert(name.clone()) {
            made += &format!("#define HZN_{name} {id}\n");
        }
    }
    compare(&Path::new(env!("CARGO_MANIFEST_DIR")).join("include/hzn_parameters.h"), &(made + "\n#endif\n"));
}

/// `HZN_BLESS=1` writes the list anew.
#[test]
fn the_verdicts_are_up_to_date() {
    let mut made = "/* The verdicts on candidates. Made by tests/c/header.rs; do not edit. */\n\
                    #ifndef HZN_VERDICTS_H\n#define HZN_VERDICTS_H\n\n"
        .to_owned();
    for verdict in Verdict::ALL {
        let name = verdict.name().to_uppercase().replace('-', "_");
        made += &format!("#define HZN_VERDICT_{name} {}\n", *verdict as u8);
    }
    compare(&Path::new(env!("CARGO_MANIFEST_DIR")).join("include/hzn_verdicts.h"), &(made + "\n#endif\n"));
}

fn compare(path: &Path, made: &str) {
    if std::env::var_os("HZN_BLESS").is_some() {
        std::fs::write(path, made).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap_or_default(), made, "HZN_BLESS=1 writes it anew");
}
