//! The papers, number by number: each that they print next to ours, from the tables in `reproduce/papers`. A row
//! that is incomplete, or quotes a number that its page no longer has, is an error.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use serde::Deserialize;

use super::setup::Effort;
use crate::section::Section;

/// The tables, one for each paper or pair of papers: name of the file and text.
const TABLES: [(&str, &str); 3] = [
    ("braun-barf-2022.toml", include_str!("../../papers/braun-barf-2022.toml")),
    ("wang-2022.toml", include_str!("../../papers/wang-2022.toml")),
    ("horace.toml", include_str!("../../papers/horace.toml")),
];

/// Beginning of `ours` where nobody has measured the printed statistic yet; only a row with the verdict `open` has it.
const UNMEASURED: &str = "not measured";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    title: String,
    rows: Vec<Row>,
}

/// Printed number with ours. Every field is required, so that no cell of the page can be left out.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    /// Equation, section, table or figure.
    place: String,
    /// Quantity with its conditions.
    quantity: String,
    /// The number as printed, or as read off a figure.
    printed: String,
    /// Statistic of the printed number: maximum, 3σ, RMS, setting.
    statistic: String,
    /// Our number in the same statistic; each of its digits is on `page`.
    ours: String,
    verdict: Verdict,
    /// Reason of the difference; for a row that cannot be compared, what is missing.
    why: String,
    /// Command that measures our number, or works with our setting.
    command: String,
    /// Page of the book with our number and its heading: `results/reproduction.md#heading`.
    page: String,
}

/// Comparison of our number with the printed one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Verdict {
    Better,
    Same,
    Different,
    Worse,
    NotComparable,
    Open,
}

impl Verdict {
    const ALL: [Self; 6] = [Self::Better, Self::Same, Self::Different, Self::Worse, Self::NotComparable, Self::Open];

    const fn name(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Same => "same",
            Self::Different => "different",
            Self::Worse => "worse",
            Self::NotComparable => "not comparable",
            Self::Open => "open",
        }
    }
}

/// Returns the root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Reads a table; `file` is its name in messages.
fn parse(file: &str, text: &str) -> anyhow::Result<Paper> {
    Ok(hzn_files::document::parse(text, Path::new(file), |_: &Paper| Ok(()))?)
}

/// Fails if a cell is empty, the command or the page does not exist, or the page does not have our number.
fn check(row: &Row, root: &Path) -> anyhow::Result<()> {
    let Row { place, quantity, printed, statistic, ours, verdict, why, command, page } = row;
    let cells = [
        ("place", place),
        ("quantity", quantity),
        ("printed", printed),
        ("statistic", statistic),
        ("ours", ours),
        ("why", why),
        ("command", command),
        ("page", page),
    ];
    for (name, cell) in cells {
        ensure!(!cell.trim().is_empty(), "{name} is empty; if there is no number, say which measurement shows why");
        let is_open = *verdict == Verdict::Open && name == "ours";
        ensure!(
            cell.starts_with(UNMEASURED) == is_open,
            "{name}: every row needs a number of ours, or the reason why it has none"
        );
        ensure!(!cell.contains(['|', '\n']), "{name}: a vertical bar or a line break would end the cell of the table");
    }
    check_command(command, root)?;
    let quoted = section_of(&root.join("book"), page)?;
    let known = numbers(&quoted);
    match numbers(ours).into_iter().find(|number| !known.contains(number)) {
        Some(number) => bail!("{page} does not have the number {number} of `ours`; has it been measured again?"),
        None => Ok(()),
    }
}

