//! Section of a document: text, tables and figures of one study, between marks.

use std::path::Path;

use anyhow::Context;
use hzn_plot::Chart;

/// Result of a study.
#[derive(Debug, Default)]
pub(crate) struct Section {
    parts: Vec<Part>,
}

#[derive(Debug)]
enum Part {
    Text(String),
    Table { align: &'static str, head: Vec<String>, rows: Vec<Vec<String>> },
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
        self.add_table("---:|", head, rows);
    }
    /// Adds a table of words; all columns are left-aligned.
    pub(crate) fn prose_table<H: Into<String>>(
        &mut self,
        head: impl IntoIterator<Item = H>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) {
        self.add_table("---|", head, rows);
    }
    fn add_table<H: Into<String>>(
        &mut self,
        align: &'static str,
        head: impl IntoIterator<Item = H>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) {
        let head = head.into_iter().map(Into::into).collect();
        self.parts.push(Part::Table { align, head, rows: rows.into_iter().collect() });
    }
    /// Adds a chart, which becomes `figures/NAME.svg`.
    pub(crate) fn figure(&mut self, name: &str, chart: &Chart) -> anyhow::Result<()> {
        let svg = chart.svg()?;
        self.parts.push(Part::Figure { file: format!("figures/{name}.svg"), alt: chart.title.clone(), svg });
        Ok(())
    }

    /// Returns the section as Markdown, with its marks.
    pub(crate) fn markdown(&self, name: &str, title: &str) -> String {
        let mut out = format!("{}\n## {title}\n\n`cargo xtask reproduce {name}`\n", begin_mark(name));
        for part in &self.parts {
            out.push('\n');
            match part {
                Part::Text(text) => out.push_str(&format!("{text}\n")),
                Part::Table { align, head, rows } => {
                    out.push_str(&format!("| {} |\n|---|{}\n", head.join(" | "), align.repeat(head.len() - 1)));
                    rows.iter().for_each(|row| out.push_str(&format!("| {} |\n", row.join(" | "))));
                }
                Part::Figure { file, alt, .. } => out.push_str(&format!("![{alt}]({file})\n")),
            }
        }
        out + &end_mark(name)
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

/// Returns the mark in front of a section.
pub(crate) fn begin_mark(name: &str) -> String {
    format!("<!-- study {name} -->")
}

/// Returns the mark behind a section.
pub(crate) fn end_mark(name: &str) -> String {
    format!("<!-- end of {name} -->\n")
}
