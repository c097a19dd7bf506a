//! The caption below a picture: what the picture is and its answer, the legend, a scale, and where it comes from.

use hzn_core::status::Status;
use hzn_mcap::palette::{AXIS, INLIER, LIMB, REJECTED};
use hzn_mcap::{Annotations, Row};
use image::{Rgb, RgbImage};

use super::canvas::{Colour, distance};
use super::colours::{TRUTH, edge_colour};
use super::letters::{Letters, fill};

const GROUND: Colour = [16, 18, 22];
const INK: Colour = [236, 238, 242];
const FAINT: Colour = [160, 166, 176];
/// Lines of the text at the top of the caption.
const TEXT_LINES: u32 = 2;
/// Width of a whole legend with a scale, in heights of a line.
const LEGEND_WIDTH: u32 = 46;
/// Width of a usual last line, and height of one of its lines as a part of a line of text, in the same unit.
const LAST_WIDTH: u32 = 35;
const LAST_LINE: f32 = 0.8;
/// Angles of the bar, degrees.
const BAR_DEG: [f64; 11] = [5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002];
/// Size of the letters, and of those of the last line, in heights of a line.
const LETTER: f32 = 0.74;
const SMALL: f32 = 0.6;

/// An entry of the legend.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// What is drawn.
    pub name: String,
    /// Its colours; candidate edges have several.
    pub colours: Vec<Colour>,
}

/// A caption.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Caption {
    /// Sentence about the picture; it takes up to two lines.
    pub text: String,
    /// Entries of the legend.
    pub legend: Vec<Entry>,
    /// Focal length in pixels, for a bar that is as long as an angle near the optical axis.
    pub scale: Option<f64>,
    /// Version, command and sensor that made the picture.
    pub provenance: String,
}

impl Caption {
    /// Makes the caption of a picture from its name, its time and the results of its bodies, with the legend of what is
    /// drawn over it.
    pub fn new(name: &str, time_s: Option<f64>, rows: &[Row], drawing: &Annotations) -> Self {
        let mut text = name.to_owned();
        text.extend(time_s.map(|t| format!(", {t:.3} s")));
        rows.iter().for_each(|row| text += &format!("; {}", answer(row, None)));
        Self { text, legend: legend(drawing), ..Self::default() }
    }

    /// Adds the true limb to the legend.
    #[must_use]
    pub fn with_truth(mut self) -> Self {
        self.legend.push(Entry { name: "true limb".into(), colours: vec![TRUTH] });
        self
    }

    /// Adds a bar that is as long as 5° near the optical axis of a camera with this focal length. Where this is more
    /// than a quarter of the picture, it is as long as a smaller angle.
    #[must_use]
    pub fn with_scale(self, fx_px: f64) -> Self {
        Self { scale: Some(fx_px), ..self }
    }

    /// Adds the line about version, command and sensor.
    #[must_use]
    pub fn with_provenance(self, line: impl Into<String>) -> Self {
        Self { provenance: line.into(), ..self }
    }
}

/// Returns the answer to a picture in words: body, status, reason, 3σ and RMS. `reason` replaces the detail of a
/// picture without an answer.
pub fn answer(row: &Row, reason: Option<&str>) -> String {
    let mut text = format!("{}: {}", row.body, row.status);
    text.extend(row.sigma_max_deg.map(|s| format!(", 3σ {:.4}°", 3.0 * s)));
    text.extend(row.rms_px.map(|rms| format!(", RMS {rms:.2} px")));
    let detail = Some(shorten_detail(&row.detail)).filter(|detail| !detail.is_empty());
    let why = reason.or(detail.as_deref()).filter(|_| row.status != Status::Ok);
    text.extend(why.map(|why| format!(" ({why})")));
    text
}

