//! Pieces of XTCE that telemetry and telecommands share.

/// Endings of names, with their units.
const UNITS: [(&str, &str); 13] = [
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_us", "us"),
    ("_s", "s"),
    ("_m2", "m2"),
    ("_m", "m"),
    ("_per_px", "1/px"),
    ("_px", "px"),
    ("_rad", "rad"),
    ("cov", "rad2"),
    ("cov_free", "rad2"),
    ("cov_common", "rad2"),
    ("_bytes", "bytes"),
];

/// Returns the unit of a field.
pub(crate) fn unit_of(field: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| field.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// Returns the name of the type of numbers of a kind, such as `f32`, with a unit.
pub(crate) fn type_name(kind: &str, unit: &str) -> String {
    let unit = unit.replace('/', "_per_");
    if unit.is_empty() { kind.to_owned() } else { format!("{kind}_{unit}") }
}

pub(crate) fn unit_set(unit: &str) -> String {
    if unit.is_empty() { "<UnitSet/>".to_owned() } else { format!("<UnitSet><Unit>{unit}</Unit></UnitSet>") }
}

pub(crate) fn enumeration_list(labels: &[(u64, String)]) -> String {
    let entry =
        |(value, label): &(u64, String)| format!("<Enumeration value=\"{value}\" label=\"{}\"/>", escape(label));
    format!("<EnumerationList>{}</EnumerationList>", labels.iter().map(entry).collect::<String>())
}

pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns the documentation of a field as one line of plain text.
pub(crate) fn plain(description: &str) -> String {
    escape(description.replace(['[', ']', '`'], "").trim())
}
