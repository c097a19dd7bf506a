//! Enumerations with frozen numbers, because the numbers are in packets.

/// Makes an enumeration from its variants, each with a number and a word. It gets the items `ALL`, `from_number` and
/// `name`.
// The numbers are written out, because counted ones would change with a variant that is put between others. Number and
// word stand together, so that packets, commands and tables agree.
macro_rules! numbered_enum {
    (
        $(#[$doc:meta])*
        pub enum $name:ident: $number:ident {
            $($(#[$variant_doc:meta])* $variant:ident = $n:literal => $word:literal,)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr($number)]
        pub enum $name {
            $($(#[$variant_doc])* $variant = $n,)*
        }

        impl $name {
            /// All variants, in the order of their definition.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];
            /// Returns the variant with the number `n`, if there is one.
            pub fn from_number(n: $number) -> Option<Self> {
                // A search, because a conversion of the number would need unsafe code.
                Self::ALL.iter().copied().find(|&x| x as $number == n)
            }
            /// Returns the word for the variant in messages and commands.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }
    };
}

pub(crate) use numbered_enum;
