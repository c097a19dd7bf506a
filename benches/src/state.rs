//! What the caches hold when a measurement begins.

/// Number of bytes that are touched to flush the caches; more than the caches hold.
pub(crate) const FLUSH_BYTES: usize = 64 << 20;

/// State of the caches before a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    /// Nothing of the program and of the picture is in the caches: a program that runs once a second, between others.
    AllFlushed,
    /// The caches were flushed, then the program processed another frame: a camera has just written the picture.
    PictureFlushed,
    /// The program has just processed the same frame.
    Warm,
}

impl State {
    /// All states, in the order of the tables.
    pub(crate) const ALL: [Self; 3] = [Self::AllFlushed, Self::PictureFlushed, Self::Warm];

    /// Returns the name in tables and in the requests to the recipe.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::AllFlushed => "all flushed",
            Self::PictureFlushed => "picture flushed",
            Self::Warm => "warm",
        }
    }
}
