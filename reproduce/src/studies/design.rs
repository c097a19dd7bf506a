//! Calculates figures 6 to 8 and 19 to 22 of Braun & Barf 2022, without pictures.

use hzn_core::camera::{self, Model};
use hzn_plot::{Chart, Series, Style};
use hzn_sim::sensitivity::chart::{Vertical, Visibility};
use hzn_sim::sensitivity::{Design, Sigmas, reference};

use super::setup::Effort;
use crate::section::Section;

/// Returns the design of a level pinhole at 200 km: R = 1 px², L = 300 px, limb height 0.
fn design(width: u16, height: u16, f_px: f64) -> Design {
    Design {
        camera: camera::Config::ideal(Model::Pinhole, width, height, f_px),
        radius_km: 6371.0,
        altitude_km: 200.0,
        altitude_sigma_km: 0.5,
        limb_height_km: 0.0,
        limb_height_sigma_km: 2.0,
        depression_deg: 0.0,
        roll_deg: 0.0,
        sigma_px: 1.0,
        correlation_px: 300.0,
    }
}

fn by_fov(fov_deg: f64) -> Design {
    design(1920, 1080, 960.0 / (fov_deg / 2.0).to_radians().tan())
}

fn by_vertical_fov(rows: u16, fov_deg: f64) -> Design {
    design(rows * 16 / 9, rows, f64::from(rows) / 2.0 / (fov_deg / 2.0).to_radians().tan())
}

fn by_vertical_fov_square(fov_deg: f64) -> Design {
    design(1080, 1080, 540.0 / (fov_deg / 2.0).to_radians().tan())
}

fn sigmas(d: &Design) -> anyhow::Result<Sigmas> {
    d.sigmas()?.ok_or_else(|| anyhow::anyhow!("this design has no limb in view"))
}

/// Returns a cell with our 3-sigma value, the reference and their relative difference.
fn comparison_cell(sigma_deg: f64, reference_3_sigma_deg: f64) -> String {
    let ours = 3.0 * sigma_deg;
    format!("{ours:.4}° / {reference_3_sigma_deg}° ({:+.1} %)", 100.0 * (ours / reference_3_sigma_deg - 1.0))
}

pub(super) fn sensitivity(_: &Effort) -> anyhow::Result<Section> {
    let mut s = Section::default();
    s.text(
        "Level pinhole camera 1920×1080 at 200 km; edge errors of 1 px over 300 px; points one pixel apart; 3 sigma, \
         ours / reference. [BB] print curves; the reference is an independent evaluation of their equations with the \
         errata corrected (book/theory/math.md), and we agree with it within 2 %. Figure 37 of [BB] stays below 0.9°, \
         which the overbound as printed does not. Roll is about the optical axis, pitch about the horizontal of the \
         picture. The same by hand: `hzn sensitivity --altitude 200 --limb-height 0 --fov 66:146:16 -o table.csv`.",
    );
    add_altitudes_and_fields(&mut s)?;
    add_rows_and_limb_heights(&mut s)?;
    let wide = pitch_by_fov(by_fov)?;
    let square = pitch_by_fov(by_vertical_fov_square)?;
    add_optimum(&mut s, &wide, &square);
    s.figure("sensitivity", &chart_by_fov(wide)?)?;
    Ok(s)
}

/// Adds the table by altitude and by field of view.
fn add_altitudes_and_fields(s: &mut Section) -> anyhow::Result<()> {
    let head = ["", "roll [BB 33]", "pitch [BB 33]", "pitch, α known", "overbound [BB 37]"];
    let row = |name: String, d: &Design, r: [f64; 4]| -> anyhow::Result<Vec<String>> {
        let x = sigmas(d)?;
        let paper = x.braun_barf.ok_or_else(|| anyhow::anyhow!("not a pinhole"))?;
        let bound = x.braun_barf_bound_deg.unwrap_or(f64::NAN);
        let ours = [paper.roll_deg, paper.pitch_deg, x.known.pitch_deg, bound];
        Ok(std::iter::once(name).chain(ours.into_iter().zip(r).map(|(a, b)| comparison_cell(a, b))).collect())
    };
    let mut rows = Vec::new();
    for (km, r) in reference::BY_ALTITUDE_KM {
        rows.push(row(format!("{km} km, 94.4° wide"), &Design { altitude_km: km, ..by_fov(94.4) }, r)?);
    }
    for (fov, r) in reference::BY_FOV_DEG {
        rows.push(row(format!("200 km, {fov}° wide"), &by_fov(fov), r)?);
    }
    s.table(head, rows);
    Ok(())
}

