//! `section!`: a structure with its defaults and its table of keys.

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
        // Unknown keys are refused because a misspelt key would otherwise keep its default without a word.
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
        impl $crate::base::packed::Packed for $name {
            fn pack(&self, to: &mut $crate::base::packed::Packer<'_>) {
                $($crate::base::packed::Packed::pack(&self.$field, to);)+
            }
            #[inline(never)]
            fn unpack(from: &mut $crate::base::packed::Unpacker<'_>) -> Self {
                Self {
                    $($field: $crate::base::keys::unpack!(from, $ty, $default, $limits, { $($option $text)* }),)+
                }
            }
        }

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

            // The numbers of all keys are a constant, so that a flight computer iterates over them without the table of
            // keys, whose texts would take flash.
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

            // The path is repeated as a literal and not read from the table, because a search in the table would link
            // all its documentation into the image.
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
                        // `Some(false)` is not `None`: the flight computer must tell a refused value from an unknown
                        // number, because its acknowledgement says which of them it was.
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

pub(crate) use {section, table};
