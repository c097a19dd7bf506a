//! No two files of a crate import each other, neither directly nor through others.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module by the names on the way to it from the crate's root; the root itself is empty.
type Module = Vec<String>;

/// Returns every module of a crate with the text of its file, without comments, strings and tests.
fn modules(src: &Path) -> BTreeMap<Module, String> {
    fn visit(dir: &Path, module: &Module, found: &mut BTreeMap<Module, String>) {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            let below = || module.iter().cloned().chain([name.clone()]).collect();
            if path.is_dir() {
                visit(&path, &below(), found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let is_root = ["mod", "lib", "main"].contains(&name.as_str());
                let text = plain(&fs::read_to_string(&path).unwrap());
                found.insert(if is_root { module.clone() } else { below() }, text);
            }
        }
    }
    let mut found = BTreeMap::new();
    visit(src, &Module::new(), &mut found);
    found
}

/// Returns the code of a file without comments and without its tests.
fn plain(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the paths of a `use` tree, such as `a::{b, c::d}`.
fn paths(tree: &str, before: &[String], found: &mut Vec<Vec<String>>) {
    let (mut depth, mut start) = (0, 0);
    let mut parts = Vec::new();
    for (i, c) in tree.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[start..]);
    for part in parts.into_iter().map(str::trim).filter(|part| !part.is_empty()) {
        let (head, inner) = part.split_once('{').map_or((part, None), |(head, inner)| (head, Some(inner)));
        let head = head.split(" as ").next().unwrap_or_default();
        let names = head.split("::").map(str::trim).filter(|name| !name.is_empty()).map(String::from);
        let path: Vec<String> = before.iter().cloned().chain(names).collect();
        match inner {
            Some(inner) => paths(inner.trim_end().trim_end_matches('}'), &path, found),
            None => found.push(path),
        }
    }
}

/// Splits the code of a file into its re-exports and everything else that it imports or names by a path.
fn imports(text: &str) -> (Vec<Vec<String>>, Vec<Vec<String>>) {
    let (mut exported, mut imported) = (Vec::new(), Vec::new());
    for statement in text.split(';') {
        let line = statement.rfind("use ").filter(|&at| {
            let before = statement[..at].trim_end();
            before.is_empty() || before.ends_with(['}', ']', ')', '{']) || before.ends_with("pub")
        });
        let Some(at) = line else {
            imported.extend(named(statement));
            continue;
        };
        let is_export = statement[..at].trim_end().ends_with("pub")
            || statement[..at].trim_end().rsplit('\n').next().is_some_and(|l| l.trim_start().starts_with("pub("));
        paths(&statement[at + 4..], &[], if is_export { &mut exported } else { &mut imported });
        imported.extend(named(&statement[..at]));
    }
    (exported, imported)
}

/// Returns the paths in code that begin with `crate`, `super` or `self`, or with a name in lower case.
fn named(code: &str) -> Vec<Vec<String>> {
    let words = code.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
    let paths = words.filter(|word| word.contains("::") && !word.starts_with(':'));
    paths.map(|path| path.split("::").map(String::from).collect()).collect()
}

struct Crate {
    modules: BTreeMap<Module, String>,
    /// Where a re-exported name comes from.
    exports: BTreeMap<(Module, String), (Module, Vec<String>)>,
}

impl Crate {
    fn read(src: &Path) -> Self {
        let mut this = Self { modules: modules(src), exports: BTreeMap::new() };
        let mut exports = BTreeMap::new();
        for (module, text) in &this.modules {
            for path in imports(text).0 {
                let Some((from, rest)) = this.resolve(module, &path) else { continue };
                if let Some(name) = path.last().filter(|_| from != *module) {
                    exports.insert((module.clone(), name.clone()), (from, rest));
                }
            }
        }
        this.exports = exports;
        this
    }

    /// Goes down from `module` along `path` as far as there are modules.
    fn descend(&self, mut module: Module, path: &[String]) -> (Module, Vec<String>) {
        for (i, name) in path.iter().enumerate() {
            let below: Module = module.iter().cloned().chain([name.clone()]).collect();
            if !self.modules.contains_key(&below) {
                return (module, path[i..].to_vec());
            }
            module = below;
        }
        (module, Vec::new())
    }

    /// Returns the module that a path leads to, seen from `module`, and the rest of the path; `None` for another crate.
    fn resolve(&self, module: &Module, path: &[String]) -> Option<(Module, Vec<String>)> {
        let supers = path.iter().take_while(|name| *name == "super").count();
        let (start, rest) = match path.first()?.as_str() {
            "crate" => (Module::new(), &path[1..]),
            "self" => (module.clone(), &path[1..]),
            "super" => (module[..module.len().checked_sub(supers)?].to_vec(), &path[supers..]),
            first => {
                let below: Module = module.iter().cloned().chain([first.to_owned()]).collect();
                (self.modules.contains_key(&below).then(|| module.clone())?, path)
            }
        };
        let mut found = self.descend(start, rest);
        // A re-export leads on; a few are enough for every chain of them.
        for _ in 0..5 {
            let Some(name) = found.1.first() else { break };
            let Some((from, item)) = self.exports.get(&(found.0.clone(), name.clone())) else { break };
            let rest: Vec<String> = item.iter().cloned().chain(found.1[1..].iter().cloned()).collect();
            let next = self.descend(from.clone(), &rest);
            if next == found {
                break;
            }
            found = next;
        }
        Some(found)
    }

    fn imports(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |module: &Module, text: &str| {
            let paths = imports(text).1;
            let targets = paths.iter().filter_map(|path| self.resolve(module, path)).map(|(target, _)| target);
            targets.filter(|target| target != module && self.modules.contains_key(target)).collect()
        };
        self.modules.iter().map(|(module, text)| (module.clone(), of(module, text))).collect()
    }
}

/// Returns the modules that `from` reaches.
fn reach(graph: &BTreeMap<Module, BTreeSet<Module>>, from: &Module) -> BTreeSet<Module> {
    let mut seen = BTreeSet::new();
    let mut waiting: Vec<&Module> = graph[from].iter().collect();
    while let Some(module) = waiting.pop() {
        if seen.insert(module.clone()) {
            waiting.extend(&graph[module]);
        }
    }
    seen
}

#[test]
fn no_file_imports_itself_through_others() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap();
    let mut sources: Vec<PathBuf> =
        fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path().join("src")).collect();
    sources.extend(["benches/src", "reproduce/src", "xtask/src"].map(|folder| root.join(folder)));
    let (mut circles, mut files) = (Vec::new(), 0);
    for src in sources {
        let crate_name = src.strip_prefix(&root).unwrap().display().to_string();
        let graph = Crate::read(&src).imports();
        files += graph.len();
        for module in graph.keys().filter(|module| reach(&graph, module).contains(*module)) {
            let with: Vec<_> = reach(&graph, module)
                .into_iter()
                .filter(|other| other != module && reach(&graph, other).contains(module))
                .map(|other| other.join("::"))
                .collect();
            circles.push(format!("{crate_name}: {} with {}", module.join("::"), with.join(", ")));
        }
    }
    assert!(files > 300, "{files}");
    assert!(circles.is_empty(), "{circles:#?}");
}