/// Adds the table by number of rows and by limb height.
fn add_rows_and_limb_heights(s: &mut Section) -> anyhow::Result<()> {
    let row = |name: String, d: &Design, roll: f64, pitch: f64| -> anyhow::Result<Vec<String>> {
        let paper = sigmas(d)?.braun_barf.ok_or_else(|| anyhow::anyhow!("not a pinhole"))?;
        Ok(vec![name, comparison_cell(paper.roll_deg, roll), comparison_cell(paper.pitch_deg, pitch)])
    };
    let mut rows = Vec::new();
    for (px, [roll, pitch]) in reference::BY_ROWS {
        rows.push(row(format!("{px} rows, 94.4° high"), &by_vertical_fov(px, 94.4), roll, pitch)?);
    }
    for (km, [roll, pitch]) in reference::BY_LIMB_HEIGHT_KM {
        let d = Design { limb_height_km: km, ..by_vertical_fov(1080, 94.4) };
        rows.push(row(format!("limb height {km} km, 94.4° high"), &d, roll, pitch)?);
    }
    s.table(["", "roll [BB 33]", "pitch [BB 33]"], rows);
    Ok(())
}

/// Points of a curve: field of view and 3-sigma value, both in degrees.
type Curve = Vec<(f64, f64)>;

/// Returns the fields of view of the curves in degrees.
fn fovs_deg() -> impl Iterator<Item = f64> {
    (120..=300).map(|i| 0.5 * f64::from(i))
}

/// Returns the curve of the pitch for the designs of a field of view.
fn pitch_by_fov(design: fn(f64) -> Design) -> anyhow::Result<Curve> {
    let pitch = |fov| Ok((fov, sigmas(&design(fov))?.braun_barf.map_or(f64::NAN, |t| 3.0 * t.pitch_deg)));
    fovs_deg().map(pitch).collect()
}

/// Adds the field of view with the smallest pitch, for wide and for square pictures.
fn add_optimum(s: &mut Section, wide: &[(f64, f64)], square: &[(f64, f64)]) {
    let best = |curve: &[(f64, f64)]| curve.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, 0.0));
    let high = |fov: f64| 2.0 * ((fov / 2.0).to_radians().tan() * 9.0 / 16.0).atan().to_degrees();
    let (a, b) = (best(wide), best(square));
    s.text(format!(
        "**Optimum field of view** of the pitch with a free half-angle: {}° wide ({:.4}°), which is {:.0}° high; for a \
         square picture {}°. [BB] quote about 118° (reference: 116°, 84° high, 110°) and call the axis roll; the name \
         depends on how the camera is mounted. With a known half-angle there is no optimum: a narrower field is better \
         as long as the limb spans the picture. The curve is flat: a few degrees around the optimum cost less than 0.5 \
         %.",
        a.0,
        a.1,
        high(a.0),
        b.0
    ));
}

/// Returns the chart of the sigmas by field of view; `pitch` is the curve of equation 33.
fn chart_by_fov(pitch: Curve) -> anyhow::Result<Chart> {
    let mut curves = vec![Series::new("pitch [BB 33]", Style::Line, pitch)];
    let mut add = |name: &str, sigma_deg: fn(&Sigmas) -> f64| -> anyhow::Result<()> {
        let points: anyhow::Result<Curve> =
            fovs_deg().map(|fov| Ok((fov, 3.0 * sigma_deg(&sigmas(&by_fov(fov))?)))).collect();
        curves.push(Series::new(name, Style::Line, points?));
        Ok(())
    };
    add("pitch, fused (limb height 2 km, altitude 0.5 km)", |x| x.fused.pitch_deg)?;
    add("pitch, α known", |x| x.known.pitch_deg)?;
    add("roll", |x| x.fused.roll_deg)?;
    let chart = Chart::new("3 sigma at 200 km, level camera", "field of view across the width [deg]", "deg");
    Ok(curves.into_iter().fold(chart, Chart::with_series))
}

