//! Data of a picture that comes row by row, so that stuck pixels can be found when its edges are known: a sample of
//! neighbours, and in each row the longest run of equal dark pixels and the longest one of equal bright pixels.

/// Shortest run that is kept; shorter ones never count as stuck.
// Light and lens make shorter runs without a fault, so that these would refuse good limbs.
pub(super) const SHORTEST: usize = 16;
/// Room for the pairs of a sample. The step of a sample leaves at most twice as many pairs as it wants.
const PAIRS: usize = 2 * SAMPLES;
/// Number of pairs of neighbours in the sample of a picture.
const SAMPLES: usize = 128;

/// Returns the distance in pixels between the pairs of the sample of a picture with this number of pixels.
pub(super) const fn sample_step(pixels: usize) -> usize {
    // An odd step does not stay in one column.
    (pixels / SAMPLES) | 1
}

/// A run of equal pixels in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    start: u16,
    pub(super) length: u16,
    pub(super) value: u8,
}

impl Run {
    const NONE: Self = Self { start: 0, length: 0, value: 0 };

    fn contains(self, x: usize) -> bool {
        x.checked_sub(self.start.into()).is_some_and(|after| after < self.length.into())
    }
}

/// The longest runs of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// Two runs instead of all pixels, because a board that takes rows has no memory for a picture.
pub(super) struct RowRuns {
    dark: Run,
    bright: Run,
}

impl RowRuns {
    pub(super) const NONE: Self = Self { dark: Run::NONE, bright: Run::NONE };

    /// Finds the longest runs of a row that are long enough; black and saturated pixels never count. Pixels from
    /// `level` on are bright.
    pub(super) fn find(row: &[u8], level: u16) -> Self {
        let (mut found, mut x) = (Self::NONE, 0);
        // A run that is long enough contains a pixel whose column is a multiple of the shortest length.
        while let Some((before, [value, after @ ..])) = row.split_at_checked(x) {
            let is_equal = |p: &&u8| *p == value;
            let after = 1 + after.iter().take_while(is_equal).count();
            let before = before.iter().rev().take_while(is_equal).count();
            let longest = if u16::from(*value) < level { &mut found.dark } else { &mut found.bright };
            let length = before + after;
            // Black and saturated runs would hide a stuck one, because they can be the longest.
            if length >= SHORTEST.max(usize::from(longest.length) + 1) && !matches!(*value, 0 | u8::MAX) {
                *longest = Run { start: (x - before) as u16, length: length as u16, value: *value };
            }
            x = (x + after).next_multiple_of(SHORTEST);
        }
        found
    }

    /// Returns the run that contains a column, if it is one of the longest.
    pub(super) fn at(self, x: usize) -> Option<Run> {
        [self.dark, self.bright].into_iter().find(|run| run.contains(x))
    }
}

/// The sample of neighbours of a picture whose rows come one by one. It has the same pairs as that of the whole
/// picture.
#[derive(Debug)]
pub(super) struct RowSample {
    step: usize,
    /// Places in the picture of the next pair and of the next row.
    next: usize,
    row_start: usize,
    /// The last pixel of the row before, if it begins a pair.
    open: Option<u8>,
    pairs: heapless::Vec<[u8; 2], PAIRS>,
}

impl RowSample {
    // All zeros, so that it takes no room in flash.
    pub(super) const NONE: Self = Self { step: 0, next: 0, row_start: 0, open: None, pairs: heapless::Vec::new() };

    /// Begins a picture with this number of pixels.
    pub(super) fn begin(&mut self, pixels: usize) {
        (self.step, self.next, self.row_start, self.open) = (sample_step(pixels), 0, 0, None);
        self.pairs.clear();
    }

    /// Takes the pairs of the next row.
    pub(super) fn take_row(&mut self, row: &[u8]) {
        // A pair may reach into the next row, because that of a picture in memory does.
        if let (Some(a), Some(&b)) = (self.open.take(), row.first()) {
            self.add([a, b]);
        }
        while let Some(&a) = self.next.checked_sub(self.row_start).and_then(|x| row.get(x)) {
            match row.get(self.next - self.row_start + 1) {
                Some(&b) => self.add([a, b]),
                None => self.open = Some(a),
            }
            self.next += self.step;
        }
        self.row_start += row.len();
    }

    fn add(&mut self, pair: [u8; 2]) {
        // There is room for the pairs of every picture.
        let _ = self.pairs.push(pair);
    }

    pub(super) fn pairs(&self) -> impl Iterator<Item = [u8; 2]> {
        self.pairs.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_longest_run_of_each_part_is_found_wherever_it_is() {
        for (start, length) in [(0, 16), (1, 16), (15, 16), (16, 17), (31, 40), (84, 16)] {
            let mut row: Vec<u8> = (0..100).map(|x| 100 + x % 7).collect();
            row[start..start + length].fill(50);
            let found = RowRuns::find(&row, 80);
            assert_eq!(found.dark, Run { start: start as u16, length: length as u16, value: 50 });
            assert_eq!(found.bright, Run::NONE);
            let inside = (0..100).filter(|&x| found.at(x).is_some());
            assert!(inside.eq(start..start + length), "{start}");
        }
    }

    #[test]
    fn short_black_and_saturated_runs_are_not_kept() {
        let row: Vec<u8> = [[0; 40], [255; 40]].concat();
        assert_eq!(RowRuns::find(&row, 80), RowRuns::NONE);
        let short: Vec<u8> = (0..90).map(|x| 1 + x / 15).collect();
        assert_eq!(RowRuns::find(&short, 4), RowRuns::NONE);
        assert_eq!(RowRuns::find(&[], 4), RowRuns::NONE);
    }

    #[test]
    fn the_sample_of_rows_is_that_of_the_picture() {
        for (width, height) in [(7, 9), (1, 200), (129, 3), (255, 1), (640, 480), (1920, 1080)] {
            // Miri takes half an hour for the largest one.
            if cfg!(miri) && height > 200 {
                continue;
            }
            let picture: Vec<u8> = (0..width * height).map(|i: usize| (i * 37 % 251) as u8).collect();
            let step = sample_step(picture.len());
            let whole: Vec<[u8; 2]> = picture.windows(2).step_by(step).map(|pair| [pair[0], pair[1]]).collect();
            let mut sample = RowSample::NONE;
            sample.begin(picture.len());
            picture.chunks(width).for_each(|row| sample.take_row(row));
            assert!(sample.pairs().eq(whole.iter().copied()), "{width}×{height}");
        }
    }
}
