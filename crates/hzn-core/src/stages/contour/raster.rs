//! Outer borders in raster order, as in HORACE's topological search: algorithm 2 of Suzuki & Abe 1985.
//!
//! The whole picture is scanned row by row. A border begins at a lit pixel with a dark one to its left, unless this
//! border has been followed already, and unless the scan is inside another border. Pixels in a hole are therefore
//! ignored. The original algorithm labels the picture. Here one bit per pixel replaces the labels. A bit is set for lit
//! pixels of a followed border with a dark pixel to their left: there the scan enters the border. A bit is also set for
//! dark pixels to the right of a followed border: there the scan leaves the border.
//!
//! A border along the side of the picture or along a mask is no edge. The border is split into the pieces between these
//! parts.

use super::BinaryPicture;
use super::follow::STEPS;
use super::thinned::Thinned;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::observer::Observer;

const EAST: u8 = 0;
const WEST: u8 = 4;

/// How the scan ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scanned {
    /// The scan ended at the last pixel, or `found` stopped it.
    All,
    /// The steps are used up, or the picture has more pixels than there are bits.
    Truncated,
}

/// One bit for each pixel of the picture.
struct Bits<'a> {
    words: &'a mut [u32],
    width: usize,
}

impl Bits<'_> {
    fn place(&self, x: u16, y: u16) -> (usize, u32) {
        let bit = usize::from(y) * self.width + usize::from(x);
        (bit / 32, 1 << (bit % 32))
    }
    fn set(&mut self, x: u16, y: u16) {
        let (word, bit) = self.place(x, y);
        if let Some(word) = self.words.get_mut(word) {
            *word |= bit;
        }
    }
    fn get(&self, x: u16, y: u16) -> bool {
        let (word, bit) = self.place(x, y);
        self.words.get(word).is_some_and(|w| w & bit != 0)
    }
}

/// Calls `found` with every piece of every outer border, stored in `buffer`, until it returns `false`. Each border
/// pixel that is followed reduces `steps` by one.
pub(crate) fn each_border<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    words: &mut [u32],
    buffer: &mut [Pixel],
    steps: &mut u32,
    mut found: impl FnMut(&Thinned<'_>) -> bool,
) -> Scanned {
    let (width, height) = (binary.region.width(), binary.region.height());
    let need = (usize::from(width) * usize::from(height)).div_ceil(32);
    // Without a bit for every pixel the scan would find borders inside of others, so it does not begin.
    let Some(words) = words.get_mut(..need) else { return Scanned::Truncated };
    // The words still hold the marks of the body that was looked for before.
    words.fill(0);
    let mut bits = Bits { words, width: usize::from(width) };
    for y in 0..height {
        let (mut outside, mut before) = (true, false);
        for x in 0..width {
            let lit = is_lit_inside(binary, i32::from(x), i32::from(y));
            if lit && !before && outside && !bits.get(x, y) {
                let start = At { pixel: Pixel { x, y }, back: WEST };
                // The first walk only counts, because it is known after it whether and where the border is cut.
                let Some(border) = follow(binary, start, u32::MAX, &mut bits, steps, |_, _| true) else {
                    return Scanned::Truncated;
                };
                // The second walk begins at a cut, if there is one, so that the start does not cut a piece in two.
                let (from, length) = (border.cut.unwrap_or(start), border.length);
                let mut piece = Thinned::new(buffer);
                let mut go_on = true;
                let again = follow(binary, from, length, &mut bits, steps, |pixel, cut| {
                    if !cut {
                        piece.push(pixel);
                    } else if piece.total() > 0 {
                        go_on = found(&piece);
                        piece.clear();
                    }
                    go_on
                });
                if again.is_none() {
                    return Scanned::Truncated;
                }
                if go_on && piece.total() > 0 {
                    go_on = found(&piece);
                }
                if !go_on {
                    return Scanned::All;
                }
            }
            if bits.get(x, y) {
                outside = !lit;
            }
            before = lit;
        }
    }
    Scanned::All
}

/// Returns whether a pixel is in the region, lit, and not masked.
fn is_lit_inside<T: Real, P: Pixels, O: Observer<T>>(binary: &BinaryPicture<'_, T, P, O>, x: i32, y: i32) -> bool {
    let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return false };
    binary.region.contains(x, y) && binary.lit(x, y)
}

/// A pixel of a border, and the direction back to where the follower came from.
#[derive(Debug, Clone, Copy)]
struct At {
    pixel: Pixel,
    back: u8,
}

/// A border after it was followed once around.
struct Border {
    length: u32,
    /// A pixel of the border that is no edge point.
    cut: Option<At>,
}

/// Follows an outer border counter-clockwise as seen on the screen: once around, at most `most` pixels, or until
/// `visit` returns `false`. `visit` receives every pixel, and `true` if the pixel is no edge point because the border
/// faces the end of the region or a mask there. The result is `None` if the steps are used up.
fn follow<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    start: At,
    most: u32,
    bits: &mut Bits<'_>,
    steps: &mut u32,
    mut visit: impl FnMut(Pixel, bool) -> bool,
) -> Option<Border> {
    let mut at = start;
    let mut border = Border { length: 0, cut: None };
    while border.length < most {
        *steps = steps.checked_sub(1)?;
        let here = at.pixel;
        let (mut next, mut cut, mut home) = (None, false, false);
        for turn in 1..=8u8 {
            let d = (at.back + turn) & 7;
            let (dx, dy) = STEPS[usize::from(d & 7)];
            let (x, y) = (i32::from(here.x) + dx, i32::from(here.y) + dy);
            if is_lit_inside(binary, x, y) {
                next = Some(At { pixel: Pixel { x: x as u16, y: y as u16 }, back: (d + 4) & 7 });
                break;
            }
            // Only neighbours that share a side with the pixel matter here; a corner beyond the region counts as dark.
            cut |= d.is_multiple_of(2) && is_beyond_or_masked(binary, x, y);
            if d == WEST {
                bits.set(here.x, here.y);
            } else if d == EAST && x < i32::from(binary.region.width()) {
                bits.set(x as u16, here.y);
            }
            // The walk is complete: it is at the start again, and at the dark pixel where it began.
            if most == u32::MAX && border.length > 0 && here == start.pixel && d == start.back {
                home = true;
                break;
            }
        }
        if home {
            break;
        }
        border.length += 1;
        if cut && border.cut.is_none() {
            border.cut = Some(at);
        }
        if !visit(here, cut) {
            break;
        }
        match next {
            Some(to) => at = to,
            // The border is a single pixel.
            None => break,
        }
    }
    Some(border)
}

