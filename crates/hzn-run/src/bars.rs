//! Finds black bars along the sides of pictures, as letterboxing writes them, and white frames of scans and
//! screenshots. Where a bright body meets a bar, the
//! bar's border is a sharp edge, which may be joined with the limb.
//!
//! A bar is constant, the same in all pictures, and its border is straight along the side of the picture. A dark sky is
//! not: it has noise, and the limb before it bends and moves. An overexposed ground has no noise, and its limb may stay
//! where it is, so that bright bars count only at two opposite sides.

use hzn_files::start::Bars;

use crate::source::Picture;

/// Fewer pictures do not show what stays.
const MIN_PICTURES: usize = 3;
/// Share of the contrast above the level of the bar at which the content begins.
const CONTENT: f64 = 0.25;
/// Largest spread of the pixels of a bar over all pictures, as a share of the contrast. Codecs keep a constant area
/// within this; the noise of a dark sky spreads wider.
const CONSTANT: f64 = 0.04;
/// Pixels of a bar next to the content that may have the ringing of a codec, whose blocks have 8 pixels.
const RINGING_PX: usize = 8;
/// Share of the columns (for a bar above or below) whose content begins at the bar, in at least one picture.
const MIN_SHARE: f64 = 0.4;
/// Share of the columns in one picture, for it to count as a picture with content at the bar.
const MIN_SHARE_EACH: f64 = 0.05;
/// The content of a column begins at the bar if it begins within this many pixels.
const STRAIGHT_PX: usize = 1;
/// Lines across a side that are looked at.
const LINES: u32 = 256;

/// Returns the bars of some pictures of one camera; `None` if they have no bars, or if too few pictures show it.
pub fn find_bars(pictures: &[Picture]) -> Option<Bars> {
    let first = pictures.first().filter(|_| pictures.len() >= MIN_PICTURES)?;
    let size = |p: &Picture| (p.layout.width, p.layout.height);
    if pictures.iter().any(|p| size(p) != size(first)) {
        return None;
    }
    let contrast = contrast(pictures)?;
    let bars = |bright| {
        let at = |side| width_px(pictures, side, contrast, bright).unwrap_or(0);
        let [left_px, right_px, top_px, bottom_px] = [Side::Left, Side::Right, Side::Top, Side::Bottom].map(at);
        Bars { left_px, right_px, top_px, bottom_px, bright }
    };
    let black = bars(false);
    if black != Bars::default() {
        return Some(black);
    }
    let mut frame = bars(true);
    if frame.left_px == 0 || frame.right_px == 0 {
        (frame.left_px, frame.right_px) = (0, 0);
    }
    if frame.top_px == 0 || frame.bottom_px == 0 {
        (frame.top_px, frame.bottom_px) = (0, 0);
    }
    (frame != Bars { bright: true, ..Bars::default() }).then_some(frame)
}

/// Returns the difference between the bright and the darkest parts of all pictures.
fn contrast(pictures: &[Picture]) -> Option<f64> {
    let mut levels: Vec<f64> = Vec::new();
    for picture in pictures {
        let (w, h) = (picture.layout.width, picture.layout.height);
        let (across, down) = ((w / 64).max(1) as usize, (h / 64).max(1) as usize);
        let places = (0..h).step_by(down).flat_map(|y| (0..w).step_by(across).map(move |x| (x, y)));
        levels.extend(places.map(|(x, y)| picture.brightness(x, y)));
    }
    levels.sort_by(f64::total_cmp);
    let bright = levels.get(levels.len() * 95 / 100)?;
    Some(bright - levels.first()?).filter(|contrast| *contrast > 0.0)
}

#[derive(Debug, Clone, Copy)]
enum Side {
    Left,
    Right,
    Top,
    Bottom,
}

impl Side {
    /// Returns the number of pixels along the side, and across it.
    fn lengths(self, picture: &Picture) -> (u32, u32) {
        let (w, h) = (picture.layout.width, picture.layout.height);
        if matches!(self, Self::Top | Self::Bottom) { (w, h) } else { (h, w) }
    }
    /// Returns the brightness of the pixel `along` the side, `depth` pixels from it.
    fn level(self, picture: &Picture, along: u32, depth: u32) -> f64 {
        let (w, h) = (picture.layout.width, picture.layout.height);
        let (x, y) = match self {
            Self::Left => (depth, along),
            Self::Right => (w.saturating_sub(1 + depth), along),
            Self::Top => (along, depth),
            Self::Bottom => (along, h.saturating_sub(1 + depth)),
        };
        picture.brightness(x, y)
    }
}

