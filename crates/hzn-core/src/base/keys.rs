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
//!     "reject" pub struct Config {
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

use crate::base::error::{ConfigError, Limit, require};

/// One key of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Key {
    /// The key with its section, for example `reject.threshold_px`.
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
    /// Returns the section, for example `reject`.
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
        let ends = [("_deg_s", "deg/s"), ("_px", "px"), ("_km", "km"), ("_deg", "deg"), ("_percent", "%"), ("_s", "s")];
        ends.into_iter().find(|(end, _)| self.path.ends_with(end)).map_or("", |(_, unit)| unit)
    }
    /// Returns the choice of the section's `method` to which the key applies; `None` for a key that always applies.
    pub fn method(&self) -> Option<&'static str> {
        self.doc.trim_start().strip_prefix("For `")?.split('`').next().filter(|word| *word != "earth")
    }
}

/// A section with its keys.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// The name of the section, for example `reject`.
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
pub trait Value: Clone + PartialEq {
    /// Form of the value in a file.
    const FORM: Form;
    /// The words that the value may be.
    const CHOICES: &'static [Choice] = &[];
    /// How many numbers the value has in flight.
    const NUMBERS: u16 = 1;

    /// Checks every number of the value, or that its word is in this build.
    ///
    /// # Errors
    /// Returns the number that is out of its limits, or the feature that is missing.
    fn check(&self, _path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        Ok(())
    }
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
    /// The first number in flight of each key, and how many numbers the key has.
    const NUMBERS: &'static [(Option<u16>, u16)];
}

/// Checks one number. Every key calls this one copy in flash.
#[inline(never)]
pub(crate) fn check_number(path: &'static str, x: f64, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
    require(x.is_finite(), path, x, Limit::Finite)?;
    require(!above || x > low, path, x, Limit::Above(low))?;
    let limit = if high.is_finite() { Limit::Between(low, high) } else { Limit::AtLeast(low) };
    require(x >= low && x <= high, path, x, limit)
}

impl Value for f64 {
    const FORM: Form = Form::Number;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        check_number(path, *self, low, above, high)
    }
    fn number(&self, _place: u16) -> f64 {
        *self
    }
    fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
        *self = Some(number).filter(|x| x.is_finite())?;
        Some(())
    }
    fn empty() -> Option<Self> {
        Some(0.0)
    }
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl Value for $t {
            const FORM: Form = Form::Whole;
            fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
                check_number(path, f64::from(*self), low, above, high)
            }
            fn number(&self, _place: u16) -> f64 {
                f64::from(*self)
            }
            fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
                let whole = number as $t;
                *self = (f64::from(whole) == number).then_some(whole)?;
                Some(())
            }
            fn empty() -> Option<Self> {
                Some(0)
            }
        }
    )*};
}
whole!(u8, u16, u32);

impl Value for bool {
    const FORM: Form = Form::Flag;
}

impl<T: Value> Value for Option<T> {
    const FORM: Form = T::FORM;
    const CHOICES: &'static [Choice] = T::CHOICES;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.as_ref().map_or(Ok(()), |value| value.check(path, low, above, high))
    }
    fn number(&self, place: u16) -> f64 {
        self.as_ref().map_or(f64::NAN, |value| value.number(place))
    }
    /// NaN leaves the value out.
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        if number.is_nan() {
            *self = None;
            return Some(());
        }
        let mut value = T::empty()?;
        value.set_number(place, number)?;
        *self = Some(value);
        Some(())
    }
    fn is_absent(&self) -> bool {
        self.is_none()
    }
}

impl<const N: usize> Value for [f64; N] {
    const FORM: Form = Form::Numbers;
    const NUMBERS: u16 = N as u16;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.iter().try_for_each(|x| check_number(path, *x, low, above, high))
    }
    fn number(&self, place: u16) -> f64 {
        self.get(usize::from(place)).copied().unwrap_or(f64::NAN)
    }
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        *self.get_mut(usize::from(place))? = Some(number).filter(|x| x.is_finite())?;
        Some(())
    }
}

