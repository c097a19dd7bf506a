//! The files that a pattern matches, such as `flights/**/*.png`.

use std::collections::{HashSet, VecDeque};
use std::ffi::OsString;
use std::fs::{DirEntry, ReadDir};
use std::path::{Component, Path, PathBuf};

use glob::{MatchOptions, Pattern, PatternError};

/// What a pattern matches.
#[derive(Debug, Default)]
pub(super) struct Matches {
    /// The matching paths, without an order.
    pub(super) paths: Vec<PathBuf>,
    /// Number of folders that could not be listed.
    pub(super) unlisted: usize,
}

/// One part of a pattern between two separators.
enum Part {
    /// `**`: any number of folders.
    Folders,
    Name(Pattern),
}

/// Finds the files and folders that a pattern matches.
///
/// Links to folders are followed, and may form circles. Therefore a folder is visited once with the same rest of the
/// pattern, on the shortest path. Without this, two links in a circle give more paths than there are atoms. Of several
/// paths of the same length, the one without links is taken, and then the first one by name.
///
/// # Errors
/// The pattern is not valid.
pub(super) fn find(text: &str) -> Result<Matches, PatternError> {
    // This checks the whole, for example that `**` is not a part of a name.
    Pattern::new(text)?;
    let components: Vec<Component<'_>> = Path::new(text).components().collect();
    let is_plain = |c: &&Component<'_>| !c.as_os_str().to_string_lossy().contains(['*', '?', '[']);
    let start: PathBuf = components.iter().take_while(is_plain).collect();
    let part = |c: &Component<'_>| match &*c.as_os_str().to_string_lossy() {
        "**" => Ok(Part::Folders),
        name => Pattern::new(name).map(Part::Name),
    };
    let parts = components.iter().skip_while(is_plain).map(part).collect::<Result<Vec<Part>, _>>()?;
    let mut matches = Matches::default();
    let mut waiting = VecDeque::from([(start, parts.as_slice())]);
    let mut visited = HashSet::new();
    while let Some((folder, parts)) = waiting.pop_front() {
        let Some((part, rest)) = parts.split_first() else { continue };
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        if !visited.insert((here.canonicalize().unwrap_or_else(|_| here.to_owned()), parts.len())) {
            continue;
        }
        let Ok(entries) = here.read_dir() else {
            matches.unlisted += 1;
            continue;
        };
        if let Part::Folders = part {
            waiting.push_back((folder.clone(), rest));
        }
        for name in ordered(entries) {
            let path = folder.join(&name);
            match part {
                // `**` at the end matches only folders.
                Part::Folders if rest.is_empty() && path.is_dir() => matches.paths.push(path.clone()),
                Part::Name(pattern) if !pattern.matches_with(&name.to_string_lossy(), MatchOptions::new()) => continue,
                Part::Name(_) if rest.is_empty() => {
                    matches.paths.push(path);
                    continue;
                }
                _ => {}
            }
            if path.is_dir() {
                waiting.push_back((path, if let Part::Folders = part { parts } else { rest }));
            }
        }
    }
    Ok(matches)
}

/// Returns the names in a folder in an order that does not depend on the file system: links come last.
fn ordered(entries: ReadDir) -> Vec<OsString> {
    let key = |entry: DirEntry| (entry.file_type().is_ok_and(|kind| kind.is_symlink()), entry.file_name());
    let mut names: Vec<_> = entries.flatten().map(key).collect();
    names.sort();
    names.into_iter().map(|(_, name)| name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(files: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        dir
    }

    fn sorted(mut paths: Vec<PathBuf>) -> Vec<PathBuf> {
        paths.sort();
        paths
    }

    #[test]
    fn patterns_match_as_the_crate_glob_matches_them() {
        let dir = place(&["x.png", "a/x.png", "a/b/y.png", "a/b/.hidden.png", "c[1]/z.jpg", "c/n1.png", "c/n12.png"]);
        for pattern in ["*", "*.png", "**/*.png", "**", "a/**", "a/*/y.png", "*/*", "**/b/*", "**/**/x.png"] {
            let text = format!("{}/{pattern}", Pattern::escape(&dir.path().to_string_lossy()));
            let reference: Vec<PathBuf> = glob::glob(&text).unwrap().map(Result::unwrap).collect();
            let mut reference = sorted(reference);
            reference.dedup();
            let found = sorted(find(&text).unwrap().paths);
            // `**` alone also gives the folder itself there, which is no picture.
            reference.retain(|path| path != dir.path() && *path != dir.path().join("a") || !pattern.ends_with("**"));
            let found: Vec<_> =
                found.into_iter().filter(|path| *path != dir.path().join("a") || !pattern.ends_with("**")).collect();
            assert_eq!(found, reference, "{pattern}");
        }
        for pattern in ["c/n?.png", "c/n[0-9].png", "c[[]1]/*", "c/n[!2].png", "[ac]/x.png"] {
            let text = format!("{}/{pattern}", dir.path().display());
            let reference: Vec<PathBuf> = glob::glob(&text).unwrap().map(Result::unwrap).collect();
            assert_eq!(sorted(find(&text).unwrap().paths), sorted(reference), "{pattern}");
        }
        assert!(find("a**/x").is_err() && find("[a").is_err());
    }

    #[test]
    #[cfg(unix)]
    fn circles_of_links_end() {
        let dir = place(&["a/b/x.png", "c/y.png"]);
        for link in ["a/b/up", "a/again", "c/up", "c/twice", "a/b/other"] {
            std::os::unix::fs::symlink(dir.path(), dir.path().join(link)).unwrap();
        }
        let found = |pattern: &str| {
            let found = find(&format!("{}/{pattern}", dir.path().display())).unwrap().paths;
            sorted(found.iter().map(|path| path.strip_prefix(dir.path()).unwrap().to_owned()).collect())
        };
        assert_eq!(found("**/*.png"), [Path::new("a/b/x.png"), Path::new("c/y.png")]);
        // A pattern that names a link finds the files behind it.
        assert_eq!(found("**/twice/c/*.png"), [Path::new("c/twice/c/y.png")]);
        assert_eq!(found("c/up/a/b/*.png"), [Path::new("c/up/a/b/x.png")]);
    }

    #[test]
    #[cfg(unix)]
    fn of_two_paths_the_one_without_a_link_is_taken() {
        // Names before and after that of the folder, and many of them, because a file system has no order.
        let links: Vec<String> = (0..40).flat_map(|i| [format!("a{i}"), format!("z{i}")]).collect();
        let dir = place(&["real/x.png"]);
        for link in &links {
            std::os::unix::fs::symlink(dir.path().join("real"), dir.path().join(link)).unwrap();
        }
        let text = format!("{}/*/x.png", dir.path().display());
        assert_eq!(find(&text).unwrap().paths, [dir.path().join("real/x.png")]);
        std::fs::rename(dir.path().join("real"), dir.path().join(".real")).unwrap();
        for link in &links {
            std::fs::remove_file(dir.path().join(link)).unwrap();
            std::os::unix::fs::symlink(dir.path().join(".real"), dir.path().join(link)).unwrap();
        }
        let text = format!("{}/[az]*/x.png", dir.path().display());
        assert_eq!(find(&text).unwrap().paths, [dir.path().join("a0/x.png")]);
    }
}
