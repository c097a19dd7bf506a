//! The histogram of a picture's brightness.

use hzn_core::image::{ImageView, Pixels};

/// Number of bins.
pub const BINS: usize = 256;
/// Largest number of pixels that are counted. More do not change the drawn bars.
const MOST_PIXELS: usize = 1 << 17;

/// Number of pixels by brightness. The bins cover the range from 0 to full scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Numbers of pixels, the darkest first.
    pub bins: Vec<u32>,
    /// Largest value that a pixel can have.
    pub full_scale: u16,
    /// Smallest and largest value that were counted.
    pub range: [u16; 2],
    /// Values below which 0.1 % and 99.9 % of the pixels lie.
    pub stretch: [u16; 2],
}

impl Histogram {
    /// Counts the pixels of a picture; of a large picture, every n-th row and column.
    pub fn of_view(view: &ImageView<'_>) -> Self {
        match view {
            ImageView::Grey8(p) => Self::count(p),
            ImageView::Grey16(p) => Self::count(p),
            ImageView::Colour8(p) => Self::count(p),
            ImageView::Colour16(p) => Self::count(p),
        }
    }

    fn count<P: Pixels>(p: &P) -> Self {
        let (w, h) = (usize::from(p.width()), usize::from(p.height()));
        let step = ((w * h) as f64 / MOST_PIXELS as f64).sqrt().ceil().max(1.0) as usize;
        let mut values: Vec<u16> = Vec::with_capacity(w.div_ceil(step) * h.div_ceil(step));
        for y in (0..p.height()).step_by(step) {
            values.extend((0..p.width()).step_by(step).map(|x| p.at(x, y)));
        }
        Self::of_values(values, p.full_scale())
    }

    fn of_values(mut values: Vec<u16>, full_scale: u16) -> Self {
        let scale = u32::from(full_scale) + 1;
        let mut bins = vec![0u32; BINS];
        for &v in &values {
            let bin = (u32::from(v) * BINS as u32 / scale) as usize;
            if let Some(count) = bins.get_mut(bin.min(BINS - 1)) {
                *count += 1;
            }
        }
        values.sort_unstable();
        let at = |part: f64| values.get(((values.len().max(1) - 1) as f64 * part) as usize).copied().unwrap_or(0);
        Self { bins, full_scale, range: [at(0.0), at(1.0)], stretch: [at(0.001), at(0.999)] }
    }

    /// Returns the place of a value in the histogram, 0 to 1.
    pub fn place(&self, value: f64) -> f64 {
        (value / (f64::from(self.full_scale) + 1.0)).clamp(0.0, 1.0)
    }
    /// Returns the value at a place, 0 to 1.
    pub fn value(&self, place: f64) -> f64 {
        place.clamp(0.0, 1.0) * (f64::from(self.full_scale) + 1.0)
    }
    /// Returns the part of the range that is worth showing, as places: the pixels, with some room.
    pub fn shown(&self) -> [f64; 2] {
        let top = self.place(f64::from(self.range[1]) * 1.05 + 1.0);
        [0.0, top.max(0.02)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_into_their_bins() {
        let mut values = vec![10u16; 5000];
        values.extend(vec![3000u16; 5000]);
        values.push(4095);
        let h = Histogram::of_values(values, 4095);
        assert_eq!(h.bins.iter().sum::<u32>(), 10_001);
        assert_eq!((h.bins[0], h.bins[3000 / 16], h.bins[255]), (5000, 5000, 1));
        assert_eq!((h.range, h.stretch), ([10, 4095], [10, 3000]));
        assert!((h.value(h.place(1234.0)) - 1234.0).abs() < 1e-9);
        let dark = Histogram::of_values(vec![100; 50], 65535);
        assert!(dark.shown()[1] < 0.05, "a dark picture of 16 bits fills the width");
        assert_eq!(Histogram::of_values(Vec::new(), 255).range, [0, 0]);
    }
}