impl<const N: usize> Value for heapless::Vec<f64, N> {
    const FORM: Form = Form::Numbers;
    const NUMBERS: u16 = N as u16;
    fn check(&self, path: &'static str, low: f64, above: bool, high: f64) -> Result<(), ConfigError> {
        self.iter().try_for_each(|x| check_number(path, *x, low, above, high))
    }
    /// Returns 0 when the list ends before `place`.
    fn number(&self, place: u16) -> f64 {
        self.get(usize::from(place)).copied().unwrap_or(0.0)
    }
    fn set_number(&mut self, place: u16, number: f64) -> Option<()> {
        let place = usize::from(place);
        let number = Some(number).filter(|x| x.is_finite())?;
        while self.len() <= place && number != 0.0 {
            self.push(0.0).ok()?;
        }
        if let Some(value) = self.get_mut(place) {
            *value = number;
        }
        Some(())
    }
}

impl<const N: usize> Value for heapless::Vec<[f64; 2], N> {
    const FORM: Form = Form::Rows;
    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}

impl<const C: usize, const N: usize> Value for heapless::Vec<heapless::Vec<[f64; 2], C>, N> {
    const FORM: Form = Form::Polygons;
}

/// Declares an enumeration whose variants are words in sensor.toml; the first variant is the default. Each line has `@`
/// and the number in flight or `-`, the variant, the word, and the feature that the variant needs. Every variant exists
/// in every build; a build without the feature refuses the variant and names the feature.
macro_rules! choices {
    (
        $(#[doc = $about:literal])+
        pub enum $name:ident {
            $($(#[doc = $doc:literal])+ @ $id:tt $variant:ident = $word:literal $(needs $feature:literal)?;)+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[non_exhaustive]
        pub enum $name {
            $(
                $(#[doc = $doc])+
                $(#[doc = ""] #[doc = concat!("It needs the feature `", $feature, "`.")])?
                #[cfg_attr(feature = "serde", serde(rename = $word))]
                $variant,
            )+
        }

        impl $name {
            /// All variants, in the order of their declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// Returns the word in sensor.toml.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }

            /// Returns the feature that the variant needs and this build does not have.
            #[allow(unused, reason = "some enumerations need no feature")]
            const fn lacking(self) -> Option<&'static str> {
                match self {
                    $($(Self::$variant if !cfg!(feature = $feature) => Some($feature),)?)+
                    _ => None,
                }
            }
        }

        impl Default for $name {
            fn default() -> Self {
                const FIRST: $name = $name::ALL[0];
                FIRST
            }
        }

        impl $crate::base::keys::Value for $name {
            const FORM: $crate::base::keys::Form = $crate::base::keys::Form::Word;
            const CHOICES: &'static [$crate::base::keys::Choice] = &[
                $($crate::base::keys::Choice {
                    name: $word,
                    doc: concat!($($doc, "\n"),+),
                    feature: $crate::base::keys::feature_name!($($feature)?),
                    is_built: true $(&& cfg!(feature = $feature))?,
                    flight: $crate::base::keys::flight!($id),
                }),+
            ];
            fn check(
                &self,
                path: &'static str,
                _low: f64,
                _above: bool,
                _high: f64,
            ) -> Result<(), $crate::base::error::ConfigError> {
                match self.lacking() {
                    Some(feature) => Err($crate::base::error::ConfigError::lacks(path, Some(self.name()), feature)),
                    None => Ok(()),
                }
            }
            fn number(&self, _place: u16) -> f64 {
                let number = match self {
                    $(Self::$variant => $crate::base::keys::flight!($id),)+
                };
                number.map_or(f64::NAN, f64::from)
            }
            fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
                $(
                    if let Some(own) = $crate::base::keys::flight!($id)
                        && f64::from(own) == number
                    {
                        *self = Self::$variant;
                        return Some(());
                    }
                )+
                None
            }
        }
    };
}

/// Declares a section of sensor.toml: a structure with its defaults and its table of keys. The line of a field has `@`
/// and the number in flight or `-`, name, type, default, limits in brackets, and options in braces (`needs` a feature,
/// `unset` and `example` for a value without default). A section `without defaults` has `serde(...)` in place of the
/// default.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        $section:literal pub struct $name:ident $(: $derive:ident)? {
            $(
                $(#[doc = $doc:literal])+
                @ $id:tt $field:ident : $ty:ty = $default:expr, $limits:tt
                    $({ $($option:ident : $text:literal),+ $(,)? })?;
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, $($derive,)? PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                #[cfg_attr(feature = "serde", serde(skip_serializing_if = "crate::base::keys::Value::is_absent"))]
                pub $field: $ty,
            )+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        $crate::base::keys::table! {
            ($($about)+) $section $name {
                $($id $field : $ty = ($default), $limits, ($($doc)+), { $($($option : $text),+)? };)+
            }
        }
    };
    (
        $(#[doc = $about:literal])+
        $section:literal pub struct $name:ident $(: $derive:ident)? without defaults {
            $(
                $(#[doc = $doc:literal])+
                @ $id:tt $field:ident : $ty:ty, serde $serde:tt, $limits:tt
                    $({ $($option:ident : $text:literal),+ $(,)? })?;
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, $($derive,)? PartialEq)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                #[cfg_attr(feature = "serde", serde $serde)]
                pub $field: $ty,
            )+
        }

        $crate::base::keys::table! {
            ($($about)+) $section $name {
                $($id $field : $ty = (), $limits, ($($doc)+), { $($($option : $text),+)? };)+
            }
        }
    };
}

/// Implements [`Section`] for a structure.
macro_rules! table {
    (
        ($($about:literal)+) $section:literal $name:ident {
            $(
                $id:tt $field:ident : $ty:ty = $default:tt, $limits:tt, ($($doc:literal)+),
                { $($option:ident : $text:literal),* };
            )+
        }
    ) => {
        impl $crate::base::keys::Section for $name {
            const TABLE: $crate::base::keys::Table = $crate::base::keys::Table {
                name: $section,
                doc: concat!($($about, "\n"),+),
                keys: &[$($crate::base::keys::Key {
                    path: concat!($section, ".", stringify!($field)),
                    doc: concat!($($doc, "\n"),+),
                    form: <$ty as $crate::base::keys::Value>::FORM,
                    limits: $crate::base::keys::limits!($limits),
                    choices: <$ty as $crate::base::keys::Value>::CHOICES,
                    feature: $crate::base::keys::option!(needs $($option $text)*),
                    unset: $crate::base::keys::option!(unset $($option $text)*),
                    example: $crate::base::keys::option!(example $($option $text)*),
                    flight: $crate::base::keys::flight!($id),
                }),+],
            };

            const NUMBERS: &'static [(Option<u16>, u16)] = &[
                $(($crate::base::keys::flight!($id), <$ty as $crate::base::keys::Value>::NUMBERS)),+
            ];

            fn check_keys(&self) -> Result<(), $crate::base::error::ConfigError> {
                $(
                    $crate::base::keys::check!(self.$field, concat!($section, ".", stringify!($field)), $limits);
                    $crate::base::keys::needs!(
                        self.$field, $default, concat!($section, ".", stringify!($field)), $($option $text)*
                    );
                )+
                Ok(())
            }

            fn path(id: u16) -> Option<&'static str> {
                $(
                    if $crate::base::keys::place!($id, $ty, id).is_some() {
                        return Some(concat!($section, ".", stringify!($field)));
                    }
                )+
                None
            }

            fn number(&self, id: u16) -> Option<f64> {
                $(
                    if let Some(place) = $crate::base::keys::place!($id, $ty, id) {
                        return Some($crate::base::keys::Value::number(&self.$field, place));
                    }
                )+
                None
            }

            fn set_number(&mut self, id: u16, number: f64) -> Option<bool> {
                $(
                    if let Some(place) = $crate::base::keys::place!($id, $ty, id) {
                        return Some($crate::base::keys::Value::set_number(&mut self.$field, place, number).is_some());
                    }
                )+
                None
            }

            fn differing_on_ground(&self, other: &Self) -> Option<&'static str> {
                $(
                    if $crate::base::keys::flight!($id).is_none() && self.$field != other.$field {
                        return Some(concat!($section, ".", stringify!($field)));
                    }
                )+
                None
            }
        }
    };
}

