//! A value that is kept twice, so that a bit that changes in memory is noticed.
//!
//! A comparison notices every change of a number, in either copy, and costs less than a checksum. It needs the memory of
//! the second copy.

/// A value and its copy.
#[derive(Debug)]
pub(crate) struct KeptTwice<T> {
    value: T,
    copy: T,
}

impl<T: Clone + PartialEq> KeptTwice<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { copy: value.clone(), value }
    }
    /// Replaces the value and its copy.
    // Not inlined: the temporary values must not lie on the caller's stack.
    #[inline(never)]
    pub(crate) fn set(&mut self, value: T) {
        self.copy.clone_from(&value);
        self.value = value;
    }
    pub(crate) fn get(&self) -> &T {
        &self.value
    }
    /// Returns whether the value and its copy are equal. The comparison of a number that is NaN would fail: the values
    /// that are kept twice have none.
    #[inline(never)]
    pub(crate) fn is_intact(&self) -> bool {
        core::hint::black_box(&self.value) == core::hint::black_box(&self.copy)
    }
    /// Changes the value but not its copy, as a memory error does.
    #[cfg(test)]
    pub(crate) fn damage(&mut self, change: impl FnOnce(&mut T)) {
        change(&mut self.value);
    }
}