/// Fails if the command is no study, no chore of `cargo xtask`, no test of the whole chain and no command of `hzn`. The
/// sources list them.
fn check_command(command: &str, root: &Path) -> anyhow::Result<()> {
    let lists = |file: &str, entry: String| -> anyhow::Result<bool> {
        Ok(std::fs::read_to_string(root.join(file)).with_context(|| file.to_owned())?.contains(&entry))
    };
    let words: Vec<&str> = command.split_whitespace().collect();
    let is_known = match words.as_slice() {
        ["cargo", "xtask", "reproduce", study] => lists("reproduce/src/studies/mod.rs", format!("\"{study}\", "))?,
        ["cargo", "test", "-p", "hzn-tests", "--test", "chain", test, ..] => {
            let (file, name) = test.split_once("::").ok_or_else(|| anyhow!("{test}: file::test is expected"))?;
            lists(&format!("tests/tests/chain/{file}.rs"), format!("fn {name}"))?
        }
        ["cargo", "xtask", rest @ ..] => lists("xtask/src/main.rs", format!("  {} ", rest.join(" ")))?,
        ["hzn", name, ..] => {
            let commands = root.join("crates/hzn-cli/src/commands");
            commands.join(format!("{name}.rs")).is_file() || commands.join(name).is_dir()
        }
        _ => false,
    };
    ensure!(is_known, "there is no command `{command}`");
    Ok(())
}

/// Returns the part of a page of the book that a link leads to: from its heading to the next one of the same level.
fn section_of(book: &Path, link: &str) -> anyhow::Result<String> {
    let (file, anchor) =
        link.split_once('#').ok_or_else(|| anyhow!("page {link}: the heading is missing: page.md#heading"))?;
    let text = std::fs::read_to_string(book.join(file)).with_context(|| format!("page {file}"))?;
    let (mut section, mut is_code) = (String::new(), false);
    let mut level: Option<usize> = None;
    for line in text.lines() {
        is_code ^= line.starts_with("```");
        let depth = line.bytes().take_while(|b| *b == b'#').count();
        if depth > 0 && !is_code {
            if level.is_some_and(|level| depth <= level) {
                break;
            }
            if level.is_none() && slug(&line[depth..]) == anchor {
                level = Some(depth);
            }
        }
        if level.is_some() {
            section.push_str(line);
            section.push('\n');
        }
    }
    ensure!(!section.is_empty(), "page {file} has no heading #{anchor}");
    Ok(section)
}

/// Returns the anchor that MkDocs gives a heading.
fn slug(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || c.is_whitespace() || *c == '_' || *c == '-';
    let text: String = heading.chars().filter(kept).flat_map(char::to_lowercase).collect();
    text.split(|c: char| c.is_whitespace() || c == '-').filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-")
}

/// Returns the numbers in a text, without signs and units.
fn numbers(text: &str) -> Vec<&str> {
    let parts = text.split(|c: char| !c.is_ascii_digit() && c != '.').map(|part| part.trim_matches('.'));
    parts.filter(|part| !part.is_empty()).collect()
}

/// Returns the link from the page of the papers to another page of the book.
fn link(page: &str) -> String {
    page.strip_prefix("results/").map_or_else(|| format!("../{page}"), str::to_owned)
}

/// Makes the tables of all papers from their files, after a check of every row.
pub(super) fn compare(_: &Effort) -> anyhow::Result<Section> {
    let mut papers = Vec::new();
    for (file, text) in TABLES {
        let paper = parse(file, text)?;
        for row in &paper.rows {
            check(row, &root()).with_context(|| format!("{file}: {}: {}", row.place, row.quantity))?;
        }
        papers.push(paper);
    }
    let mut s = Section::default();
    let count = |verdict: Verdict| {
        let rows = papers.iter().flat_map(|paper| &paper.rows).filter(|row| row.verdict == verdict).count();
        format!("{rows} {}", verdict.name())
    };
    s.text(format!(
        "{} rows: {}.",
        papers.iter().map(|paper| paper.rows.len()).sum::<usize>(),
        Verdict::ALL.map(count).join(", ")
    ));
    for paper in &papers {
        s.text(format!("### {}", paper.title));
        let head =
            ["place", "quantity", "printed", "its statistic", "ours, same statistic", "verdict", "why", "command"];
        s.prose_table(head, paper.rows.iter().map(Row::cells));
    }
    Ok(s)
}

