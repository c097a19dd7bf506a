//! Further looks before a picture is refused: at other thresholds, and without a dark frame around the picture.
//!
//! Otsu's threshold follows the brightest parts of a picture. Most of the limb of a half-lit disc with clouds may lie
//! below this threshold, and so may the whole of a limb under a glare. A picture without an answer is therefore
//! examined again a few times, each time at another threshold. All looks draw on the one work budget of the picture.
//! Each look is also another chance for a false answer: all looks have the same gates, and there are only a few looks.

use super::budget;
use super::look::Look;
use super::sensor::Sensor;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::report::Report;
use crate::model::status::Status;
use crate::model::work;
use crate::model::work::WorkBudget;
use crate::stages::contour::BinaryPicture;
use crate::stages::threshold::{self, Level};

/// Largest number of times that the noise is measured for the first threshold. The second measurement includes the
/// noise that the first one cut off.
const NOISE_PASSES: usize = 2;

/// Returns whether the look gave no answer and a further look may give one. In a glow, every threshold has an edge.
fn goes_on<T>(report: &Report<T>) -> bool {
    // A picture that is too dark or too bright stays so at every threshold, and one without budget cannot be searched
    // again.
    matches!(report.status, Status::NoLimb | Status::TooFewPoints | Status::Rejected) && !report.glows()
}

/// The lowest threshold of a further look.
#[derive(Clone, Copy)]
struct Lowest<T> {
    /// `retry.min_sigma` above the mean of the dark pixels, in counts. Lower thresholds are passed over: there the limb
    /// was found 25 km too high.
    counts: T,
    /// The threshold to which lower ones are raised; 0 if they are not.
    raised: u16,
}

impl<T: Real> Lowest<T> {
    /// Returns the next threshold of `parts` that may be used. `looked` is the lowest threshold that was used.
    fn next(&self, parts: &mut core::slice::Iter<'_, f64>, first: &Level<T>, looked: u16) -> Option<u16> {
        // The threshold of the dark pixels themselves is only for discs, which raise it.
        let parts = parts.filter(|&&part| part > 0.0 || self.raised > 0);
        parts.map(|&part| first.at_fraction(part).max(self.raised)).find(|&level| {
            let is_new = level != self.raised || level < looked;
            is_new && T::from_i32(level.into()) >= self.counts
        })
    }
}

impl<T: Real> Sensor<T> {
    /// Runs everything after the first threshold: the looks, one after the other, until there is an answer or nothing
    /// is left to try.
    ///
    /// Without an answer, the report has the threshold of the first look. Its status is `rejected` if one of the looks
    /// was rejected, otherwise that of the last look with `no-limb` or `too-few-points`.
    // The sample for the threshold is charged here, because the budget does not exist when it is read. A frame that is
    // found stays for all looks, because it belongs to the camera and not to the threshold. `rejected` is kept, because
    // a rejected edge says more about the picture than a later look that found nothing. The noise is measured only
    // before a second look, so that a picture with an answer does not pay for its reads. The first threshold is
    // reported, because the user can set this one.
    pub(super) fn look_at_levels<P: Pixels, O: Observer<T>>(&self, mut look: Look<'_, T, P, O>, first: &Level<T>) {
        let config = &self.config;
        let Look { picture, expected, observer, .. } = look;
        // A `fixed` threshold is kept: there are no other thresholds.
        let fixed = config.threshold_of(expected.which).method == threshold::Method::Fixed;
        let mut others = if fixed { [].iter() } else { config.retry.levels.iter() };
        let (mut work, read) = (budget::new(config, look.lists.border.len()), work::READ + self.region.mask_cost());
        work.charge(first.drawn * read);
        let (mut within, mut status, mut lowest) = (None, None, None);
        let (mut first, mut is_cleared) = (*first, P::STREAMED);
        self.raise_above_noise(&look, &mut first, &mut work);
        let set_level = first.level;
        // The lowest threshold of all looks.
        let mut looked = set_level;
        look.report.level = first.level;
        loop {
            let level = look.report.level;
            let split = |region| {
                BinaryPicture::new(picture, region, level, observer)
                    .with_blooming(expected.blooms())
                    .with_tone(config.input.tone)
                    .with_contrast(first.contrast)
            };
            if within.is_none() {
                let frame = split(&self.region).dark_frame_px(config.retry.frame_px, &mut work);
                if frame > 0 {
                    observer.dark_frame(frame);
                    within = Some(self.region.without_frame(frame));
                }
            }
            let binary = split(within.as_ref().unwrap_or(&self.region));
            work = self.search(look.reborrow(), &binary, work);
            if !goes_on(look.report) {
                break;
            }
            if status != Some(Status::Rejected) {
                status = Some(look.report.status);
            }
            if others.len() == 0 || !work.try_spend(work::LOOK) {
                break;
            }
            if !core::mem::replace(&mut is_cleared, true) && self.leave_out_lost_blocks(&look, &mut first, &mut work) {
                look.report.level = first.level;
                observer.look(look.report.counters.looks, first.level);
                continue;
            }
            let lowest = *lowest.get_or_insert_with(|| self.lowest_level(&look, &first, &mut work));
            let Some(level) = lowest.next(&mut others, &first, looked) else { break };
            looked = looked.min(level);
            look.report.level = level;
            observer.look(look.report.counters.looks, level);
        }
        if let Some(status) = status
            && look.report.solution.is_none()
        {
            (look.report.status, look.report.level) = (status, set_level);
        }
    }

