//! Enumerations whose numbers are frozen, because they stand in packets.

/// An enumeration with the number and the word of every variant beside it: `ALL`, `numbered` and `name`.
macro_rules! numbered {
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
            /// All.
            pub const ALL: &'static [Self] = &[$(Self::$variant),*];
            /// By number.
            pub fn numbered(n: $number) -> Option<Self> {
                Self::ALL.iter().copied().find(|&x| x as $number == n)
            }
            /// The word for it in messages and commands.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }
    };
}

pub(crate) use numbered;
