//! `choices!`: an enumeration whose variants are words in sensor.toml.

/// Declares an enumeration whose variants are words in sensor.toml; the first variant is the default. Each line has `@`
/// and the number in flight or `-`, the variant, the word, and the feature that the variant needs. Every variant exists
/// in every build; a build without the feature refuses the variant and names the feature.
// The variants do not depend on features, because features of one crate are added up over a whole build: a variant that
// one crate turns on would break every `match` of another crate.
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
                // The index is evaluated at compile time because it stands in a `const`; an index at run time would
                // link a panic path.
                const FIRST: $name = $name::ALL[0];
                FIRST
            }
        }

        impl $crate::base::packed::Packed for $name {
            fn pack(&self, to: &mut $crate::base::packed::Packer<'_>) {
                // The number is the place in the list: one in flight is not there for every word.
                (Self::ALL.iter().position(|choice| choice == self).unwrap_or(0) as u8).pack(to);
            }
            fn unpack(from: &mut $crate::base::packed::Unpacker<'_>) -> Self {
                let place = <u8 as $crate::base::packed::Packed>::unpack(from);
                let choice = Self::ALL.get(usize::from(place)).copied().filter(|choice| choice.lacking().is_none());
                from.require(choice.is_some());
                choice.unwrap_or_default()
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
                // A choice on the ground only has no number, so it reads as NaN, which no number in flight equals.
                number.map_or(f64::NAN, f64::from)
            }
            fn set_number(&mut self, _place: u16, number: f64) -> Option<()> {
                $(
                    if let Some(own) = $crate::base::keys::flight!($id)
                        // The comparison is in f64 and not after a cast, because a cast would take 1.5 or 1e9 for a
                        // valid choice.
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

pub(crate) use choices;
