//! Puts sections into documents, between marks, so that one study can be measured again alone.

use std::path::Path;

use anyhow::{Context, anyhow};
use hzn_cli::plot::Chart;

use crate::studies::{ALL, Study};

const HEAD: &str = "# Reproduction

This page compares our numbers with the published ones. `cargo xtask reproduce` writes it; the command in a section
writes that section alone. Every picture follows from its seed and every answer from its picture, so every machine finds
the same numbers.

Sources: **[BB]** Braun & Barf 2022, **[W]** Wang, Wang & Jin 2022, **[B14]** Barf 2014, **[H15]** Barf et al. 2015.
NEES is the squared error over the covariance, with two degrees of freedom: its mean is 2 for an honest covariance and
larger for one that is too small.

The value of a figure depends on what the sensor knows about the scene, so every section says this. **In-sample**: limb
height or edge errors were fitted to the scene that is measured, or chosen on it. **Out of sample**: they come from
other scenes. Values that were measured on other seeds of the same scene are between the two: clouds and noise differ,
air and detector are the same. Sections without these words are calculations.
";

/// Document that contains sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Document {
    /// The file book/results/reproduction.md, which consists of sections only.
    Reproduction,
    /// The file book/theory/methods.md, which has marked places for some sections.
    Methods,
}

impl Document {
    /// Returns its path in the book.
    pub(crate) const fn file(self) -> &'static str {
        match self {
            Self::Reproduction => "results/reproduction.md",
            Self::Methods => "theory/methods.md",
        }
    }
    /// Returns the text of the document with the section of `study` in its place. In `Methods`, the marks of the
    /// section must exist.
    pub(crate) fn put(self, text: &str, study: &Study, section: &str) -> anyhow::Result<String> {
        match self {
            Self::Reproduction => Ok(put(text, study.name, section)),
            Self::Methods => {
                let old = find(text, study.name).ok_or_else(|| {
                    anyhow!("{}: the marks {} and {} are missing", self.file(), begin(study.name), end(study.name))
                })?;
                Ok(text.replace(old, section))
            }
        }
    }
}

/// Result of a study.
#[derive(Debug, Default)]
pub(crate) struct Section {
    parts: Vec<Part>,
}

#[derive(Debug)]
enum Part {
    Text(String),
    Table { head: Vec<String>, rows: Vec<Vec<String>> },
    Figure { file: String, alt: String, svg: String },
}

impl Section {
    /// Adds a paragraph of Markdown.
    pub(crate) fn text(&mut self, text: impl Into<String>) {
        self.parts.push(Part::Text(text.into()));
    }
    /// Adds a table; the first column is left-aligned, the others are right-aligned.
    pub(crate) fn table<H: Into<String>>(
        &mut self,
        head: impl IntoIterator<Item = H>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) {
        let head = head.into_iter().map(Into::into).collect();
        self.parts.push(Part::Table { head, rows: rows.into_iter().collect() });
    }
    /// Adds a chart, which becomes `figures/NAME.svg`.
    pub(crate) fn figure(&mut self, name: &str, chart: &Chart) -> anyhow::Result<()> {
        let svg = chart.svg()?;
        self.parts.push(Part::Figure { file: format!("figures/{name}.svg"), alt: chart.title.clone(), svg });
        Ok(())
    }

    /// Returns the section as Markdown, with its marks.
    pub(crate) fn markdown(&self, name: &str, title: &str) -> String {
        let mut out = format!("{}\n## {title}\n\n`cargo xtask reproduce {name}`\n", begin(name));
        for part in &self.parts {
            out.push('\n');
            match part {
                Part::Text(text) => out.push_str(&format!("{text}\n")),
                Part::Table { head, rows } => {
                    out.push_str(&format!("| {} |\n|---|{}\n", head.join(" | "), "---:|".repeat(head.len() - 1)));
                    rows.iter().for_each(|row| out.push_str(&format!("| {} |\n", row.join(" | "))));
                }
                Part::Figure { file, alt, .. } => out.push_str(&format!("![{alt}]({file})\n")),
            }
        }
        out + &end(name)
    }

    /// Writes the figures below the docs folder.
    pub(crate) fn write_figures(&self, docs: &Path) -> anyhow::Result<()> {
        for part in &self.parts {
            if let Part::Figure { file, svg, .. } = part {
                let path = docs.join(file);
                if let Some(folder) = path.parent() {
                    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
                }
                std::fs::write(&path, svg).with_context(|| path.display().to_string())?;
            }
        }
        Ok(())
    }
}

fn begin(name: &str) -> String {
    format!("<!-- study {name} -->")
}
fn end(name: &str) -> String {
    format!("<!-- end of {name} -->\n")
}

/// Returns the section of a study in a document, if its marks are there.
fn find<'a>(document: &'a str, name: &str) -> Option<&'a str> {
    let from = document.find(&begin(name))?;
    let rest = &document[from..];
    let to = rest.find(&end(name))? + end(name).len();
    Some(&rest[..to])
}

/// Returns book/results/reproduction.md with this section in its place. The other sections stay, in the order of the
/// studies.
fn put(document: &str, name: &str, section: &str) -> String {
    let mut out = HEAD.to_owned();
    for study in ALL.iter().filter(|s| s.document == Document::Reproduction) {
        let text = if study.name == name { Some(section) } else { find(document, study.name) };
        if let Some(text) = text {
            out.push('\n');
            out.push_str(text);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_is_replaced_and_the_others_stay_in_order() {
        let section = |word: &str, name: &str| {
            let mut s = Section::default();
            s.text(word);
            s.markdown(name, "Title")
        };
        let [a, b] = [ALL[0].name, ALL[1].name];
        let document = put("", b, &section("second", b));
        let document = put(&document, a, &section("first", a));
        assert!(document.find("first").unwrap() < document.find("second").unwrap());
        let again = put(&document, b, &section("changed", b));
        assert!(again.contains("first") && again.contains("changed") && !again.contains("second"));
        assert_eq!(put(&again, b, &section("second", b)), document);
    }

    #[test]
    fn a_section_among_other_text_is_replaced() {
        let study = ALL.iter().find(|s| s.document == Document::Methods).unwrap();
        let old = Section::default().markdown(study.name, study.title);
        let mut new = Section::default();
        new.text("measured");
        let new = new.markdown(study.name, study.title);
        let put = |text: &str| study.document.put(text, study, &new);
        assert_eq!(put(&format!("before\n{old}after\n")).unwrap(), format!("before\n{new}after\n"));
        assert!(put("no marks").unwrap_err().to_string().contains(&begin(study.name)));
    }

    #[test]
    fn the_documents_hold_every_study_and_its_figures() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../book");
        let text = |document: Document| std::fs::read_to_string(docs.join(document.file())).unwrap();
        for study in ALL {
            let document = text(study.document);
            let section = find(&document, study.name).unwrap_or_else(|| panic!("{} was not run", study.name));
            assert!(section.contains(study.title), "{}", study.name);
        }
        for figure in text(Document::Reproduction).split("](figures/").skip(1) {
            let file = figure.split(')').next().unwrap();
            assert!(docs.join("results/figures").join(file).is_file(), "{file}");
        }
    }
}