/// Returns whether the pixel is beyond the region, or bright enough to be lit but masked.
fn is_beyond_or_masked<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
) -> bool {
    let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return true };
    !binary.region.contains(x, y) || (binary.region.masked(x, y) && binary.picture.at(x, y) >= binary.level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::region::Region;
    use crate::image::{Grey, Layout};
    use crate::model::observer::Unobserved;
    use std::collections::BTreeMap;
    use std::vec;
    use std::vec::Vec;

    type Points = Vec<(u16, u16)>;

    fn borders(data: &[u8], w: u16, h: u16) -> Vec<Points> {
        let picture = Grey::try_new(data, Layout::packed(w.into(), h.into(), 1, 8)).unwrap();
        let region = Region::<f64>::whole(w, h);
        let binary = BinaryPicture::new(&picture, &region, 128, &Unobserved);
        let (mut words, mut buffer, mut steps) = (vec![0u32; 4096], vec![Pixel::default(); 4096], 1_000_000);
        let mut found = Vec::new();
        let ended = each_border(&binary, &mut words, &mut buffer, &mut steps, |piece| {
            found.push(piece.pixels().iter().map(|p| (p.x, p.y)).collect());
            true
        });
        assert_eq!(ended, Scanned::All);
        found
    }

    /// Compares with `tests/golden/contours.json`: OpenCV 5.0 `findContours`, RETR_EXTERNAL, CHAIN_APPROX_NONE. A dark
    /// frame is added, because OpenCV counts the outside as dark.
    #[test]
    fn external_borders_equal_opencv_point_for_point() {
        let golden: serde_json::Value =
            serde_json::from_str(include_str!("../../../tests/golden/contours.json")).unwrap();
        let (mut compared, mut nested) = (0, 0);
        for case in golden["cases"].as_array().unwrap() {
            let rows: Vec<&str> = case["rows"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()).collect();
            let (w, h) = (rows[0].len() + 2, rows.len() + 2);
            let mut data = vec![0u8; w * h];
            for (y, row) in rows.iter().enumerate() {
                for (x, c) in row.bytes().enumerate() {
                    data[(y + 1) * w + x + 1] = if c == b'#' { 200 } else { 10 };
                }
            }
            let read = |name: &str| -> BTreeMap<(u16, u16), Points> {
                serde_json::from_value::<Vec<Points>>(case[name].clone())
                    .unwrap()
                    .into_iter()
                    .map(|c| c.into_iter().map(|(x, y)| (x + 1, y + 1)).collect::<Points>())
                    .map(|c| (c[0], c))
                    .collect()
            };
            let want = read("external");
            let got: BTreeMap<_, _> = borders(&data, w as u16, h as u16).into_iter().map(|c| (c[0], c)).collect();
            assert_eq!(got, want, "{}", case["id"]);
            compared += got.len();
            nested += read("all_outer").len() - want.len();
        }
        assert!(compared > 20 && nested > 0, "{compared} {nested}");
    }

    #[test]
    fn the_side_of_the_picture_is_no_edge() {
        // The sky is above, the ground below and on both sides: one piece, without the columns at the sides.
        let data: Vec<u8> = (0..8 * 6).map(|i| if i / 8 >= 2 { 200 } else { 0 }).collect();
        assert_eq!(borders(&data, 8, 6), [(1..7).rev().map(|x| (x, 2)).collect::<Points>()]);
        // A picture that is lit everywhere has no edge, and neither has a dark one.
        assert!(borders(&[200; 48], 8, 6).is_empty() && borders(&[0; 48], 8, 6).is_empty());
        // A single lit pixel is one border.
        let mut data = [0u8; 48];
        data[19] = 255;
        assert_eq!(borders(&data, 8, 6), [[(3, 2)]]);
    }

    #[test]
    fn short_lists_truncate_the_scan() {
        let data: Vec<u8> = (0..64 * 64).map(|i| if (i / 7) % 3 == 0 { 200 } else { 0 }).collect();
        let picture = Grey::try_new(&data, Layout::packed(64, 64, 1, 8)).unwrap();
        let region = Region::<f32>::whole(64, 64);
        let binary = BinaryPicture::new(&picture, &region, 128, &Unobserved);
        let mut buffer = vec![Pixel::default(); 64];
        let mut run = |words: usize, mut steps: u32| {
            each_border(&binary, &mut vec![u32::MAX; words], &mut buffer, &mut steps, |_| true)
        };
        assert_eq!(run(127, 1_000_000), Scanned::Truncated);
        assert_eq!(run(128, 100), Scanned::Truncated);
        assert_eq!(run(128, 1_000_000), Scanned::All);
    }
}
