//! Writes an estimated lens into the text of a sensor.toml: only `[camera]` changes, and each key gets a comment.

use hzn_core::camera::{Config, Covariance, Intrinsic};
use nalgebra::{Quaternion, UnitQuaternion};
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::parameters::Determined;

/// Comments of a calibration begin with this mark; the next calibration replaces them.
const MARK: &str = "# calibrated:";

/// The text of a sensor.toml after a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The whole text.
    pub text: String,
    /// Keys that were written, in the form `[camera] fx_px = 1234.5`.
    pub keys: Vec<String>,
}

/// The lens that is written, and where it comes from.
#[derive(Debug, Clone, Copy)]
pub struct Found<'a> {
    /// The calibration with the covariance of its parameters.
    pub camera: &'a Config,
    /// The parameters that took part.
    pub parameters: &'a [Determined],
    /// The pictures, for example `38 limb pictures of flight`.
    pub source: &'a str,
}

/// The mount that is written, and where it comes from.
#[derive(Debug, Clone, Copy)]
pub struct FoundMount<'a> {
    /// The mount with which the attitudes were computed: rotation from the camera to the body frame, scalar first.
    pub q_vehicle_from_nominal_wxyz: [f64; 4],
    /// Rotation from the real to the nominal camera frame, scalar first.
    pub q_nominal_from_camera_wxyz: [f64; 4],
    /// 1-sigma about each axis of the camera, in degrees.
    pub sigma_deg: [f64; 3],
    /// The pictures, for example `38 limb pictures of flight`.
    pub source: &'a str,
}

/// Writes the determined parameters and their covariance into the text of a sensor.toml. A `[camera]` that refers to a
/// `file` gets all keys of the lens instead of the reference.
///
/// # Errors
/// The text is not valid TOML, or `[camera]` is not a section.
pub fn into_sensor_toml(text: &str, found: Found<'_>) -> Result<Written, String> {
    let mut document: DocumentMut = text.parse().map_err(|e| format!("is not valid TOML: {e}"))?;
    let item = document.entry("camera").or_insert_with(|| Item::Table(Table::new()));
    if let Item::Value(Value::InlineTable(table)) = item {
        *item = Item::Table(table.clone().into_table());
    }
    let camera = item.as_table_like_mut().ok_or("camera is not a section")?;
    if camera.contains_key("file") {
        replace_file(camera, found.camera);
    }
    let mut keys = Vec::new();
    for parameter in found.parameters.iter().filter(|p| p.determined && !is_coefficient(p.which)) {
        let why = comment(parameter, found.source);
        set(
            camera,
            "[camera]",
            parameter.which.name(),
            rounded(parameter.value, parameter.sigma).into(),
            &why,
            &mut keys,
        );
    }
    let coefficients: Vec<&Determined> =
        found.parameters.iter().filter(|p| p.determined && is_coefficient(p.which)).collect();
    if !coefficients.is_empty() {
        let why: Vec<String> = coefficients.iter().map(|p| comment(p, found.source)).collect();
        let values = Array::from_iter(found.camera.k.iter().copied());
        set(camera, "[camera]", "k", values.into(), &why.join("; "), &mut keys);
    }
    if let Some(covariance) = &found.camera.covariance {
        camera.remove("focal_sigma_percent");
        camera.remove("centre_sigma_px");
        camera.remove("covariance");
        let why = "covariance of the parameters above, by `hzn calibrate sky`";
        set(camera, "[camera]", "covariance", covariance_value(covariance), why, &mut keys);
    }
    Ok(Written { text: document.to_string(), keys })
}

impl Written {
    /// Writes a mount into the text as well.
    ///
    /// # Errors
    /// `[mount]` is not a section.
    pub fn with_mount(self, mount: &FoundMount<'_>) -> Result<Self, String> {
        let mut document: DocumentMut = self.text.parse().map_err(|e| format!("is not valid TOML: {e}"))?;
        let item = document.entry("mount").or_insert_with(|| Item::Table(Table::new()));
        let table = item.as_table_like_mut().ok_or("mount is not a section")?;
        let of = |[w, i, j, k]: [f64; 4]| UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let q = of(mount.q_vehicle_from_nominal_wxyz) * of(mount.q_nominal_from_camera_wxyz);
        let value = Array::from_iter([q.w, q.i, q.j, q.k].map(|x| (x * 1e9).round() / 1e9));
        let [x, y, z] = mount.sigma_deg.map(two_digits);
        let why = format!(
            "from {} with an attitude by `hzn calibrate sky`; 1 sigma about x, y, z of the camera: {x}°, {y}°, {z}°",
            mount.source
        );
        let mut keys = self.keys;
        set(table, "[mount]", "q_vehicle_from_camera_wxyz", value.into(), &why, &mut keys);
        Ok(Self { text: document.to_string(), keys })
    }
}

fn is_coefficient(which: Intrinsic) -> bool {
    !matches!(which, Intrinsic::FxPx | Intrinsic::FyPx | Intrinsic::CxPx | Intrinsic::CyPx)
}

fn comment(parameter: &Determined, source: &str) -> String {
    let Determined { which, sigma, before, .. } = parameter;
    format!("{} ± {} from {source} by `hzn calibrate sky`; it was {before}", which.name(), two_digits(*sigma))
}

/// Rounds a value to a hundredth of its sigma.
fn rounded(value: f64, sigma: f64) -> f64 {
    if !(sigma > 0.0) {
        return value;
    }
    let unit = 10f64.powi((sigma.log10().floor() as i32 - 2).clamp(-12, 12));
    let factor = (1.0 / unit).round();
    if factor >= 1.0 { (value * factor).round() / factor } else { value }
}

/// Formats a sigma with two digits.
fn two_digits(sigma: f64) -> String {
    let decimals = (1 - sigma.abs().max(1e-12).log10().floor() as i32).clamp(0, 12) as usize;
    format!("{sigma:.decimals$}")
}

fn covariance_value(covariance: &Covariance) -> Value {
    // With fewer digits, the rounded variance of fx - fy, which move together, may be negative.
    let digits = |x: &f64| format!("{x:.13e}").parse::<f64>().unwrap_or(*x);
    let order = Array::from_iter(covariance.order.iter().map(|i| i.name()));
    let rows = covariance.rows.iter().map(|row| Value::Array(Array::from_iter(row.iter().map(digits))));
    let mut table = InlineTable::new();
    table.insert("order", order.into());
    table.insert("rows", Value::Array(Array::from_iter(rows)));
    Value::InlineTable(table)
}

/// Replaces a reference to a camera file by the keys of the lens.
fn replace_file(table: &mut dyn TableLike, camera: &Config) {
    for key in ["file", "camera"] {
        table.remove(key);
    }
    let mut put = |key: &str, value: Value| {
        table.insert(key, Item::Value(value));
    };
    put("width", i64::from(camera.width).into());
    put("height", i64::from(camera.height).into());
    put("model", camera.model.name().into());
    put("fx_px", camera.fx_px.into());
    put("fy_px", camera.fy_px.into());
    put("cx_px", camera.cx_px.into());
    put("cy_px", camera.cy_px.into());
    if !camera.k.is_empty() {
        put("k", Array::from_iter(camera.k.iter().copied()).into());
    }
    if let Some(deg) = camera.theta_max_deg {
        put("theta_max_deg", deg.into());
    }
}

/// Sets a key with a comment before it.
pub(crate) fn set(
    table: &mut dyn TableLike,
    section: &str,
    key: &str,
    mut value: Value,
    why: &str,
    keys: &mut Vec<String>,
) {
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
