//! Brightness gate, and the threshold between dark and lit, from a sparse sample of the picture.
//!
//! The picture is cut into equal cells, and one pixel is drawn at random in each cell. The sample is therefore both
//! even and random. A small body may be missed: then the histogram of the sample has no second class. In this case a
//! second sample, sixteen times finer, is taken.

use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::image::region::Region;
use crate::image::{self, Pixels};
use crate::model::observer::Observer;
use crate::model::status::Status;

pub(crate) use crate::model::threshold::SUN;
pub use crate::model::threshold::{Config, Gate, Method};

/// Returns the threshold in counts if the configuration fixes it, otherwise `None`.
pub(crate) fn fixed_level<T: Real>(config: &Config, full_scale: u16) -> Option<u16> {
    let unit = if config.level < 1.0 { f64::from(full_scale) } else { 1.0 };
    (config.method == Method::Fixed).then(|| counts(T::from_f64(config.level * unit)))
}

/// The threshold, and statistics of the sample from which it comes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level<T> {
    /// Threshold in counts. A pixel is lit at this value or above.
    pub level: u16,
    /// Mean of the sample in counts.
    pub mean: T,
    /// Number of pixels in the sample.
    pub samples: u32,
    /// Mean of the dark pixels of the sample, in counts.
    pub dark: T,
    /// Mean of the lit pixels of the sample minus the mean of the dark ones, in counts; 0 if one class is empty.
    pub contrast: T,
}

impl<T: Real> Level<T> {
    /// Returns the threshold at the fraction `part` of the way from the dark pixels to this threshold, in counts. A
    /// `part` of 1 gives this threshold. Half of a threshold then means half of the light, even if the sky is not
    /// black, as in 16-bit pictures of a thermal camera.
    pub(crate) fn at_fraction(&self, part: f64) -> u16 {
        let level = T::from_i32(i32::from(self.level));
        counts(self.dark + (level - self.dark) * T::from_f64(part))
    }
}

/// Number of bins of the histogram.
const BINS: usize = 256;
/// Smallest contrast between the dark and the lit class, as a fraction of full scale. A smaller contrast also suffices
/// if it is at least `LEAST_SPREADS` standard deviations of the dark class. Pure noise that is cut at its middle gives
/// classes 2.7 standard deviations apart; a ramp gives 3.5.
const LEAST_CONTRAST: f64 = 0.03;
const LEAST_SPREADS: f64 = 4.0;
/// Smallest contrast between the classes in counts, where `LEAST_SPREADS` decides. A smaller contrast can be rounding.
const LEAST_COUNTS: f64 = 4.0;
/// Ratio of sigma to the mean distance between two values of a normal distribution: √π/2.
const SIGMA_PER_MEAN_DISTANCE: f64 = 0.886_226_925_452_758;
/// Number of cells along each side of the first and of the second sample, as powers of two.
const SIDES_LOG2: [u32; 2] = [4, 6];

/// Converts a threshold to whole counts from 1 to 65535; a threshold of 0 would make every pixel lit.
fn counts<T: Real>(level: T) -> u16 {
    level.to_i32().clamp(1, 65535) as u16
}

/// Number of pixels per brightness. The bins are as narrow as the range of the sample allows, because a picture with 16
/// bits may use only a thousand counts.
#[derive(Debug)]
struct Histogram {
    bins: [u16; BINS],
    sum: u64,
    count: u32,
    /// A bin is 2^shift counts wide. `first` is the number of the first bin.
    shift: u32,
    first: u32,
}

/// Finds the threshold. `last` is the threshold that the previous picture gives, for `track`.
///
/// # Errors
/// `too-dark` or `too-bright` if the mean is outside of the gate. `no-limb` if dark and lit differ by less than 3 % of
/// full scale and by less than the noise of the sample explains.
pub fn split<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    gate: &Gate,
    config: &Config,
    last: Option<u16>,
    seed: u32,
    observer: &O,
) -> Result<Level<T>, Status> {
    for side_log2 in SIDES_LOG2 {
        let mut sample = Sample::new(seed, side_log2, picture.full_scale(), region);
        while let Some(y) = sample.row() {
            sample.take(region, observer, |x| Some(picture.at(x, y)));
        }
        if let Some(decided) = sample.decide(gate, config, last, observer) {
            return decided;
        }
    }
    Err(Status::NoLimb)
}

