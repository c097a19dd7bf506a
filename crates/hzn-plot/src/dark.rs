//! Colours of a chart for a reader whose system is dark.

/// Rules of style that give a drawing dark colours on a dark system. A drawing has its colours as attributes, which
/// these rules replace.
pub const DARK: &str = "@media(prefers-color-scheme:dark){svg rect[fill='#FFFFFF']{fill:#1c1f24}\
svg text{fill:#dde1e6}svg [stroke='#000000']{stroke:#9aa3ad}\
svg [stroke='#0072B2']{stroke:#6f9bff}svg [fill='#0072B2']{fill:#6f9bff}\
svg [stroke='#3C3C3C']{stroke:#c8ced6}svg [fill='#3C3C3C']{fill:#c8ced6}\
svg [stroke='#6E6E6E']{stroke:#9aa3ad}svg circle{opacity:0.9}}";

/// Returns an SVG with the rules of [`DARK`].
pub fn with_dark(svg: &str) -> String {
    svg.replacen('>', &format!("><style>{DARK}</style>"), 1)
}

#[cfg(test)]
mod tests {
    use plotters::style::RGBColor;

    use super::*;
    use crate::{COLOURS, Chart, IDEAL, MARKS, Series, Style};

    /// Returns the colour that the rules put in the place of a colour of lines.
    fn replaced(colour: &str) -> &str {
        let rule = DARK.split_once(&format!("[stroke='{colour}']{{stroke:"));
        rule.map_or(colour, |(_, rest)| &rest[..7])
    }

    /// Returns the relative luminance of a colour, as WCAG 2 defines it.
    fn luminance(colour: &str) -> f64 {
        let part = |at: usize| {
            let v = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * part(1) + 0.7152 * part(3) + 0.0722 * part(5)
    }

    #[test]
    fn every_colour_of_a_series_stands_out_and_is_its_own() {
        let all: Vec<String> =
            COLOURS.iter().chain([&IDEAL, &MARKS]).map(|RGBColor(r, g, b)| format!("#{r:02X}{g:02X}{b:02X}")).collect();
        let dark: Vec<&str> = all.iter().map(|colour| replaced(colour)).collect();
        for (n, colour) in dark.iter().enumerate() {
            let contrast = (luminance(colour) + 0.05) / (luminance("#1c1f24") + 0.05);
            assert!(contrast > 4.0, "{} becomes {colour}: {contrast:.1}", all[n]);
            assert!(!dark[..n].iter().any(|other| other.eq_ignore_ascii_case(colour)), "{colour} occurs twice");
        }
    }

    #[test]
    fn a_chart_is_dark_by_itself_and_its_grid_is_not_white() {
        let svg = Chart::new("t", "x", "y").with_series(Series::new("s", Style::Line, [(0.0, 0.0), (1.0, 1.0)])).svg();
        let svg = svg.unwrap();
        assert_eq!(svg.matches(DARK).count(), 1);
        assert!(svg.starts_with("<svg ") && svg.find("<style>") < svg.find("<rect"), "{svg}");
        assert!(!svg.contains("stroke=\"#FFFFFF\""), "white lines stay white on a dark ground: {svg}");
    }
}
