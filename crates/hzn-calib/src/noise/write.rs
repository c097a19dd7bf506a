//! Writes a calibration into the text of a sensor.toml: only the calibrated keys change, and each gets a comment.

use hzn_core::body::{Kind, Limb};
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value, value};

use super::calibration::{Calibration, round_to_written_digits};

/// Comments of a calibration begin with this mark; the next calibration replaces them.
const MARK: &str = "# calibrated:";

/// The text of a sensor.toml after a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The whole text.
    pub text: String,
    /// Keys that were written, in the form `[body] limb_height_km = 18.9`.
    pub keys: Vec<String>,
}

/// A key, its value, and the comment about its source.
struct Line {
    key: &'static str,
    value: Value,
    why: String,
}

/// Writes limb height and noise into the text of a sensor.toml. `source` names the pictures, for the comments.
///
/// # Errors
/// The text is not valid TOML, something other than a section has the name of a section, or `[[bodies]]` does not have
/// the body.
pub fn into_sensor_toml(text: &str, calibration: &Calibration, source: &str) -> Result<Written, String> {
    let mut document: DocumentMut = text.parse().map_err(|e| format!("is not valid TOML: {e}"))?;
    let mut keys = Vec::new();
    let several = document.contains_key("bodies");
    if several {
        let body = find_body(&mut document, calibration.body)?;
        write_lines(body, limb_lines(calibration, source), "[[bodies]]", &mut keys);
        body.remove_rows(calibration);
        let noise = body.entry("covariance").or_insert_with(toml_edit::table);
        let noise = noise.as_table_like_mut().ok_or("[bodies.covariance] is not a section")?;
        write_lines(noise, noise_lines(calibration), "[bodies.covariance]", &mut keys);
    } else {
        let body = find_section(&mut document, "body")?;
        write_lines(body, limb_lines(calibration, source), "[body]", &mut keys);
        body.remove_rows(calibration);
        write_lines(find_section(&mut document, "covariance")?, noise_lines(calibration), "[covariance]", &mut keys);
    }
    Ok(Written { text: document.to_string(), keys })
}

/// Returns a section, which is added if it is missing.
fn find_section<'a>(document: &'a mut DocumentMut, name: &str) -> Result<&'a mut dyn TableLike, String> {
    let item = document.entry(name).or_insert_with(|| Item::Table(Table::new()));
    // An inline table cannot have comments.
    if let Item::Value(Value::InlineTable(table)) = item {
        *item = Item::Table(table.clone().into_table());
    }
    item.as_table_like_mut().ok_or(format!("{name} is not a section"))
}

/// Returns the calibrated body in `[[bodies]]`.
fn find_body(document: &mut DocumentMut, kind: Kind) -> Result<&mut dyn TableLike, String> {
    let name = kind.name();
    let is_it = |table: &Table| table.get("kind").map_or("earth", |k| k.as_str().unwrap_or_default()) == name;
    let bodies = document.get_mut("bodies").and_then(Item::as_array_of_tables_mut);
    let bodies = bodies.ok_or("[[bodies]] is not a list of sections")?;
    bodies
        .iter_mut()
        .find(|t| is_it(t))
        .map(|t| t as &mut dyn TableLike)
        .ok_or(format!("there is no [[bodies]] of kind {name}"))
}

/// Removes the text that a calibration makes invalid.
trait RemoveRows {
    /// Removes rows by latitude if one height was measured, because they would override it, and the table of a band.
    fn remove_rows(&mut self, calibration: &Calibration);
}

impl RemoveRows for dyn TableLike + '_ {
    fn remove_rows(&mut self, calibration: &Calibration) {
        if calibration.height.by_latitude.is_empty() {
            self.remove("limb_height_by_latitude_km");
        }
        let limb = self.get("limb").and_then(Item::as_str);
        let is_thermal = Limb::ALL.iter().any(|l| limb == Some(l.name()) && l.thermal_km().is_some());
        if is_thermal {
            self.insert("limb", value(Limb::Height.name()));
            // The band said so before.
            self.entry("sunlit").or_insert(value(false));
        }
    }
}

