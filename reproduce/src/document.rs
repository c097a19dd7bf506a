//! Puts sections into documents, so that one study can be measured again alone.

use anyhow::anyhow;

use crate::section::{begin_mark, end_mark};

const HEAD: &str = "# Reproduction

This page compares our numbers with the published ones. `cargo xtask reproduce` writes it; the command in a section
writes that section alone. [The papers](papers.md) has each printed number next to ours. Every picture follows from its
seed and every answer from its picture, so every machine finds the same numbers.

Sources: **[BB]** Braun & Barf 2022, **[W]** Wang, Wang & Jin 2022, **[B14]** Barf 2014, **[H15]** Barf et al. 2015.
NEES is the squared error over the covariance, with two degrees of freedom: its mean is 2 for an honest covariance and
larger for one that is too small.

The value of a figure depends on what the sensor knows about the scene, so every section says this. **In-sample**: limb
height or edge errors were fitted to the scene that is measured, or chosen on it. **Out of sample**: they come from
other scenes. Values that were measured on other seeds of the same scene are between the two: clouds and noise differ,
air and detector are the same. Sections without these words are calculations.
";

const PAPERS_HEAD: &str = "# The papers, number by number

hzn was built from four documents. This page has the numbers that they print, as a reading line by line noted them, each
with its statistic and with our number in the same statistic. `cargo xtask reproduce papers` writes the page from the
tables in `reproduce/papers`. Each number of ours is on the page that is linked in its row; a test compares the two. The
command of a row measures our number, or works with our setting.

| verdict | meaning |
|---|---|
| better, worse | the same statistic of the same quantity, with a smaller or a larger error |
| same | the same value, or a difference that is within the scatter of our own figures |
| different | another value: a misprint, or a choice; the reason is in the row |
| not comparable | the paper prints no value; the reason and ours are in the row |
| open | nobody has measured our number in this statistic; the row says what has to be run |

Numbers of figures are read off. Where the reading did not note the figure, the place has the range. \"No value is read
off\" means that the reading noted a curve or a picture without a number. The pictures of the papers are not public, so
ours are rendered, and a verdict holds for the scenes of its page.
";

/// Document that contains sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Document {
    /// The file book/results/reproduction.md, which consists of sections only.
    Reproduction,
    /// The file book/theory/methods.md, which has marked places for some sections.
    Methods,
    /// The file book/results/papers.md, with one section.
    Papers,
}

impl Document {
    /// Returns its path in the book.
    pub(crate) const fn file(self) -> &'static str {
        match self {
            Self::Reproduction => "results/reproduction.md",
            Self::Methods => "theory/methods.md",
            Self::Papers => "results/papers.md",
        }
    }
    /// Returns the text of the document with the section `name` in its place. `names` are the sections of the document
    /// in their order. In `Methods`, the marks of the section must exist.
    pub(crate) fn put(self, text: &str, names: &[&str], name: &str, section: &str) -> anyhow::Result<String> {
        match self {
            Self::Reproduction => Ok(join_sections(HEAD, text, names, name, section)),
            Self::Papers => Ok(join_sections(PAPERS_HEAD, text, names, name, section)),
            Self::Methods => {
                let old = find_section(text, name).ok_or_else(|| {
                    anyhow!("{}: the marks {} and {} are missing", self.file(), begin_mark(name), end_mark(name))
                })?;
                Ok(text.replace(old, section))
            }
        }
    }
}

/// Returns the section of a study in a document, if its marks are there.
pub(crate) fn find_section<'a>(document: &'a str, name: &str) -> Option<&'a str> {
    let from = document.find(&begin_mark(name))?;
    let rest = &document[from..];
    let to = rest.find(&end_mark(name))? + end_mark(name).len();
    Some(&rest[..to])
}

/// Returns a document of sections only, with this section in its place. The other sections stay, in the order of
/// `names`.
fn join_sections(head: &str, document: &str, names: &[&str], name: &str, section: &str) -> String {
    let mut out = head.to_owned();
    for &other in names {
        let text = if other == name { Some(section) } else { find_section(document, other) };
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
    use crate::section::Section;

    #[test]
    fn a_section_is_replaced_and_the_others_stay_in_order() {
        let section = |word: &str, name: &str| {
            let mut s = Section::default();
            s.text(word);
            s.markdown(name, "Title")
        };
        let names = ["a", "b", "c"];
        let put = |text: &str, name: &str, word: &str| {
            Document::Reproduction.put(text, &names, name, &section(word, name)).unwrap()
        };
        let document = put("", "b", "second");
        let document = put(&document, "a", "first");
        assert!(document.find("first").unwrap() < document.find("second").unwrap());
        let again = put(&document, "b", "changed");
        assert!(again.contains("first") && again.contains("changed") && !again.contains("second"));
        assert_eq!(put(&again, "b", "second"), document);
    }

    #[test]
    fn a_section_among_other_text_is_replaced() {
        let old = Section::default().markdown("a", "Title");
        let mut new = Section::default();
        new.text("measured");
        let new = new.markdown("a", "Title");
        let put = |text: &str| Document::Methods.put(text, &["a"], "a", &new);
        assert_eq!(put(&format!("before\n{old}after\n")).unwrap(), format!("before\n{new}after\n"));
        assert!(put("no marks").unwrap_err().to_string().contains(&begin_mark("a")));
    }
}