/// Gives a number in flight, or `None` for `-`.
macro_rules! flight {
    (-) => {
        None::<u16>
    };
    ($id:literal) => {
        Some::<u16>($id)
    };
}

/// Gives the place of the number `id` among the numbers of a key.
macro_rules! place {
    (-, $ty:ty, $id:ident) => {{
        let _ = $id;
        None::<u16>
    }};
    ($first:literal, $ty:ty, $id:ident) => {
        $id.checked_sub($first).filter(|place| *place < <$ty as $crate::base::keys::Value>::NUMBERS)
    };
}

/// Gives the feature of a choice.
macro_rules! feature_name {
    () => {
        None
    };
    ($feature:literal) => {
        Some($feature)
    };
}

/// Gives the text of one option among several.
macro_rules! option {
    ($wanted:ident) => { None };
    (needs needs $text:literal $($rest:tt)*) => { Some($text) };
    (unset unset $text:literal $($rest:tt)*) => { Some($text) };
    (example example $text:literal $($rest:tt)*) => { Some($text) };
    ($wanted:ident $other:ident $text:literal $($rest:tt)*) => { $crate::base::keys::option!($wanted $($rest)*) };
}

/// Gives [`Limits`] from their notation.
macro_rules! limits {
    ([choice]) => {
        $crate::base::keys::Limits::Choice
    };
    ([$rule:literal]) => {
        $crate::base::keys::Limits::Rule($rule)
    };
    ([above $low:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: true, high: f64::INFINITY }
    };
    ([above $low:literal to $high:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: true, high: $high }
    };
    ([$low:literal or more]) => {
        $crate::base::keys::Limits::Number { low: $low, above: false, high: f64::INFINITY }
    };
    ([$low:literal to $high:literal]) => {
        $crate::base::keys::Limits::Number { low: $low, above: false, high: $high }
    };
}

