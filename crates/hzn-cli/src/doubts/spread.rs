//! Some pictures of a run, evenly spread.

/// Most pictures that are looked at again.
const MOST: usize = 40;

/// Collects a value of some pictures, evenly spread over the run.
#[derive(Debug, Clone)]
pub(crate) struct Spread<T> {
    kept: Vec<T>,
    /// One of this number of pictures is kept.
    every: u64,
    seen: u64,
}

impl<T> Default for Spread<T> {
    fn default() -> Self {
        Self { kept: Vec::new(), every: 1, seen: 0 }
    }
}

impl<T: Copy> Spread<T> {
    pub(crate) fn add(&mut self, value: T) {
        self.seen += 1;
        if !(self.seen - 1).is_multiple_of(self.every) {
            return;
        }
        self.kept.push(value);
        if self.kept.len() > 2 * MOST {
            self.every *= 2;
            self.kept = self.kept.iter().step_by(2).copied().collect();
        }
    }

    pub(crate) fn each(&self) -> impl Iterator<Item = T> + '_ {
        self.kept.iter().copied()
    }

    /// Returns at most the largest number of pictures of those for which `chosen` returns something.
    pub(crate) fn choose<U: Copy>(&self, chosen: impl Fn(T) -> Option<U>) -> Vec<U> {
        let all: Vec<U> = self.each().filter_map(chosen).collect();
        let step = all.len().div_ceil(MOST).max(1);
        all.into_iter().step_by(step).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_run_is_covered_evenly() {
        let mut spread = Spread::default();
        (0..10_000u64).for_each(|index| spread.add(index));
        let even = spread.choose(|index| (index % 512 == 0).then_some(index));
        assert_eq!((even.first(), even.last(), even.len()), (Some(&0), Some(&9728), 20));
        let all = spread.choose(Some);
        assert!(all.len() <= MOST && all.len() > MOST / 2 && *all.last().unwrap() > 9500, "{all:?}");
        assert!(
            (0..20u64)
                .fold(Spread::default(), |mut s, i| {
                    s.add(i);
                    s
                })
                .choose(Some)
                .len()
                == 20
        );
    }
}
