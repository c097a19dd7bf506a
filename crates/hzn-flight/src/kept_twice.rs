//! A value that is kept twice, so that a bit that changes in memory is noticed.
//!
//! A comparison notices every change of a number, in either copy, and costs less than a checksum. It needs the memory
//! of the second copy.

/// A value and its copy.
#[derive(Debug)]
pub(crate) struct KeptTwice<T> {
    value: T,
    copy: Option<T>,
}

impl<T: Clone + PartialEq> KeptTwice<T> {
    /// Makes a value. Its copy is made later, because the start has no stack for it.
    pub(crate) fn new(value: T) -> Self {
        Self { value, copy: None }
    }
    /// Makes the copy.
    // Not inlined: the temporary copy must not lie on the caller's stack.
    #[inline(never)]
    pub(crate) fn keep(&mut self) {
        self.copy = Some(self.value.clone());
    }
    /// Makes the copy if there is none.
    pub(crate) fn complete(&mut self) {
        if self.copy.is_none() {
            self.keep();
        }
    }
    /// Replaces the value. Call [`Self::complete`] soon: until then a change is not noticed.
    pub(crate) fn set(&mut self, value: T) {
        (self.value, self.copy) = (value, None);
    }
    pub(crate) fn get(&self) -> &T {
        &self.value
    }
    /// Returns whether the value and its copy are equal. The comparison of a number that is NaN would fail: the values
    /// that are kept twice have none.
    #[inline(never)]
    pub(crate) fn is_intact(&mut self) -> bool {
        self.complete();
        core::hint::black_box(&self.copy).as_ref() == Some(&self.value)
    }
    /// Changes the value but not its copy, as a memory error does.
    #[cfg(test)]
    pub(crate) fn damage(&mut self, change: impl FnOnce(&mut T)) {
        change(&mut self.value);
    }
}
