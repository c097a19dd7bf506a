//! Names of pictures that a table writes otherwise than the folder.

use std::collections::HashMap;

/// How the names of a table differ from those of the pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Written {
    WithFolder,
    InOtherCase,
    WithOtherEnding,
    WithOtherEndingAndFolder,
}

impl Written {
    /// All ways, the smallest difference first.
    const ALL: [Self; 4] = [Self::WithFolder, Self::InOtherCase, Self::WithOtherEnding, Self::WithOtherEndingAndFolder];

    /// Returns the part of a name that is the same in both.
    fn common(self, name: &str) -> String {
        // A table from another computer may have its separators.
        let file = || name.rsplit(['/', '\\']).next().unwrap_or(name);
        let stem = |name: &str| name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_lowercase();
        match self {
            Self::WithFolder => file().to_owned(),
            Self::InOtherCase => file().to_lowercase(),
            Self::WithOtherEnding => stem(name),
            Self::WithOtherEndingAndFolder => stem(file()),
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::WithFolder => "without their folders",
            Self::InOtherCase => "if upper and lower case do not count",
            Self::WithOtherEnding => "without their endings",
            Self::WithOtherEndingAndFolder => "without their folders and endings",
        }
    }
}

/// Says how names without a picture would be those of pictures; `None` if they would not be, or several pictures would
/// have one name.
pub(super) fn describe<'a>(names: &[&str], pictures: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let matches = |written: &Written| {
        let mut count: HashMap<String, u32> = HashMap::new();
        pictures.clone().for_each(|name| *count.entry(written.common(name)).or_default() += 1);
        !names.is_empty() && names.iter().all(|name| count.get(&written.common(name)) == Some(&1))
    };
    let written = Written::ALL.into_iter().find(matches)?;
    Some(format!("the names match those of the pictures {}", written.words()))
}

#[cfg(test)]
mod tests {
    use crate::frames::load_for;

    #[test]
    fn names_that_differ_in_one_way_are_told() {
        let said = |names: [&str; 2]| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("frames.csv");
            std::fs::write(&path, format!("file,altitude_km\n{},400\n{},400\n", names[0], names[1])).unwrap();
            let pictures = ["c0.png", "c1.png", "c2.png"];
            load_for(&path, pictures.map(str::to_owned)).unwrap().unused.other_names
        };
        assert!(said(["/data/c0.png", "/data/c1.png"]).unwrap().ends_with("without their folders"));
        assert!(said(["C0.PNG", "C1.PNG"]).unwrap().contains("upper and lower case"));
        assert!(said(["c0", "c1"]).unwrap().ends_with("without their endings"));
        assert!(said(["d/c0.jpg", "d/c1.jpg"]).unwrap().ends_with("folders and endings"));
        assert_eq!(said(["0", "1"]), None);
    }
}