    /// Measures the noise of the dark pixels for the lowest threshold of the further looks.
    ///
    /// Thresholds within the noise are raised above it for a disc that fits into the picture: this look shows the whole
    /// lit limb of a half-lit disc.
    // For a limb near by, such a look answered more airglow and aurora, and no more limbs.
    fn lowest_level<P: Pixels, O: Observer<T>>(
        &self,
        look: &Look<'_, T, P, O>,
        first: &Level<T>,
        work: &mut WorkBudget,
    ) -> Lowest<T> {
        let Look { picture, expected, observer, .. } = *look;
        work.charge(threshold::NOISE_READS * (work::READ + self.region.mask_cost()));
        let noise = threshold::dark_noise(picture, &self.region, first.level, self.config.consensus.seed, observer);
        let above = noise * T::from_f64(self.config.retry.min_sigma);
        let is_disc = expected.phases && expected.fits_into(&self.camera);
        Lowest { counts: first.dark + above, raised: if is_disc { first.at_noise(above) } else { 0 } }
    }

    /// Raises a threshold within the noise of the dark pixels to `retry.min_sigma` above their mean: there an edge
    /// would follow the noise. The noise is measured only if the spread of the dark pixels, which includes it, allows
    /// that the threshold is too low.
    fn raise_above_noise<P: Pixels, O: Observer<T>>(
        &self,
        look: &Look<'_, T, P, O>,
        first: &mut Level<T>,
        work: &mut WorkBudget,
    ) {
        let Look { picture, observer, expected, .. } = *look;
        if P::STREAMED || self.config.threshold_of(expected.which).method == threshold::Method::Fixed {
            return;
        }
        let least = T::from_f64(self.config.retry.min_sigma);
        let above = |level: u16| T::from_i32(level.into()) - first.dark;
        // Noise that is clipped at 0 counts spreads half as far.
        if above(first.level) >= (first.spread + first.spread) * least {
            return;
        }
        let mut level = first.level;
        for _ in 0..NOISE_PASSES {
            work.charge(threshold::NOISE_READS * (work::READ + self.region.mask_cost()));
            // Within the noise, the pixels below the threshold are only a part of it; twice as far are nearly all.
            let twice = Level { level, ..*first }.at_fraction(2.0);
            let noise = threshold::dark_noise(picture, &self.region, twice, self.config.consensus.seed, observer);
            if above(level) >= noise * least {
                break;
            }
            level = first.at_noise(noise * least);
        }
        if level != first.level {
            first.level = level;
            observer.level(level, first.mean, first.samples);
        }
    }

    /// Replaces the threshold by that of the picture without lost blocks. Returns false if there are none, or if they
    /// change nothing.
    fn leave_out_lost_blocks<P: Pixels, O: Observer<T>>(
        &self,
        look: &Look<'_, T, P, O>,
        first: &mut Level<T>,
        work: &mut WorkBudget,
    ) -> bool {
        work.charge(threshold::LOST_READS * (work::READ + self.region.mask_cost()));
        let levels = self.config.threshold_of(look.expected.which);
        let seed = self.config.consensus.seed;
        match threshold::without_lost_blocks(look.picture, &self.region, levels, seed, look.observer) {
            Some(found) if found.level != first.level => {
                *first = found;
                true
            }
            _ => false,
        }
    }
}