pub(super) fn visibility(_: &Effort) -> anyhow::Result<Section> {
    let mut s = Section::default();
    s.text(
        "In the plane of a pinhole picture the limb is an arc of an ellipse or of a hyperbola. An ellipse can be seen \
         if the full field of view γ is above 4α − π, a hyperbola if it is above π − 4α ([BB] section 2.7 has \
         exchanged the two), and the whole disc if it is above 2α. By hand: `hzn sensitivity visibility --limb-height \
         0`.",
    );
    let visibility = |km: f64| Visibility::new((6371.0f64 / (6371.0 + km)).asin());
    let rows = [80.0, 238.0, 800.0, 2600.0, 6000.0].map(|km| {
        let v = visibility(km);
        let published = if km == 238.0 { "118.3°" } else { "" };
        vec![
            format!("{km} km"),
            format!("{:.2}°", v.half_angle_deg),
            format!("{:.1}°", v.ellipse_deg),
            published.to_owned(),
            format!("{:.1}°", v.hyperbola_deg),
            format!("{:.1}°", v.disc_deg),
        ]
    });
    s.table(["altitude", "half-angle α", "ellipse from", "[BB]", "hyperbola from", "whole disc from"], rows);
    let altitudes: Vec<f64> = (1..=120).map(|i| 50.0 * f64::from(i)).collect();
    let curve = |name: &str, value: fn(&Visibility) -> f64| {
        Series::new(name, Style::Line, altitudes.iter().map(|&km| (km, value(&visibility(km)))))
    };
    let chart = Chart::new("Field of view from which on a limb can be seen", "altitude [km]", "field of view [deg]")
        .with_series(curve("arc of an ellipse", |v| v.ellipse_deg))
        .with_series(curve("arc of a hyperbola", |v| v.hyperbola_deg))
        .with_series(curve("whole disc", |v| v.disc_deg));
    s.figure("visibility", &chart)?;
    Ok(s)
}

pub(super) fn spherical_earth(_: &Effort) -> anyhow::Result<Section> {
    let mut s = Section::default();
    s.text(
        "A sensor measures the axis of the limb's cone. For a sphere this is the direction to the centre; for the \
         Earth that assumption is wrong by up to 0.19°. `hzn` gives the limb axis itself in both frames, so this error \
         does not occur. The table is for 45° latitude and a limb height of 0; the reference values were calculated \
         independently of `hzn`. By hand: `hzn sensitivity spherical-earth`.",
    );
    let rows = [
        (100.0, [0.1894, 0.1865, 0.0029]),
        (240.0, [0.1854, 0.1787, 0.0067]),
        (600.0, [0.1759, 0.1607, 0.0151]),
        (2000.0, [0.1464, 0.1114, 0.0350]),
        (20_000.0, [0.0465, 0.0112, 0.0352]),
    ]
    .map(|(km, reference)| {
        let v = Vertical::from_position(45.0, km, 0.0);
        let ours = v.map_or([f64::NAN; 3], |v| {
            [v.geocentric_to_geodetic_deg, v.geocentric_to_axis_deg, v.geodetic_to_axis_deg]
        });
        let cell = |(a, b): (f64, f64)| format!("{a:.4}° / {b:.4}°");
        std::iter::once(format!("{km} km")).chain(ours.into_iter().zip(reference).map(cell)).collect()
    });
    s.table(["altitude", "centre – vertical", "centre – limb axis", "vertical – limb axis"], rows);
    let mut chart = Chart::new("Error of taking the Earth for a sphere", "latitude [deg]", "deg");
    for km in [100.0, 240.0, 600.0, 2000.0] {
        let points = (0..=90).map(|i| {
            let latitude = f64::from(i);
            (latitude, Vertical::from_position(latitude, km, 0.0).map_or(f64::NAN, |v| v.geocentric_to_axis_deg))
        });
        chart = chart.with_series(Series::new(format!("{km} km"), Style::Line, points));
    }
    s.figure("spherical-earth", &chart)?;
    Ok(s)
}
