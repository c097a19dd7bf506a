//! Paints the picture for the screen: in colour, as brightness or as lit and dark pixels, in the plane of the camera or
//! of a pinhole.

use egui::{Color32, ColorImage};
use hzn_core::camera::Camera;
use hzn_core::config::Orient;
use hzn_core::image::{Channel, ImageView, Pixels};
use hzn_run::source::{Picture, picture::Samples};

use crate::model::{Look, Plane};

/// Colour of lit pixels in the threshold view.
const LIT: Color32 = Color32::from_rgb(214, 214, 206);
/// Colour of dark pixels in the threshold view.
const DARK: Color32 = Color32::from_rgb(24, 30, 46);

/// All properties that the shown picture depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Display of the picture.
    pub look: Look,
    /// Threshold, for [`Look::Level`].
    pub level: u16,
    /// Brightness that is shown as black and as white, and the exponent of the display.
    pub tone: Tone,
    /// Channel that is taken as brightness.
    pub channel: Channel,
    /// Orientation in which the picture is read.
    pub orient: Orient,
    /// Whether dark and bright are exchanged.
    pub invert: bool,
    /// The plane that the picture is shown in.
    pub plane: Plane,
}

/// Range of brightness that is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Value that is shown as black.
    pub low: u16,
    /// Value that is shown as white.
    pub high: u16,
    /// Exponent: above 1, dark parts are brighter.
    pub gamma: f32,
}

impl Tone {
    /// Returns the tone that shows every value as it is, for this full scale.
    pub const fn plain(full: u16) -> Self {
        Self { low: 0, high: full, gamma: 1.0 }
    }
    /// Returns the shown brightness of every value up to full scale.
    fn table(self, full: u16) -> Vec<u8> {
        let (low, span) = (f32::from(self.low), f32::from(self.high.saturating_sub(self.low).max(1)));
        let shown = |v: u16| ((f32::from(v) - low) / span).clamp(0.0, 1.0).powf(1.0 / self.gamma.max(0.05));
        // A plain picture keeps its values to the last bit.
        let exact = self == Self::plain(full);
        (0..=full)
            .map(|v| if exact { (u32::from(v) * 255 / u32::from(full.max(1))) as u8 } else { (shown(v) * 255.0) as u8 })
            .collect()
    }
}

/// Colours of the false-colour display, from dark to bright: equal steps look equal, and brightness rises throughout.
const FALSE_COLOURS: [[f32; 3]; 7] = [
    [0.0, 0.0, 4.0],
    [51.0, 13.0, 94.0],
    [120.0, 28.0, 109.0],
    [187.0, 55.0, 84.0],
    [237.0, 105.0, 37.0],
    [251.0, 180.0, 26.0],
    [252.0, 255.0, 164.0],
];

fn false_colour(v: u8) -> Color32 {
    let at = f32::from(v) / 255.0 * (FALSE_COLOURS.len() - 1) as f32;
    let i = (at as usize).min(FALSE_COLOURS.len() - 2);
    let part = at - i as f32;
    let [r, g, b] = [0, 1, 2].map(|c| (FALSE_COLOURS[i][c] * (1.0 - part) + FALSE_COLOURS[i + 1][c] * part) as u8);
    Color32::from_rgb(r, g, b)
}

/// Source of each pixel of a plane. It is computed once for a camera and a plane.
#[derive(Debug, Default)]
pub struct Warp {
    /// Plane and camera that the sources were computed for.
    key: Option<(Plane, hzn_core::camera::Config)>,
    /// Index of the camera's pixel; `u32::MAX` outside the field of view of the lens.
    from: Vec<u32>,
}

impl Warp {
    fn prepare(&mut self, plane: &Plane, config: &hzn_core::camera::Config, camera: &Camera<f64>) {
        let key = (plane.clone(), config.clone());
        if self.key.as_ref() == Some(&key) {
            return;
        }
        let (w, h) = (u32::from(camera.width()), u32::from(camera.height()));
        let source = |x: u32, y: u32| -> Option<u32> {
            let [u, v] = plane.to_camera(camera, [f64::from(x), f64::from(y)])?.map(f64::round);
            ((0.0..f64::from(w)).contains(&u) && (0.0..f64::from(h)).contains(&v)).then(|| v as u32 * w + u as u32)
        };
        self.from = (0..h).flat_map(|y| (0..w).map(move |x| source(x, y).unwrap_or(u32::MAX))).collect();
        self.key = Some(key);
    }
}