/// Returns the width of the bar at a side, which is brighter than its content or darker; `None` if there is none.
fn width_px(pictures: &[Picture], side: Side, contrast: f64, bright: bool) -> Option<u32> {
    let (length, across) = side.lengths(pictures.first()?);
    let lines: Vec<u32> = (0..length).step_by((length / LINES).max(1) as usize).collect();
    let ground = side.level(pictures.first()?, length / 2, 0);
    // The depth at which the content begins, for each line of a picture.
    let begins = |picture: &Picture| -> Vec<Option<u32>> {
        let sign = if bright { -1.0 } else { 1.0 };
        let is_content = |along, depth: &u32| (side.level(picture, along, *depth) - ground) * sign > CONTENT * contrast;
        lines.iter().map(|along| (0..across / 2).find(|depth| is_content(*along, depth))).collect()
    };
    let each: Vec<Vec<Option<u32>>> = pictures.iter().map(begins).collect();
    let bar = each.iter().flatten().flatten().min().copied().filter(|px| *px > 0)?;
    let is_near = |begin: &Option<u32>| begin.is_some_and(|px| px <= bar + STRAIGHT_PX as u32);
    let share = |near: usize| near as f64 / lines.len() as f64;
    let with_content = each.iter().filter(|e| share(e.iter().filter(|b| is_near(b)).count()) >= MIN_SHARE_EACH);
    let in_any = (0..lines.len()).filter(|line| each.iter().filter_map(|e| e.get(*line)).any(is_near)).count();
    if with_content.count() < MIN_PICTURES || share(in_any) < MIN_SHARE {
        return None;
    }
    let sure = (bar as usize).saturating_sub(RINGING_PX).max(1) as u32;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for picture in pictures {
        for (along, depth) in lines.iter().flat_map(|along| (0..sure).map(move |depth| (*along, depth))) {
            let level = side.level(picture, along, depth);
            (low, high) = (low.min(level), high.max(level));
        }
    }
    (high - low <= CONSTANT * contrast).then_some(bar)
}

#[cfg(test)]
mod tests {
    use hzn_core::image::Layout;

    use super::*;
    use crate::source::picture::Samples;

    const SIZE: [u32; 2] = [320, 240];

    /// Pictures of a bright half-plane below `horizon(k, x)`, with bars, noise in the sky, and a bar's level.
    fn flight(bars: Bars, noise: u8, horizon: impl Fn(u32, f64) -> f64) -> Vec<Picture> {
        let draw = |k: u32| {
            let mut samples = Vec::new();
            for i in 0..SIZE[0] * SIZE[1] {
                let (x, y) = (i % SIZE[0], i / SIZE[0]);
                let is_bar = x < bars.left_px
                    || y < bars.top_px
                    || x >= SIZE[0] - bars.right_px
                    || y >= SIZE[1] - bars.bottom_px;
                let random = ((i + 977 * k).wrapping_mul(2_654_435_761) >> 24) as u8;
                let sky = if noise == 0 { 0 } else { random % noise };
                let ground = if f64::from(y) > horizon(k, f64::from(x)) { 150 + random % 32 } else { sky };
                let bar = if bars.bright { 255 } else { 0 };
                samples.push(if is_bar { bar } else { ground });
            }
            Picture::new(Samples::Bytes(samples), Layout::packed(SIZE[0], SIZE[1], 1, 8))
        };
        (0..6).map(draw).collect()
    }

    fn turning(k: u32, x: f64) -> f64 {
        120.0 + (x - 160.0) * (f64::from(k) - 2.5) * 0.3 + f64::from(k) * 5.0
    }

    #[test]
    fn bars_are_found_where_the_content_touches_them() {
        let bars = Bars { bottom_px: 30, left_px: 40, right_px: 40, ..Bars::default() };
        let found = find_bars(&flight(bars, 6, turning)).unwrap();
        assert_eq!(found, bars);
        // The whole content is bright in some pictures.
        let bars = Bars { top_px: 24, bottom_px: 24, ..Bars::default() };
        assert_eq!(find_bars(&flight(bars, 0, |k, x| turning(k, x) - 170.0)), Some(bars));
        // Bars that differ.
        let bars = Bars { bottom_px: 3, ..Bars::default() };
        assert_eq!(find_bars(&flight(bars, 0, turning)), Some(bars));
    }

    #[test]
    fn a_white_frame_is_found_and_an_overexposed_ground_is_none() {
        let frame = Bars { top_px: 12, bottom_px: 12, left_px: 12, right_px: 12, bright: true };
        assert_eq!(find_bars(&flight(frame, 6, turning)), Some(frame));
        let sides = Bars { left_px: 9, right_px: 5, bright: true, ..Bars::default() };
        assert_eq!(find_bars(&flight(sides, 20, turning)), Some(sides));
        // The straight limb of an overexposed ground that stays where it is.
        let ground = Bars { bottom_px: 90, bright: true, ..Bars::default() };
        assert_eq!(find_bars(&flight(ground, 20, |_, _| 1e3)), None);
    }

    #[test]
    fn no_bars_are_found_where_there_are_none() {
        let none = Bars::default();
        assert_eq!(find_bars(&flight(none, 6, turning)), None);
        // A limb that bends and stays, and one that is straight and moves.
        let bent = |_, x: f64| 60.0 + 0.001 * (x - 160.0).powi(2);
        assert_eq!(find_bars(&flight(none, 0, bent)), None);
        assert_eq!(find_bars(&flight(none, 0, |k, _| 60.0 + 2.0 * f64::from(k))), None);
        // A straight limb that stays, before a sky with noise.
        assert_eq!(find_bars(&flight(none, 20, |_, _| 60.0)), None);
        // Too few pictures, and pictures without light.
        let bars = Bars { bottom_px: 30, ..none };
        assert_eq!(find_bars(&flight(bars, 0, turning)[..2]), None);
        assert_eq!(find_bars(&flight(none, 0, |_, _| 1e3)), None);
    }
}