/// Shortens the detail of a row without an answer, for example `ended at gates: short-arc, short-arc`: a verdict of
/// several edges appears once, with its count.
pub fn shorten_detail(detail: &str) -> String {
    let Some((stage, verdicts)) = detail.split_once(": ") else { return detail.to_owned() };
    let mut counted: Vec<(&str, usize)> = Vec::new();
    for verdict in verdicts.split(", ") {
        match counted.iter_mut().find(|(v, _)| *v == verdict) {
            Some((_, n)) => *n += 1,
            None => counted.push((verdict, 1)),
        }
    }
    let each = counted.iter().map(|(v, n)| if *n > 1 { format!("{v} ×{n}") } else { (*v).to_owned() });
    format!("{stage}: {}", each.collect::<Vec<_>>().join(", "))
}

/// Returns the legend of what is drawn.
pub fn legend(drawing: &Annotations) -> Vec<Entry> {
    let edges = drawing.edges.len();
    let several = (0..edges.min(6)).map(edge_colour).collect();
    let entry = |name: &str, count: usize, colours: Vec<Colour>| {
        let counted = if count > 0 { format!("{name} {count}") } else { name.to_owned() };
        Entry { name: counted, colours }
    };
    let entries = [
        (edges > 0, entry("edges", edges, several)),
        (!drawing.inliers.is_empty(), entry("inliers", drawing.inliers.len(), vec![INLIER])),
        (!drawing.rejected.is_empty(), entry("outliers", drawing.rejected.len(), vec![REJECTED])),
        (!drawing.limb.is_empty(), entry(&limb_in_words(drawing), 0, vec![LIMB])),
        (!drawing.axes.is_empty(), entry("axis", 0, vec![AXIS])),
    ];
    entries.into_iter().filter(|(there, _)| *there).map(|(_, entry)| entry).collect()
}

/// Half of the smallest width of the line of the limb, in pixels: points at a smaller distance lie on the line.
const SEEN_PX: f64 = 2.5;

/// Returns the name of the line of the limb. It is drawn where the answer has it, and the answer also weighs the
/// altitude and the errors of the lens. Therefore it can miss the points.
fn limb_in_words(drawing: &Annotations) -> String {
    match distance_px(drawing) {
        Some(px) if px > SEEN_PX => format!("limb of the answer, {px:.0} px from its points"),
        _ => "fitted limb".into(),
    }
}