/// Paints a picture. Without a camera of the same size, the picture is shown in the plane of the camera.
pub fn paint(
    picture: &Picture,
    recipe: &Recipe,
    camera: Option<(&hzn_core::camera::Config, &Camera<f64>)>,
    warp: &mut Warp,
) -> ColorImage {
    let (w, h) = (picture.layout.width as usize, picture.layout.height as usize);
    let pixels = match (recipe.look, picture.view(recipe.channel)) {
        (Look::Colour, _) | (_, Err(_)) => paint_colours(picture, recipe.tone),
        (Look::Grey | Look::FalseColour, Ok(view)) => {
            let shown = recipe.tone.table(full_scale(picture));
            let colour = if recipe.look == Look::Grey { Color32::from_gray } else { false_colour };
            paint_values(&view, |v, _| colour(shown.get(usize::from(v)).copied().unwrap_or(255)))
        }
        (Look::Level, Ok(view)) => paint_values(&view, |v, _| if v >= recipe.level { LIT } else { DARK }),
    };
    let pixels = match camera {
        Some((config, camera))
            if recipe.plane != Plane::Camera
                && (usize::from(camera.width()), usize::from(camera.height())) == (w, h) =>
        {
            warp.prepare(&recipe.plane, config, camera);
            warp.from.iter().map(|&i| pixels.get(i as usize).copied().unwrap_or(Color32::BLACK)).collect()
        }
        _ => pixels,
    };
    ColorImage::new([w, h], pixels)
}

/// Returns the largest value that a sample can have.
fn full_scale(picture: &Picture) -> u16 {
    ((1u32 << picture.layout.bits.clamp(1, 16)) - 1) as u16
}

fn paint_colours(picture: &Picture, tone: Tone) -> Vec<Color32> {
    let n = usize::from(picture.layout.channels);
    let full = full_scale(picture);
    let plain = tone == Tone::plain(full);
    let table = if plain && full == 255 { Vec::new() } else { tone.table(full) };
    let shown = |v: u16| table.get(usize::from(v)).copied().unwrap_or(255);
    let colour = |p: [u8; 3]| Color32::from_rgb(p[0], p[1], p[2]);
    match &picture.samples {
        Samples::Bytes(d) if table.is_empty() && n >= 3 => {
            d.chunks_exact(n).map(|p| colour([p[0], p[1], p[2]])).collect()
        }
        Samples::Bytes(d) if table.is_empty() => d.chunks_exact(n).map(|p| Color32::from_gray(p[0])).collect(),
        Samples::Bytes(d) => d
            .chunks_exact(n)
            .map(|p| {
                if n >= 3 {
                    colour([0, 1, 2].map(|i| shown(p[i].into())))
                } else {
                    Color32::from_gray(shown(p[0].into()))
                }
            })
            .collect(),
        Samples::Words(d) => d
            .chunks_exact(n)
            .map(|p| if n >= 3 { colour([0, 1, 2].map(|i| shown(p[i]))) } else { Color32::from_gray(shown(p[0])) })
            .collect(),
    }
}

/// Returns the colour of each pixel, from its value and the full scale. The threshold may change with every frame of
/// the window, so the colour of each value is computed only once and the memory is reserved at the start.
fn paint_values(view: &ImageView<'_>, colour: impl Fn(u16, u16) -> Color32) -> Vec<Color32> {
    fn all<P: Pixels>(p: &P, colour: impl Fn(u16, u16) -> Color32) -> Vec<Color32> {
        let full = p.full_scale();
        let table: Vec<Color32> = (0..=full).map(|v| colour(v, full)).collect();
        let mut out = Vec::with_capacity(usize::from(p.width()) * usize::from(p.height()));
        for y in 0..p.height() {
            out.extend((0..p.width()).map(|x| table.get(usize::from(p.at(x, y))).copied().unwrap_or(Color32::WHITE)));
        }
        out
    }
    match view {
        ImageView::Grey8(p) => all(p, colour),
        ImageView::Grey16(p) => all(p, colour),
        ImageView::Colour8(p) => all(p, colour),
        ImageView::Colour16(p) => all(p, colour),
    }
}

