//! The reason why a chart cannot be drawn.

use std::io;

use plotters::drawing::DrawingAreaErrorKind;

/// The reason why a chart cannot be drawn. The message names the chart.
#[derive(Debug, thiserror::Error)]
#[error("{title}: {kind}")]
pub struct Error {
    title: String,
    kind: Kind,
}

/// What is wrong with a chart.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Kind {
    /// No point is finite.
    #[error("there is nothing to draw")]
    Empty,
    /// The library that draws has failed.
    #[error("cannot be drawn: {0}")]
    Drawing(DrawingAreaErrorKind<io::Error>),
}

impl Error {
    pub(crate) fn new(title: &str, kind: Kind) -> Self {
        Self { title: title.to_owned(), kind }
    }
    /// Returns what is wrong.
    pub fn kind(&self) -> &Kind {
        &self.kind
    }
}
