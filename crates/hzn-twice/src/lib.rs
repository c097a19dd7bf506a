//! A value that is kept twice, so that a bit that changes in memory is noticed.
//!
//! The comparison reads bytes. A comparison by `==` looks only at the bits that have a meaning. It does not see a flip
//! of the upper bits of the tag of an `Option`, for example, but compiled code may test the whole tag.
//!
//! A comparison costs less than a checksum. It needs the memory of the second copy.

#![no_std]

use core::mem::MaybeUninit;

/// A value and a copy of its bytes.
#[derive(Debug)]
pub struct KeptTwice<T> {
    value: T,
    copy: MaybeUninit<T>,
    /// Whether there is a copy. A number, because a flipped bit makes an invalid `bool`.
    copies: u8,
}

/// A value is compared in these pieces. The remaining bytes are compared one by one.
type Word = u32;

impl<T> KeptTwice<T> {
    /// Takes a value. [`Self::complete`] makes its copy, after the value has been moved to its place.
    pub const fn new(value: T) -> Self {
        Self { value, copy: MaybeUninit::uninit(), copies: 0 }
    }
    /// Makes the copy if there is none. From now on a change is noticed.
    ///
    /// Do not move the value afterwards: a move need not copy the unused bytes between the fields. After a move
    /// [`Self::is_intact`] may return false although no bit changed.
    pub fn complete(&mut self) {
        if self.copies == 0 {
            let (from, to) = ((&raw const self.value).cast::<MaybeUninit<u8>>(), self.copy.as_mut_ptr());
            // SAFETY: both places have this size and do not overlap. Bytes without a value may be copied as
            // `MaybeUninit<u8>`. The copy is never used as a `T`, so nothing is dropped twice.
            unsafe { from.copy_to_nonoverlapping(to.cast(), size_of::<T>()) };
            self.copies = 1;
        }
    }
    /// Replaces the value. Call [`Self::complete`] soon: until then a change is not noticed.
    pub fn set(&mut self, value: T) {
        self.value = value;
        self.copies = 0;
    }
    /// Returns the value.
    pub fn get(&self) -> &T {
        &self.value
    }
    /// Returns the value for a change that [`Self::is_intact`] shall notice. This is for tests.
    pub fn value_mut(&mut self) -> &mut T {
        &mut self.value
    }
    /// Returns whether all bytes of the value and of its copy are equal. If there was no copy, it is made.
    #[inline(never)]
    pub fn is_intact(&mut self) -> bool {
        self.complete();
        // The black box: the compiler must not conclude from the copying above that both are equal.
        let value = core::hint::black_box(&raw const self.value);
        let copy = core::hint::black_box(self.copy.as_ptr());
        let words = if align_of::<T>() >= align_of::<Word>() { size_of::<T>() / size_of::<Word>() } else { 0 };
        // SAFETY: both places have the size and the alignment of a `T`.
        unsafe {
            are_equal::<Word>(value.cast(), copy.cast(), 0..words)
                && are_equal::<u8>(value.cast(), copy.cast(), words * size_of::<Word>()..size_of::<T>())
        }
    }
}

/// Returns whether the pieces of two places are equal.
///
/// # Safety
/// Every piece of the range must lie within both places, and both must be aligned for a piece.
unsafe fn are_equal<Piece: PartialEq>(a: *const Piece, b: *const Piece, range: core::ops::Range<usize>) -> bool {
    let mut equal = true;
    for i in range {
        // SAFETY: the caller guarantees places and alignment. The unused bytes between fields have no value in the
        // language. A volatile read takes the bytes that are in memory, and both copies of them came from one place.
        equal &= unsafe { a.add(i).read_volatile() == b.add(i).read_volatile() };
    }
    equal
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_noticed_until_the_value_is_replaced() {
        let mut kept = KeptTwice::new((1u8, 2.0f64, [3u8; 5]));
        assert!(kept.is_intact());
        kept.value_mut().2[4] ^= 0x80;
        assert!(!kept.is_intact());
        assert!(!kept.is_intact());
        kept.set((1, 2.0, [3; 5]));
        assert!(kept.is_intact());
    }

    #[test]
    fn sizes_that_are_no_multiple_of_a_word_are_compared_to_their_last_byte() {
        for changed in 0..7 {
            let mut kept = KeptTwice::new([0u8; 7]);
            kept.complete();
            kept.value_mut()[changed] = 1;
            assert!(!kept.is_intact());
        }
        assert!(KeptTwice::new(()).is_intact());
    }

    #[test]
    fn nan_and_minus_zero_are_bytes_like_others() {
        let mut kept = KeptTwice::new([f32::NAN, 0.0]);
        assert!(kept.is_intact());
        kept.value_mut()[1] = -0.0;
        assert!(!kept.is_intact());
    }
}
