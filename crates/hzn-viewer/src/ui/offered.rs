//! The plots that a sequence offers, kept until the results change.

/// Names of the plots that have a value.
#[derive(Debug, Default)]
pub(super) struct Offered {
    /// State of the results, body, and whether there is no truth: what the names belong to.
    pub(super) of: Option<(u64, usize, bool)>,
    /// Names of the quantities.
    pub(super) names: Vec<&'static str>,
}
