//! A value that is kept twice, so that a bit that changes in memory is noticed.
//!
//! The comparison reads bytes. A comparison by `==` looks only at the bits that have a meaning. It does not see a flip
//! of the upper bits of the tag of an `Option`, for example, but compiled code may test the whole tag.
//!
//! A comparison costs less than a checksum. It needs the memory of the second copy.

#![no_std]
// These processors (LEON, for example) have assembly only in a nightly compiler, which they need in any case.
#![cfg_attr(any(target_arch = "sparc", target_arch = "xtensa"), feature(asm_experimental_arch))]

use core::mem::MaybeUninit;

/// A value and a copy of its bytes.
///
/// The value is never dropped, because a flipped bit may have made it invalid. A value that owns memory is lost.
#[derive(Debug)]
pub struct KeptTwice<T> {
    // Both may have any bytes. A flipped bit may make bytes that are no `T`, so that they may not be read as one.
    value: MaybeUninit<T>,
    copy: MaybeUninit<T>,
    /// Whether there is a copy. A number, because a flipped bit makes an invalid `bool`.
    copies: u8,
}

/// A value is compared in these pieces. The remaining bytes are compared one by one.
type Word = u32;

impl<T> KeptTwice<T> {
    /// Takes a value. [`Self::complete`] makes its copy, after the value has been moved to its place.
    pub const fn new(value: T) -> Self {
        Self { value: MaybeUninit::new(value), copy: MaybeUninit::uninit(), copies: 0 }
    }
    /// Makes the copy if there is none. From now on a change is noticed.
    ///
    /// Do not move the value afterwards: a move need not copy the unused bytes between the fields. After a move
    /// [`Self::is_intact`] may return false although no bit changed.
    pub fn complete(&mut self) {
        if self.copies == 0 {
            let (from, to) = (initialise_bytes(&mut self.value), self.copy.as_mut_ptr());
            // SAFETY: both places have this size and do not overlap. The copy is never used as a `T`.
            unsafe { from.copy_to_nonoverlapping(to.cast(), size_of::<T>()) };
            self.copies = 1;
        }
    }
    /// Replaces the value. Call [`Self::complete`] soon: until then a change is not noticed.
    pub fn set(&mut self, value: T) {
        self.value.write(value);
        self.copies = 0;
    }
    /// Changes the value and makes its copy anew. Call it only if [`Self::is_intact`] returned true: it would copy a
    /// flipped bit.
    pub fn change<R>(&mut self, change: impl FnOnce(&mut T) -> R) -> R {
        let result = change(self.value_mut());
        self.copies = 0;
        self.complete();
        result
    }
    /// Returns the value. If a bit of it may have flipped, call [`Self::is_intact`] first.
    pub fn get(&self) -> &T {
        // SAFETY: `new` or `set` wrote a value.
        unsafe { self.value.assume_init_ref() }
    }
    /// Returns the value for a change that [`Self::is_intact`] shall notice. This is for tests.
    pub fn value_mut(&mut self) -> &mut T {
        // SAFETY: `new` or `set` wrote a value.
        unsafe { self.value.assume_init_mut() }
    }
    /// Returns whether all bytes of the value and of its copy are equal. If there was no copy, it is made.
    #[inline(never)]
    pub fn is_intact(&mut self) -> bool {
        self.complete();
        // Without a barrier, Miri stops where it reads the unused bytes of a type. Under Miri only the tests of this
        // crate have one. Those of the crates that use it look at other code.
        if cfg!(all(miri, not(test))) {
            return true;
        }
        let (value, copy) = (initialise_bytes(&mut self.value), initialise_bytes(&mut self.copy));
        let words = if align_of::<T>() >= align_of::<Word>() { size_of::<T>() / size_of::<Word>() } else { 0 };
        // SAFETY: both places have the size and the alignment of a `T`, and all their bytes are initialised.
        unsafe {
            are_equal::<Word>(value.cast(), copy.cast(), 0..words)
                && are_equal::<u8>(value, copy, words * size_of::<Word>()..size_of::<T>())
        }
    }
}

