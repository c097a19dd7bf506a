//! The brightness that separates dark from lit in the pictures of each head.

/// The brightness from which on a place of each head is lit, from the last limb that it found.
#[derive(Debug, Clone)]
pub(super) struct Levels(Vec<Option<u16>>);

impl Levels {
    /// Makes the levels of a number of heads, none of which is known.
    pub(super) fn new(heads: usize) -> Self {
        Self(vec![None; heads])
    }

    /// Returns the level of a head, which is the one of this picture if it has one.
    pub(super) fn see(&mut self, k: usize, level: Option<u16>) -> Option<u16> {
        let own = self.0.get_mut(k)?;
        *own = level.or(*own);
        *own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_limb_of_a_head_counts() {
        let mut levels = Levels::new(2);
        let seen = [(0, None), (0, Some(50)), (1, None), (0, None), (0, Some(60)), (2, Some(1))];
        let got = seen.map(|(k, level)| levels.see(k, level));
        assert_eq!(got, [None, Some(50), None, Some(50), Some(60), None]);
    }
}
