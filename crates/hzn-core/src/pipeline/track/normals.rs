//! Border pixels next to a predicted limb: a short search across it at each of its places.

use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work;
use crate::stages::contour::{BinaryPicture, Thinned};

/// Largest distance of the edge from its predicted place, pixels.
pub(super) const REACH_PX: u16 = 24;
/// The search gives up after so many places in a row without an edge.
const MOST_MISSES: u32 = 8;
/// Smallest part of the places with an edge, in tenths.
const LEAST_TENTHS: usize = 9;
/// Rows above and below a place that the search and the profile of a sharp edge usually read.
const TOUCHED_ROWS: u16 = 6;
/// The brightness is compared at every so many edges, and so many pixels beside them.
const EVERY: usize = 4;
const BESIDE_PX: i32 = 4;

/// Finds the border pixels of the edge along predicted `places`, and stores them in `edge`. Returns the fraction of the
/// way from the dark to the lit side at which the threshold lies; `None` if there is no such edge.
pub(super) fn search<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    places: &[Pixel],
    edge: &mut Thinned<'_>,
    cost: &mut u32,
) -> Option<T> {
    touch(binary, places);
    let mut beside = Beside::default();
    let (mut found, mut misses) = (0, 0);
    for (place, &pixel) in places.iter().enumerate() {
        let before = place.checked_sub(1).and_then(|i| places.get(i));
        let inwards = inwards(before, pixel, places.get(place + 1))?;
        let mut reads = 1;
        let border = border_at(binary, pixel, inwards, &mut reads);
        *cost += reads * work::READ;
        let Some(border) = border else {
            misses += 1;
            if misses >= MOST_MISSES {
                return None;
            }
            continue;
        };
        misses = 0;
        edge.push(border);
        if found % EVERY == 0 {
            beside.look(binary, border, inwards);
        }
        found += 1;
    }
    (found * 10 >= places.len() * LEAST_TENTHS).then(|| beside.part_of(binary.level)).flatten()
}

/// Reads what the search and the edge points will read, as far as it lies in other rows. These reads do not wait for
/// each other, so that the memory delivers their lines at once; the search itself waits for each pixel.
fn touch<T: Real, P: Pixels, O: Observer<T>>(binary: &BinaryPicture<'_, T, P, O>, places: &[Pixel]) {
    let mut sum = 0u32;
    let mut before = None;
    for (place, &pixel) in places.iter().enumerate() {
        let rows = match inwards(before, pixel, places.get(place + 1)) {
            Some((0, _)) => TOUCHED_ROWS,
            _ => 1,
        };
        before = places.get(place);
        let mut index = binary.picture.index(pixel.x, pixel.y.saturating_sub(rows));
        for y in pixel.y.saturating_sub(rows)..=pixel.y.saturating_add(rows) {
            binary.observer.pixel(pixel.x, y);
            sum = sum.wrapping_add(binary.picture.read(index).into());
            index = index.wrapping_add(binary.picture.down());
        }
    }
    core::hint::black_box(sum);
}

/// Returns the step into the body along the axis of the larger component. The body is on the left of the way along the
/// limb, as seen on the screen. Of the two neighbours the nearer one counts, because the way may leap from one part of
/// the limb in view to another.
fn inwards(before: Option<&Pixel>, here: Pixel, after: Option<&Pixel>) -> Option<(i32, i32)> {
    let way = |from: Pixel, to: Pixel| (i32::from(to.x) - i32::from(from.x), i32::from(to.y) - i32::from(from.y));
    let length = |way: &(i32, i32)| way.0.abs() + way.1.abs();
    let ways = [before.map(|b| way(*b, here)), after.map(|a| way(here, *a))];
    let (dx, dy) = ways.into_iter().flatten().min_by_key(length)?;
    Some(if dx.abs() >= dy.abs() { (0, -dx.signum()) } else { (dy.signum(), 0) })
}

/// Returns the lit pixel at the edge: from a lit pixel outwards, from a dark one inwards. Near a mask or the border of
/// the picture the search is shorter, because an edge there is none of the body.
fn border_at<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    from: Pixel,
    (dx, dy): (i32, i32),
    reads: &mut u32,
) -> Option<Pixel> {
    let picture = binary.picture;
    let mut index = picture.index(from.x, from.y);
    let is_lit = picture.read(index) >= binary.level;
    let (dx, dy) = if is_lit { (-dx, -dy) } else { (dx, dy) };
    let step = dx as isize * picture.across() as isize + dy as isize * picture.down() as isize;
    for px in 1..=i32::from(binary.clearance(from.x, from.y, REACH_PX)) {
        index = index.wrapping_add_signed(step);
        let at = |px: i32| Pixel { x: (i32::from(from.x) + dx * px) as u16, y: (i32::from(from.y) + dy * px) as u16 };
        let next = at(px);
        *reads += 1;
        binary.observer.pixel(next.x, next.y);
        if (picture.read(index) >= binary.level) != is_lit {
            return Some(if is_lit { at(px - 1) } else { next });
        }
    }
    None
}

/// The brightness on both sides of the edge.
#[derive(Default)]
struct Beside {
    dark: u32,
    lit: u32,
    count: i32,
}

impl Beside {
    fn look<T: Real, P: Pixels, O: Observer<T>>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        at: Pixel,
        (dx, dy): (i32, i32),
    ) {
        let read = |px: i32| {
            let (x, y) = (i32::from(at.x) + dx * px, i32::from(at.y) + dy * px);
            binary.region.is_usable(x, y).then(|| u32::from(binary.brightness(x as u16, y as u16)))
        };
        if let (Some(dark), Some(lit)) = (read(-BESIDE_PX), read(BESIDE_PX)) {
            self.dark += dark;
            self.lit += lit;
            self.count += 1;
        }
    }

    fn part_of<T: Real>(&self, level: u16) -> Option<T> {
        let of = |sum: u32| T::from_i32(sum as i32) / T::from_i32(self.count.max(1));
        let (dark, lit) = (of(self.dark), of(self.lit));
        (lit > dark).then(|| (T::from_i32(level.into()) - dark) / (lit - dark))
    }
}
