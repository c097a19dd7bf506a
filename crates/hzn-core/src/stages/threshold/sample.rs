//! The sparse sample of a picture that is in memory or arrives row by row.

use super::histogram::Histogram;
use super::level::{Level, counts, fixed_level};
use crate::base::real::Real;
use crate::base::rng::Rng;
use crate::image;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::status::Status;
use crate::model::threshold::{Brightness, Config, Method};

/// Ratio of sigma to the mean distance between two values of a normal distribution: √π/2.
pub(super) const SIGMA_PER_MEAN_DISTANCE: f64 = 0.886_226_925_452_758;

/// Number of cells along each side of the first and of the second sample, as powers of two.
// 256 pixels suffice for a limb. The second sample of 4096 is for a body that falls between them.
pub(super) const SIDES_LOG2: [u32; 2] = [4, 6];

/// Both samples of a picture that arrives row by row.
#[derive(Debug)]
// Both samples are drawn at once, because the rows do not come again when the first one does not decide.
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
            // A picture with fewer rows than cells samples a row several times.
            while sample.row() == Some(y) {
                sample.take(region, observer, |x| Some(row.get(usize::from(x)).map_or(0, |&s| s.into())));
            }
        }
    }
    /// Finds the threshold as [`split`] does.
    pub(crate) fn split<T: Real, O: Observer<T>>(
        &self,
        brightness: &Brightness,
        config: &Config,
        last: Option<u16>,
        observer: &O,
    ) -> Result<Level<T>, Status> {
        self.0.iter().find_map(|s| s.decide(brightness, config, last, observer)).unwrap_or(Err(Status::NoLimb))
    }
}

/// A sample that is not complete yet. Its rows come one after another.
#[derive(Debug)]
pub(super) struct Sample {
    pub(super) histogram: Histogram,
    rng: Rng,
    side_log2: u32,
    full_scale: u16,
    /// Number of the current row of cells. `y` is the row of the picture that is sampled in it.
    cells: u32,
    y: u16,
}

impl Sample {
    pub(super) fn new<T: Real>(seed: u32, side_log2: u32, full_scale: u16, region: &Region<T>) -> Self {
        let histogram = Histogram::new();
        let mut sample = Self { histogram, rng: Rng::new(seed), side_log2, full_scale, cells: 0, y: 0 };
        sample.y = sample.draw(0, region.height());
        sample
    }

    /// Draws a pixel coordinate in cell number `cell` of a side of `length` pixels.
    fn draw(&mut self, cell: u32, length: u16) -> u16 {
        let length = u32::from(length);
        // 65 535 times 65 535 just fits 32 bits, so that no wider product is needed.
        ((cell * length + ((length * self.rng.below(65536)) >> 16)) >> self.side_log2) as u16
    }

    /// Returns the row of the picture that is sampled next; rows come in order.
    pub(super) fn row(&self) -> Option<u16> {
        (self.cells < 1 << self.side_log2).then_some(self.y)
    }

    /// Samples the row that [`Self::row`] returns. All cells of a row of cells use one row of the picture, because each
    /// row of the picture is on another page of memory.
    pub(super) fn take<T: Real, O: Observer<T>>(
        &mut self,
        region: &Region<T>,
        observer: &O,
        at: impl Fn(u16) -> Option<u16>,
    ) {
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
    pub(super) fn decide<T: Real, O: Observer<T>>(
        &self,
        brightness: &Brightness,
        config: &Config,
        last: Option<u16>,
        observer: &O,
    ) -> Option<Result<Level<T>, Status>> {
        let (sample, full) = (&self.histogram, u32::from(self.full_scale));
        let mean = sample.mean::<T>()?;
        let fraction = mean / T::from_f64(f64::from(full));
        if fraction < T::from_f64(brightness.min_mean) {
            return Some(Err(Status::TooDark));
        }
        if fraction > T::from_f64(brightness.max_mean) {
            return Some(Err(Status::TooBright));
        }
        let level = match config.method {
            Method::Fixed => fixed_level::<T>(config, self.full_scale),
            Method::Dynamic => Some(counts(mean * T::from_f64(config.factor))),
            // Without an answer in the previous picture there is nothing to follow, so that Otsu's threshold begins
            // again.
            Method::Track if last.is_some() => last,
            Method::Otsu | Method::Track => sample.otsu::<T>(full).map(|l| counts(l * T::from_f64(config.scale))),
        };
        let level = level?;
        observer.level(level, mean, sample.count);
        let sides = SIDES_LOG2.iter().take_while(|&&side| side <= self.side_log2);
        let drawn = sides.map(|side| 1 << (2 * side)).sum();
        Some(Ok(Level::new(sample, level, mean, sample.count, drawn)))
    }
}
