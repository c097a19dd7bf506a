//! `packed!`: a structure as bytes, part by part.
// A file of its own: a number is such a value, too, and the macro needs the trait of numbers.

/// Implements [`Packed`](super::packed::Packed) for a structure: its parts in order, and after a semicolon those that
/// are not written, with their values.
macro_rules! packed {
    ($name:ident $(<$t:ident>)? { $($field:ident),+ $(; $($fixed:ident = $value:expr),+)? }) => {
        impl $(<$t: $crate::base::real::Real>)? $crate::base::packed::Packed for $name $(<$t>)? {
            fn pack(&self, to: &mut $crate::base::packed::Packer<'_>) {
                $($crate::base::packed::Packed::pack(&self.$field, to);)+
            }
            // Not inlined: each part is then made where it stays.
            #[inline(never)]
            fn unpack(from: &mut $crate::base::packed::Unpacker<'_>) -> Self {
                Self { $($field: $crate::base::packed::Packed::unpack(from),)+ $($($fixed: $value),+)? }
            }
        }
    };
}

pub(crate) use packed;
