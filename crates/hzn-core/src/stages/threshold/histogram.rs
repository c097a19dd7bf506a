//! Histogram of the sample: gate, Otsu's threshold, contrast and noise.

use crate::base::real::Real;

/// Number of bins of the histogram.
pub(super) const BINS: usize = 256;

/// Smallest contrast between the dark and the lit class, as a fraction of full scale. A smaller contrast also suffices
/// if it is at least `LEAST_SPREADS` standard deviations of the dark class. Pure noise that is cut at its middle gives
/// classes 2.7 standard deviations apart; a ramp gives 3.5.
const LEAST_CONTRAST: f64 = 0.03;

const LEAST_SPREADS: f64 = 4.0;

/// Smallest contrast between the classes in counts, where `LEAST_SPREADS` decides. A smaller contrast can result from
/// rounding.
const LEAST_COUNTS: f64 = 4.0;

/// Number of pixels per brightness. The bins are as narrow as the range of the sample allows, because a picture with 16
/// bits may use only a thousand counts.
#[derive(Debug)]
pub(super) struct Histogram {
    // Sixteen bits are enough because a sample has at most 4096 pixels; the histogram takes 512 bytes.
    pub(super) bins: [u16; BINS],
    pub(super) sum: u64,
    pub(super) count: u32,
    /// A bin is 2^shift counts wide. `first` is the number of the first bin.
    pub(super) shift: u32,
    pub(super) first: u32,
}

impl Histogram {
    pub(super) fn new() -> Self {
        Self { bins: [0; BINS], sum: 0, count: 0, shift: 0, first: 0 }
    }

    pub(super) fn count(&mut self, v: u16) {
        let v = u32::from(v);
        if self.count == 0 {
            // 8-bit values always fit into the bins that start at 0.
            self.first = if v < BINS as u32 { 0 } else { v - BINS as u32 / 2 };
        }
        // At most sixteen rounds: then every 16-bit value has its bin.
        while self.bin(v).is_none() {
            self.widen(v);
        }
        if let Some(bin) = self.bin(v).and_then(|k| self.bins.get_mut(k)) {
            *bin += 1;
        }
        self.sum += u64::from(v);
        self.count += 1;
    }

    pub(super) fn bin(&self, v: u32) -> Option<usize> {
        (v >> self.shift).checked_sub(self.first).map(|k| k as usize).filter(|&k| k < BINS)
    }

    /// Doubles the width of the bins. The first bin moves as near to `v` as the filled bins allow.
    #[cold]
    fn widen(&mut self, v: u32) {
        let old = core::mem::replace(&mut self.bins, [0; BINS]);
        let (first, last) = (self.first, (self.first + BINS as u32 - 1) / 2);
        self.shift += 1;
        self.first = (first / 2).min(v >> self.shift).max((last + 1).saturating_sub(BINS as u32));
        for (&n, k) in old.iter().zip(first..) {
            if let Some(bin) = (k / 2).checked_sub(self.first).and_then(|k| self.bins.get_mut(k as usize)) {
                *bin += n;
            }
        }
    }

    /// Returns the mean of the pixels below the threshold, and the mean of the others minus this mean, in counts.
    #[inline(never)]
    pub(super) fn classes<T: Real>(&self, level: u16, mean: T) -> (T, T) {
        let lit = (u32::from(level) >> self.shift).saturating_sub(self.first) as usize;
        let (mut count, mut sum) = (0u32, 0u32);
        for (&n, k) in self.bins.iter().zip(0u32..).take(lit) {
            count += u32::from(n);
            sum += u32::from(n) * k;
        }
        let above = self.count.saturating_sub(count);
        if count == 0 || above == 0 {
            return (if count == 0 { T::ZERO } else { mean }, T::ZERO);
        }
        let dark = (T::from_f64(f64::from(sum)) / T::from_f64(f64::from(count)) + self.offset()) * self.width();
        // The deviations of both classes from the common mean cancel.
        let (count, above) = (T::from_f64(f64::from(count)), T::from_f64(f64::from(above)));
        (dark, (mean - dark) * (count + above) / above)
    }