/// Checks one value; the section's own code checks a rule in words.
macro_rules! check {
    ($value:expr, $path:expr, [$rule:literal]) => {};
    ($value:expr, $path:expr, [choice]) => {
        $crate::base::keys::Value::check(&$value, $path, 0.0, false, 0.0)?
    };
    ($value:expr, $path:expr, [above $low:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, true, f64::INFINITY)?
    };
    ($value:expr, $path:expr, [above $low:literal to $high:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, true, $high)?
    };
    ($value:expr, $path:expr, [$low:literal or more]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, false, f64::INFINITY)?
    };
    ($value:expr, $path:expr, [$low:literal to $high:literal]) => {
        $crate::base::keys::Value::check(&$value, $path, $low, false, $high)?
    };
}

/// Checks that a key keeps its default when its feature is not in this build.
macro_rules! needs {
    ($value:expr, $default:tt, $path:expr, needs $feature:literal $($rest:tt)*) => {
        if !cfg!(feature = $feature) && $value != $default {
            return Err($crate::base::error::ConfigError::lacks($path, None, $feature));
        }
    };
    ($value:expr, $default:tt, $path:expr, $option:ident $text:literal $($rest:tt)*) => {
        $crate::base::keys::needs!($value, $default, $path, $($rest)*)
    };
    ($value:expr, $default:tt, $path:expr,) => {};
}

pub(crate) use {check, choices, feature_name, flight, limits, needs, option, place, section, table};