/// Returns the median distance of the inliers from the line of the limb; `None` without both.
fn distance_px(drawing: &Annotations) -> Option<f64> {
    // Some points tell the distance as well as all.
    let step = drawing.inliers.len().div_ceil(50).max(1);
    let nearest = |point: &[f64; 2]| {
        let segments = drawing.limb.iter().flat_map(|line| line.windows(2));
        segments.map(|pair| distance(*point, pair[0], pair[1])).min_by(f64::total_cmp)
    };
    let mut all: Vec<f64> = drawing.inliers.iter().step_by(step).filter_map(nearest).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// Returns the height of a line in pixels for a picture of this size.
fn line_px(width: u32, height: u32) -> u32 {
    (width.max(height) / 48).clamp(15, 96)
}

/// Returns the number of lines of the legend: a narrow picture needs several.
fn legend_lines(width: u32, line: u32) -> u32 {
    (LEGEND_WIDTH * line).div_ceil(width.max(1)).clamp(1, 4)
}

/// Returns the number of lines of the text about version, command and sensor: a narrow picture needs two.
fn last_lines(width: u32, line: u32) -> u32 {
    (LAST_WIDTH * line).div_ceil(width.max(1)).clamp(1, 2)
}

/// Returns the height that a caption adds to a picture, in pixels. It does not depend on the text, so that all pictures
/// of a video have one size.
pub fn height_px(width: u32, height: u32) -> u32 {
    let line = line_px(width, height);
    (TEXT_LINES + legend_lines(width, line) + last_lines(width, line)) * line + line / 4
}

/// Returns the picture with a caption below it.
pub fn add(letters: &Letters, picture: &RgbImage, caption: &Caption) -> RgbImage {
    let (w, h) = picture.dimensions();
    let line = line_px(w, h);
    let mut out = RgbImage::from_pixel(w, h + height_px(w, h), Rgb(GROUND));
    image::imageops::replace(&mut out, picture, 0, 0);
    let left = line / 3;
    let room = w.saturating_sub(2 * left) as f32;
    let [size, small] = [LETTER, SMALL].map(|part| part * line as f32);
    let mut y = h + line / 4;
    for text in letters.wrap(&caption.text, size, room, TEXT_LINES as usize) {
        letters.write(&mut out, [left as f32, y as f32], &text, size, INK);
        y += line;
    }
    let top = h + line / 4 + TEXT_LINES * line;
    add_legend(letters, &mut out, caption, [left, top], line);
    let mut last = (top + legend_lines(w, line) * line) as f32;
    for text in letters.wrap(&caption.provenance, small, room, last_lines(w, line) as usize) {
        letters.write(&mut out, [left as f32, last], &text, small, FAINT);
        last += LAST_LINE * line as f32;
    }
    out
}

/// Returns the length in pixels of the longest bar that fits into a quarter of the picture, and its angle.
fn bar(fx_px: f64, width: u32) -> Option<(u32, String)> {
    let length = |deg: f64| (fx_px * deg.to_radians().tan()).round();
    let deg = BAR_DEG.into_iter().find(|deg| length(*deg) <= f64::from(width) / 4.0)?;
    Some((length(deg) as u32, format!("{deg}°")))
}

/// Writes legend and scale, in as many lines as the height of the caption has for them.
fn add_legend(letters: &Letters, out: &mut RgbImage, caption: &Caption, [left, top]: [u32; 2], line: u32) {
    let (w, size) = (out.width(), LETTER * line as f32);
    let last = top + (legend_lines(w, line) - 1) * line;
    let [mut x, mut y] = [left, top];
    // Goes to the next line if an entry does not fit into this one.
    let mut place = |width: u32| -> Option<[u32; 2]> {
        if x > left && x + width > w {
            (x, y) = (left, y + line);
        }
        let at = [x, y];
        x += width + line;
        (y <= last).then_some(at)
    };
    let width_px = |text: &str| letters.measure(text, size)[0].ceil() as u32;
    for Entry { name, colours } in &caption.legend {
        let part = (line / 2 / (colours.len().max(1) as u32)).max(line / 6).max(1);
        let boxes = part * colours.len() as u32;
        let Some([x, y]) = place(boxes + line / 5 + width_px(name)) else { return };
        for (n, colour) in (0..).zip(colours) {
            fill(out, [x + n * part, y + line / 4], [part, line / 2], *colour);
        }
        let ink = if let [one] = colours.as_slice() { *one } else { INK };
        letters.write(out, [(x + boxes + line / 5) as f32, y as f32], name, size, ink);
    }
    if let Some((length, what)) = caption.scale.and_then(|fx_px| bar(fx_px, w)) {
        let Some([x, y]) = place(length + line / 4 + width_px(&what)) else { return };
        fill(out, [x, y + line / 2], [length, (line / 10).max(2)], INK);
        letters.write(out, [(x + length + line / 4) as f32, y as f32], &what, size, INK);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caption() -> Caption {
        Caption {
            text: "flight/0001.png, 12.500 s: rejected, half-angle".into(),
            legend: vec![Entry { name: "fitted limb".into(), colours: vec![LIMB] }],
            scale: Some(994.0),
            provenance: "sensor 0123456789ab, hzn 0.1.0, hzn run flight".into(),
        }
    }

    #[test]
    fn letters_and_legend_are_below_the_picture() {
        let picture = RgbImage::from_pixel(640, 480, Rgb([7, 7, 7]));
        let out = add(&Letters::default(), &picture, &caption());
        assert_eq!(out.dimensions(), (640, 480 + height_px(640, 480)));
        assert!((0..480).all(|y| (0..640).all(|x| out.get_pixel(x, y).0 == [7, 7, 7])), "the picture stays");
        let below = |test: fn(&Rgb<u8>) -> bool| out.rows().skip(480).flatten().filter(|p| test(p)).count();
        assert!(below(|p| p.0[0] > 150 && p.0[2] > 150) > 200, "letters");
        assert!(below(|p| p.0 == LIMB) > 30, "legend");
        assert!(below(|p| p.0[0] > 60 && p.0[0] < 180) > 100, "the letters have smooth edges");
        let without = Caption { provenance: String::new(), ..caption() };
        assert_ne!(out, add(&Letters::default(), &picture, &without), "the last line is written");
    }

    #[test]
    fn a_verdict_of_many_edges_is_said_once() {
        let long = "ended at gates: residuals, short-arc, no-fit, short-arc, short-arc";
        assert_eq!(shorten_detail(long), "ended at gates: residuals, short-arc ×3, no-fit");
        assert_eq!(shorten_detail("ended at contour"), "ended at contour");
    }

    #[test]
    fn points_beside_the_limb_of_the_answer_are_said_to_be_there() {
        let limb = vec![vec![[0.0, 100.0], [300.0, 100.0]], vec![[310.0, 100.0], [640.0, 100.0]]];
        let drawing = |off: f64| Annotations {
            limb: limb.clone(),
            inliers: (0..600).map(|u| [f64::from(u), 100.0 + off]).collect(),
            ..Annotations::default()
        };
        let name = |off: f64| legend(&drawing(off)).pop().unwrap().name;
        assert_eq!(
            (name(1.0), name(-14.0)),
            ("fitted limb".into(), "limb of the answer, 14 px from its points".into())
        );
        let alone = Annotations { inliers: vec![], ..drawing(0.0) };
        assert_eq!(legend(&alone).pop().unwrap().name, "fitted limb");
    }

    #[test]
    fn the_bar_is_as_long_as_its_angle() {
        // Usual cameras, the Sun with a long lens, and Jupiter from Cassini, whose field of view is 0.35°.
        for (fx_px, width, expected) in [
            (994.0, 1280, (87, "5°")),
            (92.0, 384, (8, "5°")),
            (8000.0, 1280, (279, "2°")),
            (166_892.0, 1024, (146, "0.05°")),
        ] {
            assert_eq!(bar(fx_px, width), Some((expected.0, expected.1.to_owned())), "{fx_px}");
        }
        assert_eq!(bar(1e9, 640), None);
    }

    #[test]
    fn a_caption_of_a_tiny_picture_stays_within_it() {
        let tiny = RgbImage::new(30, 20);
        assert_eq!(add(&Letters::default(), &tiny, &caption()).width(), 30);
    }

    /// The pictures are those of the gallery.
    #[test]
    fn a_narrow_picture_has_its_whole_command() {
        let photograph = |file: &str, name: &str| {
            let (picture, sensor) = (format!("tests/data/real/{file}.png"), format!("tests/data/real/{file}.toml"));
            format!("hzn explain {picture} --sensor {sensor} --overlay {name}.png --force")
        };
        let commands = [
            (384, 288, "hzn explain leo-infrared --index 1 --overlay infrared.png --force".to_owned()),
            (512, 512, photograph("sun-hmi-continuum-2023-01-31", "sun")),
            (513, 487, photograph("opssat-2020-08-16", "ops-sat")),
            (1600, 1067, photograph("iss073e0293986-aurora", "aurora")),
        ];
        for (width, height, command) in commands {
            let line = line_px(width, height);
            let (size, room) = (SMALL * line as f32, (width - 2 * (line / 3)) as f32);
            let text = format!("hzn 0.1.0, sensor 0123456789ab, {command}");
            let lines = Letters::default().wrap(&text, size, room, last_lines(width, line) as usize);
            assert!(!lines.concat().contains('…'), "{width}: {lines:?}");
            assert_eq!(lines.len(), last_lines(width, line) as usize, "{width}: {lines:?}");
        }
    }

    #[test]
    fn a_narrow_picture_has_its_whole_legend() {
        let names = ["edges 22", "inliers 512", "outliers 40", "fitted limb", "axis", "true limb"];
        let colours = |n: usize| vec![[10 + n as u8, 200, 255]];
        let legend = names.iter().enumerate().map(|(n, name)| Entry { name: (*name).into(), colours: colours(n) });
        let caption = Caption { legend: legend.collect(), ..caption() };
        for width in [240, 320, 640] {
            let out = add(&Letters::default(), &RgbImage::new(width, 240), &caption);
            for n in 0..names.len() {
                assert!(out.pixels().any(|p| p.0 == colours(n)[0]), "{width}: {}", names[n]);
            }
        }
    }
}