    /// Returns the width of a bin in counts.
    fn width<T: Real>(&self) -> T {
        T::from_f64(f64::from(1u32 << self.shift))
    }
    /// Returns the number of the first bin.
    fn offset<T: Real>(&self) -> T {
        T::from_i32(self.first as i32)
    }

    pub(super) fn mean<T: Real>(&self) -> Option<T> {
        (self.count > 0).then(|| T::from_f64(self.sum as f64) / T::from_f64(f64::from(self.count)))
    }

    /// Returns Otsu's threshold in counts: it maximises the variance between the classes. If several thresholds reach
    /// the maximum, the result is their middle. `None` if the classes are too close to each other.
    pub(super) fn otsu<T: Real>(&self, full_scale: u32) -> Option<T> {
        let total = self.count;
        let sum: u32 = self.bins.iter().zip(0u32..).map(|(&n, v)| u32::from(n) * v).sum();
        let (mut below, mut below_sum) = (0u32, 0u32);
        let (mut best, mut first, mut last) = (T::zero(), 0u32, 0u32);
        let (mut dark, mut lit) = (T::zero(), T::zero());
        for (&n, v) in self.bins.iter().zip(0u32..) {
            below += u32::from(n);
            below_sum += u32::from(n) * v;
            let above = total - below;
            if below == 0 || above == 0 {
                continue;
            }
            if n == 0 {
                // An empty bin changes nothing: a run of equally good thresholds continues.
                if last + 1 == v {
                    last = v;
                }
                continue;
            }
            let m0 = T::from_f64(f64::from(below_sum)) / T::from_f64(f64::from(below));
            let m1 = T::from_f64(f64::from(sum - below_sum)) / T::from_f64(f64::from(above));
            let d = m1 - m0;
            let between = T::from_f64(f64::from(below)) * T::from_f64(f64::from(above)) * d * d;
            if between > best {
                (best, first, last, dark, lit) = (between, v, v, m0, m1);
            }
        }
        let scale = self.width::<T>();
        let contrast = (lit - dark) * scale;
        // The first test suffices for most pictures, so that the spread is computed only for those of low contrast.
        let apart = contrast >= T::from_f64(LEAST_CONTRAST * f64::from(full_scale)) || {
            let spread = self.spread::<T>(first, dark) * scale;
            contrast >= (spread * T::from_f64(LEAST_SPREADS)).max(T::from_f64(LEAST_COUNTS))
        };
        // The lit class begins one bin above the dark class.
        // The middle of equally good thresholds is as far from the dark class as from the lit one, so that noise
        // crosses neither.
        let level = T::from_f64(f64::from(first + last)) * T::from_f64(0.5) + T::one() + self.offset();
        (apart && contrast >= T::from_f64(2.0)).then_some(level * scale)
    }

    /// Returns the standard deviation of the pixels below the threshold about their mean `dark`, in counts.
    pub(super) fn dark_spread<T: Real>(&self, level: u16, dark: T) -> T {
        let width = self.width::<T>();
        let Some(last) = (u32::from(level) >> self.shift).saturating_sub(self.first).checked_sub(1) else {
            return T::ZERO;
        };
        self.spread(last, dark / width - self.offset()) * width
    }

    /// Returns the standard deviation of the bins up to number `last` about `mean`, in bins. It includes the rounding
    /// to bins.
    #[cold]
    fn spread<T: Real>(&self, last: u32, mean: T) -> T {
        let (mut count, mut sum) = (0u32, T::from_f64(0.0));
        for (&n, k) in self.bins.iter().zip(0..=last) {
            // Whole numbers below 2²⁴ are exact in both precisions, and need no double on a core without them.
            let off = T::from_i32(k as i32) - mean;
            sum += T::from_i32(n.into()) * off * off;
            count += u32::from(n);
        }
        (sum / T::from_i32(count.max(1) as i32) + T::from_f64(1.0 / 12.0)).sqrt()
    }
}