impl Row {
    fn cells(&self) -> Vec<String> {
        let command = format!("`{}` ([page]({}))", self.command, link(&self.page));
        let verdict = self.verdict.name();
        let cells =
            [self.place.as_str(), &self.quantity, &self.printed, &self.statistic, &self.ours, verdict, &self.why];
        cells.into_iter().map(str::to_owned).chain([command]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a row that is right.
    fn row() -> Row {
        Row {
            place: "abstract".into(),
            quantity: "error of the nadir".into(),
            printed: "0.04°".into(),
            statistic: "RMS".into(),
            ours: "20 km".into(),
            verdict: Verdict::Same,
            why: "it is an example".into(),
            command: "cargo xtask reproduce infrared".into(),
            page: "theory/methods.md#values-of-horace".into(),
        }
    }

    fn error(change: impl FnOnce(&mut Row)) -> String {
        let mut row = row();
        change(&mut row);
        format!("{:#}", check(&row, &root()).unwrap_err())
    }

    #[test]
    fn a_row_with_a_fault_is_refused() {
        check(&row(), &root()).unwrap();
        let fields: [fn(&mut Row) -> &mut String; 8] = [
            |r| &mut r.place,
            |r| &mut r.quantity,
            |r| &mut r.printed,
            |r| &mut r.statistic,
            |r| &mut r.ours,
            |r| &mut r.why,
            |r| &mut r.command,
            |r| &mut r.page,
        ];
        for field in fields {
            assert!(error(|r| *field(r) = " ".into()).contains(" is empty"));
            assert!(error(|r| field(r).push('|')).contains("vertical bar"));
        }
        for field in fields {
            assert!(error(|r| *field(r) = format!("{UNMEASURED} in this statistic")).contains("needs a number"));
        }
        assert!(error(|r| r.ours = "21.5 km".into()).contains("does not have the number 21.5"));
    }

    #[test]
    fn unknown_commands_and_pages_are_refused() {
        let command = |text: &str| check_command(text, &root());
        for known in ["cargo xtask bench ransac", "hzn sensitivity --fov 94.4", "hzn fuse --show-config"] {
            command(known).unwrap();
        }
        command("cargo test -p hzn-tests --test chain published::wang -- --nocapture").unwrap();
        assert!(command("cargo test -p hzn-tests --test chain published::tang").is_err());
        for unknown in ["cargo xtask reproduce weather", "cargo xtask brew", "hzn dance", "make", "hzn"] {
            assert!(command(unknown).unwrap_err().to_string().contains("no command"), "{unknown}");
        }
        assert!(error(|r| r.page = "theory/methods.md".into()).contains("heading is missing"));
        assert!(error(|r| r.page = "theory/none.md#presets".into()).contains("theory/none.md"));
        assert!(error(|r| r.page = "theory/methods.md#none".into()).contains("no heading #none"));
    }

    #[test]
    fn a_table_without_a_field_is_refused() {
        let (file, text) = TABLES[0];
        let cut = |field: &str| {
            let start = text.find(&format!("\n{field} = ")).unwrap() + 1;
            let end = start + text[start..].find('\n').unwrap() + 1;
            parse(file, &format!("{}{}", &text[..start], &text[end..])).unwrap_err().to_string()
        };
        for field in ["place", "quantity", "printed", "statistic", "ours", "verdict", "why", "command", "page"] {
            assert!(cut(field).contains(field), "{field}: {}", cut(field));
        }
    }

    #[test]
    fn anchors_are_those_of_the_site() {
        assert_eq!(slug(" Criteria of HORACE: [B14], [H15]"), "criteria-of-horace-b14-h15");
        assert_eq!(slug(" Braun & Barf 2022"), "braun-barf-2022");
        assert_eq!(slug(" Sub-pixel: `edge_points.sub_pixel`"), "sub-pixel-edge_pointssub_pixel");
    }
}