/// Initialises every byte of a place with what is in memory, and returns the first byte.
///
/// The unused bytes between fields have no value in the language, and reading them as numbers is undefined behaviour.
/// The empty assembly gets the place, so the compiler must assume that the assembly has written every byte. For the
/// same reason the compiler cannot conclude that a value still equals its copy. `core::hint::black_box` guarantees
/// neither.
///
/// Miri cannot run assembly. In the tests of this crate it calls a function outside of the program instead, which
/// `miri/barrier.rs` has. It assumes the same of that function, and stops where a byte is read that the function did
/// not get before. So the tests under Miri check that every reading comes after the barrier, but not the assembly.
#[inline(always)]
fn initialise_bytes<T>(place: &mut MaybeUninit<T>) -> *mut u8 {
    let bytes = place.as_mut_ptr().cast();
    #[cfg(all(miri, test))]
    // SAFETY: the function does nothing.
    unsafe {
        unsafe extern "C" {
            fn hzn_twice_barrier(place: *mut u8);
        }
        hzn_twice_barrier(bytes);
    }
    #[cfg(not(miri))]
    // SAFETY: there is no instruction. The reference allows that the bytes are written.
    unsafe {
        core::arch::asm!("/* {} */", in(reg) bytes, options(nostack, preserves_flags));
    }
    bytes
}

/// Returns whether the pieces of two places are equal.
///
/// # Safety
/// Every piece of the range must lie within both places and be initialised. Both places must be aligned for a piece.
unsafe fn are_equal<Piece: PartialEq>(a: *const Piece, b: *const Piece, range: core::ops::Range<usize>) -> bool {
    let mut equal = true;
    for i in range {
        // SAFETY: the caller guarantees places, alignment and initialised bytes.
        equal &= unsafe { *a.add(i) == *b.add(i) };
    }
    equal
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The unused bytes are in a word with a used one. Miri stops here if they are read before the barrier.
    #[test]
    fn unused_bytes_are_read_only_after_the_barrier() {
        #[repr(C)]
        struct Padded {
            byte: u8,
            word: u32,
        }
        let mut kept = KeptTwice::new(Padded { byte: 1, word: 2 });
        assert!(kept.is_intact());
        kept.set(Padded { byte: 3, word: 4 });
        assert!(kept.is_intact());
        kept.change(|value| value.byte = 5);
        assert!(kept.is_intact() && (kept.get().byte, kept.get().word) == (5, 4));
        kept.value_mut().word = 6;
        assert!(!kept.is_intact());
    }

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
    fn a_change_of_the_copy_is_noticed() {
        let mut kept = KeptTwice::new([5u16; 3]);
        kept.complete();
        kept.copy.write([5, 5, 4]);
        assert!(!kept.is_intact());
    }

    #[test]
    fn a_wanted_change_is_copied() {
        let mut kept = KeptTwice::new([1u32, 2]);
        kept.complete();
        assert_eq!(kept.change(|value| core::mem::replace(&mut value[1], 3)), 2);
        assert!(kept.is_intact() && *kept.get() == [1, 3]);
        kept.value_mut()[1] = 2;
        assert!(!kept.is_intact());
    }

    #[test]
    fn a_value_that_may_be_invalid_is_never_dropped() {
        struct Counted(u32);
        impl Drop for Counted {
            fn drop(&mut self) {
                panic!("the value {} is dropped", self.0);
            }
        }
        let mut kept = KeptTwice::new(Counted(1));
        kept.complete();
        kept.value_mut().0 = 3;
        assert!(!kept.is_intact());
        kept.set(Counted(2));
        assert!(kept.is_intact());
    }

    #[test]
    fn nan_and_minus_zero_are_bytes_like_others() {
        let mut kept = KeptTwice::new([f32::NAN, 0.0]);
        assert!(kept.is_intact());
        kept.value_mut()[1] = -0.0;
        assert!(!kept.is_intact());
    }
}
