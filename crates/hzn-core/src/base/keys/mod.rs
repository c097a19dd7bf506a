//! The keys of sensor.toml. Each key has one entry, next to the code that reads it.
//!
//! The macro `section!` declares the structure of a section, its defaults and its table of keys together. The macro
//! `choices!` declares an enumeration whose variants are words in sensor.toml. Everything else comes from these
//! entries: the checks and their messages, the parameters of a flight computer by number, and, on the ground, the table
//! in the documentation, the commented template, the JSON schema and the sliders of the viewer.
//!
//! ```text
//! section! {
//!     /// What the section is for.
//!     "consensus" pub struct Config {
//!         /// One sentence: the meaning that every table shows.
//!         ///
//!         /// More for the reader of the Rust documentation.
//!         @81 threshold_px: f64 = 3.0, [above 0.0 to 1000.0];
//!     }
//! }
//! ```
//!
//! Each line has the number in flight (`@-` for a key that exists on the ground only), the name, the type, the default
//! and the limits.

mod choices;
mod notation;
mod section;
mod values;

use crate::base::error::ConfigError;
use crate::base::packed::Unpacker;
pub(crate) use choices::choices;
pub(crate) use notation::{check, feature_name, flight, lacks, limit, limits, needs, option, place, unpack};
pub(crate) use section::{section, table};
pub(crate) use values::check_number;

/// One key of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// The key with its section, for example `consensus.threshold_px`.
    pub path: &'static str,
    /// The meaning: one sentence, then an empty line and the details.
    pub doc: &'static str,
    /// The form of the value.
    pub form: Form,
    /// The values that are accepted.
    pub limits: Limits,
    /// The words that the value may be; empty for a value that is not a word.
    pub choices: &'static [Choice],
    /// The feature of this crate that reads the key. Without the feature only the default is accepted.
    pub feature: Option<&'static str>,
    /// The text that the documentation shows for a missing value when there is no default number.
    pub unset: Option<&'static str>,
    /// An example value in TOML, for a key without a default.
    pub example: Option<&'static str>,
    /// The first number of the key among the parameters of a flight computer; `None` for a key on the ground only.
    pub flight: Option<u16>,
}

impl Key {
    /// Returns the section, for example `consensus`.
    pub fn section(&self) -> &'static str {
        self.path.split_once('.').map_or("", |(section, _)| section)
    }
    /// Returns the name without its section, for example `threshold_px`.
    pub fn name(&self) -> &'static str {
        self.path.split_once('.').map_or(self.path, |(_, name)| name)
    }
    /// Returns the meaning in one sentence; its lines are those of the source.
    pub fn sentence(&self) -> &'static str {
        self.doc.split("\n\n").next().unwrap_or_default().trim()
    }
}

impl Key {
    /// Returns the unit that the name ends in, for example `px`, `km`, `deg`, `deg/s`; empty for plain numbers.
    pub fn unit(&self) -> &'static str {
        // The longer ends come first, because `_s` would also match `_deg_s`.
        let ends = [("_deg_s", "deg/s"), ("_px", "px"), ("_km", "km"), ("_deg", "deg"), ("_percent", "%"), ("_s", "s")];
        ends.into_iter().find(|(end, _)| self.path.ends_with(end)).map_or("", |(_, unit)| unit)
    }
    /// Returns the choice of the section's `method` to which the key applies; `None` for a key that always applies.
    pub fn method(&self) -> Option<&'static str> {
        self.doc.trim_start().strip_prefix("For `")?.split('`').next().filter(|word| *word != "earth")
    }
}

/// A section with its keys.
///
/// ```
/// use hzn_core::config::SECTIONS;
///
/// let keys = SECTIONS.iter().flat_map(|section| section.keys);
/// let in_flight = keys.filter(|key| key.flight.is_some()).count();
/// assert!(in_flight > 50);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// The name of the section, for example `consensus`.
    pub name: &'static str,
    /// The purpose of the section.
    pub doc: &'static str,
    /// The keys of the section, in the order of the documentation.
    pub keys: &'static [Key],
}

/// The form of a value in sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Form {
    /// A number.
    Number,
    /// A whole number.
    Whole,
    /// `true` or `false`.
    Flag,
    /// One of a few words.
    Word,
    /// One of a few words, or a number.
    WordOrNumber,
    /// A list of numbers.
    Numbers,
    /// A list of lists of numbers.
    Rows,
    /// A list of polygons, each a list of corners.
    Polygons,
    /// A table with keys of its own.
    Table,
}

/// The values that a key accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Limits {
    /// A number, or every number of a list.
    Number {
        /// The smallest value.
        low: f64,
        /// Whether the smallest value itself is excluded.
        above: bool,
        /// The largest value; infinite when there is no upper limit.
        high: f64,
    },
    /// One of the key's choices.
    Choice,
    /// A rule in words; the code of the section checks it.
    Rule(&'static str),
}

/// A word that a key accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// The word in sensor.toml.
    pub name: &'static str,
    /// The meaning: one sentence, then an empty line and the details.
    pub doc: &'static str,
    /// The feature of this crate that the choice needs.
    pub feature: Option<&'static str>,
    /// Whether the choice is in this build.
    pub is_built: bool,
    /// The number of the choice in flight; `None` for a choice on the ground only.
    pub flight: Option<u16>,
}

/// The type of a key's value.
// The methods have defaults that do nothing, so that a type on the ground only needs no code for flight.
pub trait Value: Clone + PartialEq {
    /// Form of the value in a file.
    const FORM: Form;
    /// The words that the value may be.
    const CHOICES: &'static [Choice] = &[];
    /// Count of the numbers that the value has in flight.
    const NUMBERS: u16 = 1;

    /// Checks every number of the value, or that its word is in this build.
    ///
    /// # Errors
    /// Returns the number that is out of its limits, or the feature that is missing.
    fn check(&self, _path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        Ok(())
    }
    /// Refuses the bytes of a prepared sensor if a number of the value is out of its limits.
    #[doc(hidden)]
    fn limit(&self, _from: &mut Unpacker<'_>, _low: f64, _above: bool, _high: f64) {}
    /// Returns the number at `place` (from 0) in flight; NaN if there is none.
    fn number(&self, _place: u16) -> f64 {
        f64::NAN
    }
    /// Sets the number at `place`; `None` when the value cannot have this number.
    fn set_number(&mut self, _place: u16, _number: f64) -> Option<()> {
        None
    }
    /// Returns whether a file leaves the value out.
    fn is_absent(&self) -> bool {
        false
    }
    /// Returns a value for [`Self::set_number`] to fill; `None` for a type that is not in flight.
    fn empty() -> Option<Self> {
        None
    }
}

/// A section of sensor.toml.
pub trait Section: Sized {
    /// The name and the keys of the section.
    const TABLE: Table;

    /// Checks each key on its own.
    ///
    /// # Errors
    /// Returns the first value that is out of its limits.
    fn check_keys(&self) -> Result<(), ConfigError>;
    /// Returns the path of the key that has this number in flight.
    fn path(id: u16) -> Option<&'static str>;
    /// Returns the value of a number in flight.
    fn number(&self, id: u16) -> Option<f64>;
    /// Sets the value of a number in flight. `None` when no key has the number, `Some(false)` when its key cannot have
    /// the value.
    fn set_number(&mut self, id: u16, number: f64) -> Option<bool>;
    /// Returns the first key on the ground only whose value differs from that of another configuration.
    fn differing_on_ground(&self, other: &Self) -> Option<&'static str>;
    /// The first number in flight of each key, and the count of its numbers.
    const NUMBERS: &'static [(Option<u16>, u16)];
}