/// Returns the 1-sigma noise of the dark pixels in counts, from the differences of neighbours below the threshold
/// `level`. The result is 0 if there are no dark neighbours. If the noise is clipped at 0 counts, the result is too
/// small.
#[cold]
pub(crate) fn dark_noise<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    level: u16,
    seed: u32,
    observer: &O,
) -> T {
    let mut sample = Sample::new(seed, SIDES_LOG2[0], picture.full_scale(), region);
    while let Some(y) = sample.row() {
        sample.take(region, observer, |x| {
            let next = x.checked_add(1).filter(|&next| region.contains(next, y) && !region.masked(next, y))?;
            let (here, there) = (picture.at(x, y), picture.at(next, y));
            (here < level && there < level).then(|| here.abs_diff(there))
        });
    }
    sample.histogram.mean().unwrap_or(T::ZERO) * T::from_f64(SIGMA_PER_MEAN_DISTANCE)
}

/// Both samples of a picture that arrives row by row.
#[derive(Debug)]
pub(crate) struct RowSampler([Sample; SIDES_LOG2.len()]);

impl RowSampler {
    pub(crate) fn new<T: Real>(seed: u32, full_scale: u16, region: &Region<T>) -> Self {
        Self(SIDES_LOG2.map(|side_log2| Sample::new(seed, side_log2, full_scale, region)))
    }
    /// Adds the pixels of row `y` that belong to the samples. Rows must come in order.
    pub(crate) fn row<T: Real, S: image::Sample, O: Observer<T>>(
        &mut self,
        region: &Region<T>,
        y: u16,
        row: &[S],
        observer: &O,
    ) {
        for sample in &mut self.0 {
            while sample.row() == Some(y) {
                sample.take(region, observer, |x| Some(row.get(usize::from(x)).map_or(0, |&s| s.into())));
            }
        }
    }
    /// Finds the threshold as [`split`] does.
    pub(crate) fn split<T: Real, O: Observer<T>>(
        &self,
        gate: &Gate,
        config: &Config,
        last: Option<u16>,
        observer: &O,
    ) -> Result<Level<T>, Status> {
        self.0.iter().find_map(|s| s.decide(gate, config, last, observer)).unwrap_or(Err(Status::NoLimb))
    }
}

/// A sample that is still being taken, from one row after another.
#[derive(Debug)]
struct Sample {
    histogram: Histogram,
    rng: Rng,
    side_log2: u32,
    full_scale: u16,
    /// Number of the current row of cells. `y` is the row of the picture that is sampled in it.
    cells: u32,
    y: u16,
}

impl Sample {
    fn new<T: Real>(seed: u32, side_log2: u32, full_scale: u16, region: &Region<T>) -> Self {
        let histogram = Histogram { bins: [0; BINS], sum: 0, count: 0, shift: 0, first: 0 };
        let mut sample = Self { histogram, rng: Rng::new(seed), side_log2, full_scale, cells: 0, y: 0 };
        sample.y = sample.draw(0, region.height());
        sample
    }

    /// Draws a pixel coordinate in cell number `cell` of a side of `length` pixels.
    fn draw(&mut self, cell: u32, length: u16) -> u16 {
        let length = u32::from(length);
        ((cell * length + ((length * self.rng.below(65536)) >> 16)) >> self.side_log2) as u16
    }

    /// Returns the row of the picture that is sampled next; rows come in order.
    fn row(&self) -> Option<u16> {
        (self.cells < 1 << self.side_log2).then_some(self.y)
    }

    /// Samples that row. All cells of a row of cells use one row of the picture, because each row of the picture is on
    /// another page of memory.
    fn take<T: Real, O: Observer<T>>(&mut self, region: &Region<T>, observer: &O, at: impl Fn(u16) -> Option<u16>) {
        for cell in 0..1u32 << self.side_log2 {
            let x = self.draw(cell, region.width());
            if !region.contains(x, self.y) || region.masked(x, self.y) {
                continue;
            }
            observer.pixel(x, self.y);
            if let Some(v) = at(x) {
                self.histogram.count(v);
            }
        }
        self.cells += 1;
        self.y = self.draw(self.cells, region.height());
    }

