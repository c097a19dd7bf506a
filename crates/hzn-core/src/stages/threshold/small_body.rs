//! The third sample, for a body that is smaller than the cells of the second one.

use super::histogram::Histogram;
use super::level::{Level, counts};
use super::sample::SIDES_LOG2;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::threshold::Config;
use crate::model::work;

/// Largest number of places at which the brightest pixel is searched; there are fewer where a look at the mask is dear.
// A quarter of the work budget of a flight computer, so that the search for the edge has the rest.
const MOST_PLACES: u32 = 65_536;
/// Number of pixels along each side of the window about the brightest place.
const WINDOW_PLACES: u16 = 16;
/// Half of the window's width, as a multiple of the radius of the body: the body then has a fifth of the window's area,
/// as in a picture of a limb.
const WINDOW_RADII: u16 = 2;

/// Finds the threshold of a picture in which neither sample found a second class: at the brightest place of a regular
/// grid. `radius_px` is the expected radius of the body, from which the distance between two places follows. Every disc
/// of this radius has places in it, unless the picture is so large that their number reaches its limit. Returns the
/// number of places, and the threshold if there is one.
#[cold]
pub(crate) fn split_small_body<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    config: &Config,
    radius_px: T,
    observer: &O,
) -> (u32, Option<Level<T>>) {
    let (width, height) = (region.width(), region.height());
    let area = T::from_i32(width.into()) * T::from_i32(height.into());
    let read = T::from_i32((work::READ + region.mask_cost()) as i32);
    let least = (area * read / T::from_i32(MOST_PLACES as i32)).sqrt();
    let spacing = radius_px.max(least).to_i32().clamp(1, i32::from(u16::MAX)) as u16;
    // In a cell of the second sample, such a body is no small one.
    if spacing >= (width.min(height) >> SIDES_LOG2[1]).max(1) {
        return (0, None);
    }
    let (mut drawn, mut brightest, mut at) = (0, 0, None);
    for y in (spacing / 2..height).step_by(spacing.into()) {
        for x in (spacing / 2..width).step_by(spacing.into()) {
            if !region.contains(x, y) || region.masked(x, y) {
                continue;
            }
            observer.pixel(x, y);
            drawn += 1;
            // A hot pixel is alone, so that the darkest neighbour decides. It is read only for a new brightest pixel.
            if picture.at(x, y) > brightest
                && let Some(darkest) = darkest_around(picture, region, x, y)
                && darkest > brightest
            {
                (brightest, at) = (darkest, Some((x, y)));
            }
        }
    }
    let Some((x, y)) = at else { return (drawn, None) };
    (drawn, window(picture, region, config, (x, y), spacing.saturating_mul(WINDOW_RADII), drawn, observer))
}

/// Returns the brightness of the darkest of a pixel and its four neighbours; `None` next to the border or a mask.
fn darkest_around<T: Real, P: Pixels>(picture: &P, region: &Region<T>, x: u16, y: u16) -> Option<u16> {
    let (left, above) = (x.checked_sub(1)?, y.checked_sub(1)?);
    let (right, below) = (x.checked_add(1)?, y.checked_add(1)?);
    [(x, y), (left, y), (right, y), (x, above), (x, below)].into_iter().try_fold(u16::MAX, |least, (x, y)| {
        (region.contains(x, y) && !region.masked(x, y)).then(|| least.min(picture.at(x, y)))
    })
}

/// Returns Otsu's threshold of the pixels within `half` of a place.
fn window<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    config: &Config,
    (x, y): (u16, u16),
    half: u16,
    drawn: u32,
    observer: &O,
) -> Option<Level<T>> {
    let mut histogram = Histogram::new();
    let places = |middle: u16, size: u16| {
        let (first, last) = (middle.saturating_sub(half), middle.saturating_add(half).min(size - 1));
        let step = ((last - first) / WINDOW_PLACES).max(1);
        (first..=last).step_by(step.into())
    };
    for y in places(y, region.height()) {
        for x in places(x, region.width()).filter(|&x| region.contains(x, y) && !region.masked(x, y)) {
            observer.pixel(x, y);
            histogram.count(picture.at(x, y));
        }
    }
    let (mean, otsu) = (histogram.mean()?, histogram.otsu::<T>(picture.full_scale().into())?);
    let level = counts(otsu * T::from_f64(config.scale));
    let samples = drawn + histogram.count;
    observer.level(level, mean, samples);
    Some(Level::new(&histogram, level, mean, samples, samples))
}
