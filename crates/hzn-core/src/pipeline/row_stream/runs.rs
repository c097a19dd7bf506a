//! A picture of two shades as runs: for each row, the columns where dark changes to lit and lit to dark.

/// The runs of the rows so far, in borrowed memory.
#[derive(Debug)]
pub(super) struct Runs<'a> {
    /// Index in `turns` at which each row ends.
    ends: &'a mut [u16],
    /// Columns where the shade changes, beginning with dark at the left. A lit run at the right end has the width as
    /// its end.
    turns: &'a mut [u16],
    rows: u16,
    used: usize,
    width: u16,
}

impl<'a> Runs<'a> {
    pub(super) fn new(ends: &'a mut [u16], turns: &'a mut [u16], width: u16) -> Self {
        // Indices have 16 bits.
        let room = turns.len().min(usize::from(u16::MAX));
        Self { ends, turns: turns.get_mut(..room).unwrap_or_default(), rows: 0, used: 0, width }
    }

    /// Adds the next row as a whole. Returns false and adds nothing if it does not fit.
    pub(super) fn push(&mut self, row: impl Iterator<Item = bool>) -> bool {
        // The row is written beyond the used part and counted only at its end, so that a row that does not fit leaves
        // no trace.
        let (mut used, mut before) = (self.used, false);
        for (lit, x) in row.zip(0u16..) {
            if lit != before {
                let Some(turn) = self.turns.get_mut(used) else { return false };
                (*turn, before, used) = (x, lit, used + 1);
            }
        }
        if before {
            let Some(turn) = self.turns.get_mut(used) else { return false };
            // The closing turn makes every lit run a pair, so that the loops need no special case at the right end.
            (*turn, used) = (self.width, used + 1);
        }
        let Some(end) = self.ends.get_mut(usize::from(self.rows)) else { return false };
        *end = used as u16;
        (self.rows, self.used) = (self.rows + 1, used);
        true
    }

    /// Returns the number of rows so far.
    pub(super) fn rows(&self) -> u16 {
        self.rows
    }

    /// Returns the columns of row `y` where the shade changes.
    #[inline]
    pub(super) fn row(&self, y: u16) -> &[u16] {
        let at = |y: u16| self.ends.get(usize::from(y)).map_or(0, |&e| usize::from(e));
        let start = if y == 0 { 0 } else { at(y - 1) };
        self.turns.get(start..at(y)).unwrap_or_default()
    }

    #[inline]
    pub(super) fn lit(&self, x: u16, y: u16) -> bool {
        // The parity of the number of changes before a column is its shade. A bitmap would answer faster, but 640×480
        // pixels would take 38 KB.
        self.row(y).partition_point(|&turn| turn <= x) % 2 == 1
    }

    /// Calls `found` with the column of every lit pixel of row `y` that a border can pass through, in increasing order.
    /// These are pixels at the end of a run, and pixels with a dark one among their neighbours in the rows above and
    /// below, as far as these rows have been added.
    pub(super) fn each_border(&self, y: u16, mut found: impl FnMut(u16)) {
        let neighbour = |row: Option<u16>| row.filter(|&r| r < self.rows).map(|r| self.row(r));
        let mut beside =
            [y.checked_sub(1), y.checked_add(1)].map(|r| neighbour(r).map(|row| Dark::new(row, self.width)));
        for run in self.row(y).chunks_exact(2) {
            let &[start, end] = run else { continue };
            let mut x = start;
            while x < end {
                // Inside a run only the first and last pixel have a dark neighbour in their own row.
                let at_end = if x == start { x } else { end - 1 };
                let next = beside.iter_mut().flatten().map(|row| row.next_near(x)).fold(at_end, u16::min);
                found(next);
                x = next.saturating_add(1);
            }
        }
    }
}

/// The dark runs of a row, searched from left to right.
struct Dark<'a> {
    turns: &'a [u16],
    width: u16,
    at: usize,
}

impl<'a> Dark<'a> {
    fn new(turns: &'a [u16], width: u16) -> Self {
        Self { turns, width, at: 0 }
    }
    /// Returns the first column from `x` on with a dark pixel of this row at the same or at a neighbouring column. `x`
    /// must not decrease from call to call.
    fn next_near(&mut self, x: u16) -> u16 {
        loop {
            let start = match self.at {
                0 => 0,
                n => match self.turns.get(2 * n - 1) {
                    Some(&turn) => turn,
                    // The largest column stands for "no more", so that the minimum over both rows needs no option.
                    None => return u16::MAX,
                },
            };
            let end = self.turns.get(2 * self.at).copied().unwrap_or(self.width);
            if start < end && x <= end {
                return x.max(start.saturating_sub(1));
            }
            // The position is kept between calls, so that a row is passed once and not once for each pixel.
            self.at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn runs_are_the_picture(bits in proptest::collection::vec(any::<bool>(), 12 * 9), grain in 1usize..5) {
            let lit = |x: i32, y: i32| bits[(y as usize / grain) * 12 + x as usize / grain];
            let (mut ends, mut turns) = ([0; 9], [0; 12 * 9]);
            let mut runs = Runs::new(&mut ends, &mut turns, 12);
            for y in 0..9 {
                prop_assert!(runs.push((0..12).map(|x| lit(x, y))));
            }
            for y in 0..9 {
                let border = |x: i32| {
                    let near = |(dx, dy): (i32, i32)| {
                        let (x, y) = (x + dx, y + dy);
                        (0..9).contains(&y) && (0..12).contains(&x) && !lit(x, y)
                    };
                    let at_end = x == 0 || x == 11;
                    lit(x, y) && (at_end || (0..9).any(|i| near((i % 3 - 1, i / 3 - 1))))
                };
                let want: Vec<u16> = (0..12).filter(|&x| border(x)).map(|x| x as u16).collect();
                let mut got = Vec::new();
                runs.each_border(y as u16, |x| got.push(x));
                prop_assert_eq!(got, want);
                for x in 0..12 {
                    prop_assert_eq!(runs.lit(x as u16, y as u16), lit(x, y));
                }
            }
        }
    }

    #[test]
    fn a_row_without_room_is_left_out() {
        let (mut ends, mut turns) = ([0; 4], [0; 3]);
        let mut runs = Runs::new(&mut ends, &mut turns, 4);
        assert!(runs.push([false, true, true, false].into_iter()));
        assert!(!runs.push([true, false, true, false].into_iter()));
        assert_eq!((runs.rows(), runs.row(0)), (1, &[1, 3][..]));
    }
}