    /// Returns the threshold, or the reason why there is none; `None` if a finer sample has to decide.
    fn decide<T: Real, O: Observer<T>>(
        &self,
        gate: &Gate,
        config: &Config,
        last: Option<u16>,
        observer: &O,
    ) -> Option<Result<Level<T>, Status>> {
        let (sample, full) = (&self.histogram, u32::from(self.full_scale));
        let mean = sample.mean::<T>()?;
        let fraction = mean / T::from_f64(f64::from(full));
        if fraction < T::from_f64(gate.min_mean) {
            return Some(Err(Status::TooDark));
        }
        if fraction > T::from_f64(gate.max_mean) {
            return Some(Err(Status::TooBright));
        }
        let level = match config.method {
            Method::Fixed => fixed_level::<T>(config, self.full_scale),
            Method::Dynamic => Some(counts(mean * T::from_f64(config.factor))),
            Method::Track if last.is_some() => last,
            Method::Otsu | Method::Track => sample.otsu::<T>(full).map(|l| counts(l * T::from_f64(config.scale))),
        };
        let level = level?;
        observer.level(level, mean, sample.count);
        let (dark, contrast) = sample.classes(level, mean);
        Some(Ok(Level { level, mean, samples: sample.count, dark, contrast }))
    }
}

impl Histogram {
    fn count(&mut self, v: u16) {
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

    fn bin(&self, v: u32) -> Option<usize> {
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
    fn classes<T: Real>(&self, level: u16, mean: T) -> (T, T) {
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
        T::from_f64(f64::from(self.first))
    }

    fn mean<T: Real>(&self) -> Option<T> {
        (self.count > 0).then(|| T::from_f64(self.sum as f64) / T::from_f64(f64::from(self.count)))
    }

    /// Returns Otsu's threshold in counts: it maximises the variance between the classes. If several thresholds reach
    /// the maximum, the result is their middle. `None` if the classes are too close to each other.
    fn otsu<T: Real>(&self, full_scale: u32) -> Option<T> {
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
        let apart = contrast >= T::from_f64(LEAST_CONTRAST * f64::from(full_scale)) || {
            let spread = self.spread::<T>(first, dark) * scale;
            contrast >= (spread * T::from_f64(LEAST_SPREADS)).max(T::from_f64(LEAST_COUNTS))
        };
        // The lit class begins one bin above the dark class.
        let level = T::from_f64(f64::from(first + last)) * T::from_f64(0.5) + T::one() + self.offset();
        (apart && contrast >= T::from_f64(2.0)).then_some(level * scale)
    }

    /// Returns the standard deviation of the bins up to number `last` about `mean`, in bins. It includes the rounding
    /// to bins.
    #[cold]
    fn spread<T: Real>(&self, last: u32, mean: T) -> T {
        let (mut count, mut sum) = (0u32, T::from_f64(0.0));
        for (&n, k) in self.bins.iter().zip(0..=last) {
            let off = T::from_f64(f64::from(k)) - mean;
            sum += T::from_f64(f64::from(n)) * off * off;
            count += u32::from(n);
        }
        (sum / T::from_f64(f64::from(count.max(1))) + T::from_f64(1.0 / 12.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Grey, Layout};
    use crate::model::observer::Unobserved;
    use std::vec::Vec;

    fn level(data: &[u16], bits: u8, gate: Gate, config: Config) -> Result<Level<f64>, Status> {
        let picture = Grey::try_new(data, Layout::packed(64, 64, 1, bits)).unwrap();
        split(&picture, &Region::whole(64, 64), &gate, &config, None, 1, &Unobserved)
    }

    /// The upper part is dark, the lower part is lit.
    fn halves(dark: u16, lit: u16) -> Vec<u16> {
        (0..64 * 64).map(|i| if i < 64 * 24 { dark } else { lit }).collect()
    }

    #[test]
    fn otsu_stands_half_way_between_two_values() {
        let found = level(&halves(10, 210), 8, Gate::default(), Config::default()).unwrap();
        assert_eq!((found.level, found.samples), (110, 256));
        // With 12 bits, the threshold is in the counts of the picture.
        let found = level(&halves(100, 3900), 12, Gate::default(), Config::default()).unwrap();
        assert!(found.level.abs_diff(2000) <= 16, "{}", found.level);
    }

    #[test]
    fn fixed_and_dynamic_follow_the_configuration() {
        let data = halves(10, 210);
        let fixed = Config { method: Method::Fixed, level: 77.0, ..Config::default() };
        assert_eq!(level(&data, 8, Gate::default(), fixed).unwrap().level, 77);
        let part = Config { level: 0.9, ..fixed };
        assert_eq!(level(&data, 8, Gate::default(), part).unwrap().level, 229);
        assert_eq!(level(&data, 12, Gate::default(), part).unwrap().level, 3685);
        let dynamic = Config { method: Method::Dynamic, factor: 0.5, ..Config::default() };
        let found = level(&data, 8, Gate::default(), dynamic).unwrap();
        assert_eq!(f64::from(found.level), (found.mean * 0.5).floor());
        assert!((found.mean - 135.0).abs() < 10.0);
    }

    #[test]
    fn gates_and_flat_pictures_have_their_status() {
        let gate = Gate { min_mean: 0.1, max_mean: 0.9 };
        assert_eq!(level(&halves(1, 2), 8, gate, Config::default()).unwrap_err(), Status::TooDark);
        assert_eq!(level(&halves(250, 255), 8, gate, Config::default()).unwrap_err(), Status::TooBright);
        assert_eq!(level(&halves(100, 100), 8, gate, Config::default()).unwrap_err(), Status::NoLimb);
    }

    #[test]
    fn a_thermal_camera_uses_a_small_part_of_its_words() {
        // The contrast is 1200 of 65536 counts, which is 1.8 % of full scale or 60 standard deviations. The noise is 10
        // counts on both sides.
        let noise = |i: usize| (i * 7919 % 41) as u16;
        for sky in [0, 7000, 30_000] {
            let data: Vec<u16> = halves(sky, sky + 1200).iter().enumerate().map(|(i, v)| v + noise(i)).collect();
            let found = level(&data, 16, Gate::default(), Config::default()).unwrap();
            assert!(found.level.abs_diff(sky + 620) < 40, "{sky}: {found:?}");
            assert!((found.contrast - 1200.0).abs() < 40.0 && (found.dark - f64::from(sky) - 20.0).abs() < 40.0);
            // Half of the light is found at every brightness of the sky.
            assert!(found.at_fraction(0.5).abs_diff(sky + 320) < 40, "{sky}: {}", found.at_fraction(0.5));
            // Noise alone does not form two classes.
            let flat: Vec<u16> = (0..64 * 64).map(|i| sky + noise(i)).collect();
            assert_eq!(level(&flat, 16, Gate::default(), Config::default()).unwrap_err(), Status::NoLimb);
        }
    }

    #[test]
    fn dark_noise_is_measured_on_any_background() {
        // The noise is the sum of twelve numbers: nearly normal, with a sigma of 4 counts. It lies on a sky and on dim
        // ground.
        let mut rng = Rng::new(5);
        let mut noise = || (0..12).map(|_| f64::from(rng.below(1000)) / 1000.0).sum::<f64>() * 4.0;
        let ground = |i: usize| if i < 64 * 12 { 30 } else { 0 };
        let data: Vec<u16> = halves(10, 190)
            .iter()
            .enumerate()
            .map(|(i, &v)| v.min(190 - ground(i)) + noise() as u16 + ground(i))
            .collect();
        let picture = Grey::try_new(&data, Layout::packed(64, 64, 1, 8)).unwrap();
        let of = |level| dark_noise::<f64, _, _>(&picture, &Region::whole(64, 64), level, 7, &Unobserved);
        assert!((of(120) - 4.0).abs() < 0.8, "{}", of(120));
        assert_eq!(of(1), 0.0, "nothing is below");
    }

    #[test]
    fn bins_widen_without_losing_a_pixel() {
        let mut histogram = Histogram { bins: [0; BINS], sum: 0, count: 0, shift: 0, first: 0 };
        let values = [30_000u16, 30_100, 29_000, 31_500, 12, 65_535, 30_000];
        for (n, v) in (1u32..).zip(values) {
            histogram.count(v);
            assert_eq!(histogram.bins.iter().map(|&b| u32::from(b)).sum::<u32>(), n);
            assert!(histogram.bin(v.into()).is_some_and(|k| histogram.bins[k] > 0));
        }
        assert_eq!((histogram.shift, histogram.first), (8, 0));
    }

    #[test]
    fn a_small_body_is_found_by_the_finer_sample() {
        // 5×5 of 4096 pixels: the first sample expects 1.6 of them, the second all.
        let data: Vec<u16> = (0..64 * 64)
            .map(|i| if (29..34).contains(&(i % 64)) && (29..34).contains(&(i / 64)) { 200 } else { 0 })
            .collect();
        let found = level(&data, 8, Gate::default(), Config::default()).unwrap();
        assert!((90..=110).contains(&found.level), "{}", found.level);
    }
}