fn limb_lines(calibration: &Calibration, source: &str) -> Vec<Line> {
    let h = &calibration.height;
    let counted = calibration.pictures.iter().filter(|p| p.counts).count();
    let mut parts = vec![
        format!("{:.2} km from edge noise over all pictures", h.statistical_km),
        format!("{:.2} km from the scatter between them", h.scatter_km),
        format!("{:.2} km from a shift of all edges by the slow part of their errors, at least 0.1 px", h.shift_km),
        format!("{:.2} km from a bend that all edges have in common", h.bend_km),
    ];
    if h.clipping_km > 0.0 {
        parts.push(format!("{:.2} km from the height that clipping at full scale adds", h.clipping_km));
    }
    if h.lens_km > 0.0 {
        parts.push(format!("{:.2} km from the lens", h.lens_km));
    }
    if h.radius_km > 0.0 {
        parts.push(format!("{:.2} km from the radius, which is unknown without a position", h.radius_km));
    }
    let mut lines = vec![
        Line {
            key: "limb_height_km",
            value: round_to_written_digits(h.km).into(),
            why: format!("measured on {counted} pictures of {source} by `hzn calibrate noise`"),
        },
        Line { key: "limb_height_sigma_km", value: round_to_written_digits(h.sigma_km).into(), why: parts.join(", ") },
    ];
    if let Some((km, [_, sigma_km])) = calibration.clipped_height_km().zip(h.clipped_km) {
        let why = format!("± {sigma_km:.2} km; it is known better where the clipped part differs between pictures");
        lines.push(Line { key: "clipped_height_km", value: km.into(), why });
    }
    if !h.by_latitude.is_empty() {
        let row = |[deg, km, _]: &[f64; 3]| Array::from_iter([*deg, round_to_written_digits(*km)]);
        let sigmas: Vec<String> =
            h.by_latitude.iter().map(|[deg, _, sigma]| format!("{deg:.0}° ± {sigma:.2}")).collect();
        lines.push(Line {
            key: "limb_height_by_latitude_km",
            value: Array::from_iter(h.by_latitude.iter().map(row)).into(),
            why: format!("the limb height by latitude, for pictures with a position; {} km", sigmas.join(", ")),
        });
    }
    lines
}

fn noise_lines(calibration: &Calibration) -> Vec<Line> {
    let e = &calibration.edge;
    let length = "correlation length of the slow part of the residuals".to_owned();
    vec![
        Line {
            key: "sigma_px",
            value: round_to_written_digits(e.sigma_px).into(),
            why: "RMS of the residuals along the limb".into(),
        },
        Line { key: "correlation_px", value: round_to_written_digits(e.slow_px).into(), why: length },
        Line {
            key: "white_px",
            value: round_to_written_digits(e.white_px).into(),
            why: "the part of the residuals that averages out over this length".into(),
        },
        Line {
            key: "bias_px",
            value: round_to_written_digits(e.bias_px).into(),
            why: "residuals do not show a common shift of all points; it is assumed to be equal to the RMS of their \
                  slow part, and at least 0.1 px"
                .into(),
        },
        Line {
            key: "tilt_px",
            value: round_to_written_digits(e.tilt_px).into(),
            why: "residuals do not show a common tilt either; its RMS is assumed to be that of the shift".into(),
        },
    ]
}

fn write_lines(table: &mut dyn TableLike, lines: Vec<Line>, section: &str, keys: &mut Vec<String>) {
    for Line { key, mut value, why } in lines {
        keys.push(format!("{section} {key} = {}", value.to_string().trim()));
        match table.get_mut(key) {
            // The value is replaced in place, so that the comments before and after it stay.
            Some(old) => {
                if let Some(old) = old.as_value() {
                    *value.decor_mut() = old.decor().clone();
                }
                *old = Item::Value(value);
            }
            None => {
                table.insert(key, Item::Value(value));
            }
        }
        if let Some(mut key) = table.key_mut(key) {
            let decor = key.leaf_decor_mut();
            let before = decor.prefix().and_then(|p| p.as_str()).unwrap_or_default();
            let kept: String =
                before.lines().filter(|l| !l.trim_start().starts_with(MARK)).map(|l| format!("{l}\n")).collect();
            decor.set_prefix(format!("{kept}{MARK} {why}\n"));
        }
    }
}