/// Returns the brightness of a pixel and its samples, for the read-out; `None` outside the picture.
pub fn read(picture: &Picture, channel: Channel, x: u16, y: u16) -> Option<(u16, Vec<u16>)> {
    let layout = picture.layout;
    if u32::from(x) >= layout.width || u32::from(y) >= layout.height {
        return None;
    }
    let n = usize::from(layout.channels);
    let at = (usize::from(y) * layout.width as usize + usize::from(x)) * n;
    let samples: Vec<u16> = match &picture.samples {
        Samples::Bytes(d) => d.get(at..at + n)?.iter().map(|&v| v.into()).collect(),
        Samples::Words(d) => d.get(at..at + n)?.to_vec(),
    };
    let brightness = match picture.view(channel).ok()? {
        ImageView::Grey8(p) => p.at(x, y),
        ImageView::Grey16(p) => p.at(x, y),
        ImageView::Colour8(p) => p.at(x, y),
        ImageView::Colour16(p) => p.at(x, y),
    };
    Some((brightness, samples))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::{Config, Model};
    use hzn_core::image::Layout;

    fn picture(channels: u8) -> Picture {
        let data = (0..8 * 6 * u32::from(channels)).map(|i| (i * 5) as u8).collect();
        Picture::new(Samples::Bytes(data), Layout::packed(8, 6, channels, 8))
    }

    fn recipe(look: Look) -> Recipe {
        Recipe {
            look,
            level: 100,
            tone: Tone::plain(255),
            channel: Channel::Mean,
            orient: Orient::AsStored,
            invert: false,
            plane: Plane::Camera,
        }
    }

    #[test]
    fn every_look_shows_the_pixels_where_they_are() {
        let grey = paint(&picture(1), &recipe(Look::Grey), None, &mut Warp::default());
        assert_eq!(grey.size, [8, 6]);
        assert_eq!(grey[(3, 1)], Color32::from_gray(55));
        assert_eq!(paint(&picture(1), &recipe(Look::Colour), None, &mut Warp::default()), grey);
        let level = paint(&picture(1), &recipe(Look::Level), None, &mut Warp::default());
        // Pixel number 20 (row 2, column 4) has the value 100.
        assert_eq!((level[(3, 2)], level[(4, 2)]), (DARK, LIT));
        let colour = paint(&picture(3), &recipe(Look::Colour), None, &mut Warp::default());
        assert_eq!(colour[(1, 0)], Color32::from_rgb(15, 20, 25));
        assert_eq!(read(&picture(3), Channel::Mean, 1, 0), Some((20, vec![15, 20, 25])));
        assert_eq!(read(&picture(3), Channel::Blue, 1, 0), Some((25, vec![15, 20, 25])));
        assert_eq!(read(&picture(3), Channel::Mean, 8, 0), None);
    }

    #[test]
    fn words_are_shown_by_their_high_bits() {
        let layout = Layout::packed(2, 1, 1, 12);
        let p = Picture::new(Samples::Words(vec![0xfff, 0x080]), layout);
        let plain = Recipe { tone: Tone::plain(0xfff), ..recipe(Look::Colour) };
        let shown = paint(&p, &plain, None, &mut Warp::default());
        assert_eq!((shown[(0, 0)], shown[(1, 0)]), (Color32::from_gray(255), Color32::from_gray(7)));
        // A stretched picture uses the range of its pixels.
        let tone = Tone { low: 0x080, high: 0x100, gamma: 1.0 };
        let stretched = paint(&p, &Recipe { tone, ..plain.clone() }, None, &mut Warp::default());
        assert_eq!((stretched[(0, 0)], stretched[(1, 0)]), (Color32::from_gray(255), Color32::from_gray(0)));
        // A larger exponent makes dark parts brighter.
        let bright = Recipe { tone: Tone { gamma: 2.0, ..plain.tone }, look: Look::Grey, ..plain.clone() };
        assert!(paint(&p, &bright, None, &mut Warp::default())[(1, 0)].r() > 40);
        let coloured = paint(&p, &Recipe { look: Look::FalseColour, ..plain }, None, &mut Warp::default());
        assert_eq!(coloured[(0, 0)], Color32::from_rgb(252, 255, 164));
        assert_eq!(read(&p, Channel::Mean, 1, 0), Some((0x80, vec![0x80])));
    }

    #[test]
    fn a_pinhole_is_not_bent() {
        let config = Config::ideal(Model::Pinhole, 8, 6, 20.0);
        let camera = Camera::try_new(&config).unwrap();
        let plane = Plane::Pinhole(crate::model::plane::Pinhole { focal_px: 20.0, centre: [3.5, 2.5] });
        let straight = paint(&picture(1), &recipe(Look::Grey), None, &mut Warp::default());
        let mut warp = Warp::default();
        let recipe = Recipe { plane, ..recipe(Look::Grey) };
        assert_eq!(paint(&picture(1), &recipe, Some((&config, &camera)), &mut warp), straight);
    }
}
