//! Records: the fields of a packet in their order, with a table that describes them.

use crate::bytes::{Reader, Writer};

/// Representation of a number in a packet, most significant byte first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A whole number without sign, of this many bytes.
    Unsigned(usize),
    /// A number of IEEE 754, of this many bytes.
    Float(usize),
}

impl Kind {
    /// Returns the number of bytes.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Unsigned(bytes) | Self::Float(bytes) => bytes,
        }
    }
}

/// A field of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Name of the field, such as `cov`.
    pub name: &'static str,
    /// What follows the name of each of its numbers, such as `_xx`; one empty text for a single number.
    pub parts: &'static [&'static str],
    /// Representation of each number.
    pub kind: Kind,
    /// Meaning and unit, as in the documentation.
    pub description: &'static str,
}

/// A type that a field can have.
pub(crate) trait FieldType: Copy {
    const PARTS: &'static [&'static str] = &[""];
    const KIND: Kind;
    // A constant, so that the budget and the limits of the line know the size of a packet before it is written.
    const BYTES: usize = Self::KIND.bytes() * Self::PARTS.len();
    fn write(self, out: &mut Writer<'_>);
    fn read(from: &mut Reader<'_>) -> Option<Self>;
    fn numbers(self) -> impl Iterator<Item = f64>;
}

macro_rules! field_types {
    ($($t:ident $kind:expr;)*) => {$(
        impl FieldType for $t {
            const KIND: Kind = $kind;
            fn write(self, out: &mut Writer<'_>) {
                out.$t(self);
            }
            fn read(from: &mut Reader<'_>) -> Option<Self> {
                from.$t()
            }
            fn numbers(self) -> impl Iterator<Item = f64> {
                // A double is exact up to 2^53, which is 285 years in microseconds, so that one type serves all fields.
                core::iter::once(self as f64)
            }
        }
    )*};
}
field_types! {
    u8 Kind::Unsigned(1);
    u16 Kind::Unsigned(2);
    u32 Kind::Unsigned(4);
    u64 Kind::Unsigned(8);
    f32 Kind::Float(4);
    f64 Kind::Float(8);
}

macro_rules! vector_types {
    ($($n:literal $parts:expr;)*) => {$(
        impl FieldType for [f32; $n] {
            const PARTS: &'static [&'static str] = &$parts;
            const KIND: Kind = Kind::Float(4);
            fn write(self, out: &mut Writer<'_>) {
                for x in self {
                    out.f32(x);
                }
            }
            fn read(from: &mut Reader<'_>) -> Option<Self> {
                from.floats()
            }
            fn numbers(self) -> impl Iterator<Item = f64> {
                self.into_iter().map(f64::from)
            }
        }
    )*};
}
vector_types! {
    3 ["_x", "_y", "_z"];
    4 ["_w", "_x", "_y", "_z"];
    6 ["_xx", "_xy", "_xz", "_yy", "_yz", "_zz"];
}

/// Defines a record with its conversion to bytes and back, and its table.
// One definition makes the struct, its bytes and the table for ground systems, so that they cannot differ.
macro_rules! record {
    ($(#[doc = $doc:literal])* $name:ident { $($(#[doc = $field_doc:literal])* $field:ident: $t:ty,)* }) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $name {
            $($(#[doc = $field_doc])* pub $field: $t,)*
        }
        impl $name {
            /// The names of the fields, in the order of the packet.
            pub const FIELDS: &'static [&'static str] = &[$(stringify!($field)),*];
            /// The fields in the order of the packet.
            pub const TABLE: &'static [$crate::record::Field] = &[$($crate::record::Field {
                name: stringify!($field),
                parts: <$t as $crate::record::FieldType>::PARTS,
                kind: <$t as $crate::record::FieldType>::KIND,
                // The documentation is also the text of the dictionary, so that it is written once.
                description: concat!($($field_doc),*),
            }),*];
            /// Number of bytes of the fields.
            pub const BYTES: usize = 0 $(+ <$t as $crate::record::FieldType>::BYTES)*;
            /// Appends the fields.
            pub fn write(&self, out: &mut $crate::bytes::Writer<'_>) {
                $($crate::record::FieldType::write(self.$field, out);)*
            }
            /// Reads the fields; `None` if they are cut off.
            pub fn read(from: &mut $crate::bytes::Reader<'_>) -> Option<Self> {
                Some(Self { $($field: $crate::record::FieldType::read(from)?,)* })
            }
            /// Returns every number of the fields, in their order.
            pub fn values(&self) -> impl Iterator<Item = f64> + use<> {
                core::iter::empty()$(.chain($crate::record::FieldType::numbers(self.$field)))*
            }
        }
    };
}

pub(crate) use record;
