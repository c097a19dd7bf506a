//! The keys of sensor.toml as data: name, unit, meaning, limits. The table of book/reference/sensor-toml.md is the one place where
//! they are described; it is read here, so that programs which show them cannot tell another story.

use std::sync::OnceLock;

/// One key.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Its section, such as `reject`; empty for `preset`.
    pub section: String,
    /// Its name, such as `threshold_px`.
    pub name: String,
    /// What it means, in words.
    pub meaning: String,
    /// For which method of its section it counts; `None` for all of them.
    pub method: Option<String>,
    /// What it may be.
    pub limits: Limits,
}

/// What a value may be.
#[derive(Debug, Clone, PartialEq)]
pub enum Limits {
    /// One of these words.
    Choice(Vec<String>),
    /// A number.
    Number {
        /// The smallest.
        low: f64,
        /// The smallest itself is excluded.
        above: bool,
        /// The largest; infinite where there is no limit.
        high: f64,
    },
    /// Something else: the table's own words.
    Words(String),
}

impl Key {
    /// The unit that its name ends in, such as `px`, `km`, `deg`; empty for plain numbers.
    pub fn unit(&self) -> &'static str {
        ["px", "km", "deg"].into_iter().find(|unit| self.name.ends_with(&format!("_{unit}"))).unwrap_or("")
    }
    /// `reject.threshold_px`, as errors name it.
    pub fn path(&self) -> String {
        if self.section.is_empty() { self.name.clone() } else { format!("{}.{}", self.section, self.name) }
    }
}

/// All keys, in the order of the table.
pub fn all() -> &'static [Key] {
    static KEYS: OnceLock<Vec<Key>> = OnceLock::new();
    KEYS.get_or_init(|| table(include_str!("../../../book/reference/sensor-toml.md")))
}

/// The keys of one section, in order.
pub fn of(section: &str) -> impl Iterator<Item = &'static Key> {
    all().iter().filter(move |key| key.section == section)
}

/// The key of a path such as `reject`, `threshold_px`; that of one of several bodies has its number within.
pub(crate) fn at(path: &[String]) -> Option<&'static Key> {
    let names: Vec<&str> = path.iter().map(String::as_str).filter(|part| part.parse::<usize>().is_err()).collect();
    let section = match names[..] {
        ["body" | "bodies", section, _] => section,
        ["bodies", _] => "body",
        [section, _] => section,
        _ => "",
    };
    of(section).find(|key| names.last() == Some(&key.name.as_str()))
}

fn table(text: &str) -> Vec<Key> {
    let mut keys = Vec::new();
    let mut section = String::new();
    let rows = text.lines().skip_while(|l| !l.starts_with("|---")).skip(1).take_while(|l| l.starts_with('|'));
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [names, meaning, limits, default] = cells.as_slice() else { continue };
        let names = match names.strip_prefix("**[").and_then(|rest| rest.split_once("]**")) {
            Some((name, rest)) => {
                section = name.trim_matches(['[', ']']).to_owned();
                rest
            }
            None => names,
        };
        for name in quoted(names) {
            let (method, meaning) = match meaning.strip_prefix("for `").and_then(|rest| rest.split_once("`: ")) {
                Some((method, meaning)) => (Some(method.to_owned()), meaning),
                None => {
                    (meaning.split_once(", for `").and_then(|(_, m)| m.split('`').next()).map(str::to_owned), *meaning)
                }
            };
            keys.push(Key {
                section: section.clone(),
                name: name.to_owned(),
                meaning: meaning.replace('`', ""),
                method: method.filter(|m| m != "sphere" && m != "earth"),
                limits: read_limits(limits, meaning, default),
            });
        }
    }
    keys
}

fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Choices are listed under the limits, or else in the meaning, where the default is one of them.
fn read_limits(limits: &str, meaning: &str, default: &str) -> Limits {
    let listed = quoted(limits);
    let words = if listed.len() > 1 { listed } else { quoted(meaning) };
    if words.len() > 1 && quoted(default).first().is_some_and(|d| words.contains(d)) {
        return Limits::Choice(words.into_iter().map(str::to_owned).collect());
    }
    let several = meaning.contains('[');
    range(limits).filter(|_| !several).unwrap_or_else(|| Limits::Words(limits.replace('`', "")))
}

/// `0 to 1`, `above 0 to 100`, `8 or more`, `above 0`.
fn range(limits: &str) -> Option<Limits> {
    let limits = limits.replace('−', "-");
    let (above, rest) = limits.strip_prefix("above ").map_or((false, limits.as_str()), |rest| (true, rest));
    let number = |text: &str| -> Option<f64> {
        match text.trim().split_once('/') {
            Some((a, b)) => Some(a.parse::<f64>().ok()? / b.parse::<f64>().ok()?),
            None => text.trim().parse().ok(),
        }
    };
    let (low, high) = match rest.split_once(" to ") {
        Some((low, high)) => (number(low)?, number(high)?),
        None => (number(rest.strip_suffix(" or more").or(above.then_some(rest))?)?, f64::INFINITY),
    };
    Some(Limits::Number { low, above, high })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CAMERA: &str = "[camera]\nwidth = 640\nheight = 480\nmodel = \"pinhole\"\nfx_px = 500.0\nfy_px = 500\ncx_px = 319.5\ncy_px = 239.5\n";

    /// What sensor.toml says to a value; `None` when it is taken.
    fn refused(key: &Key, value: &str) -> Option<String> {
        let text = match key.section.as_str() {
            "" => format!("{} = {value}\n{CAMERA}", key.name),
            "camera" => {
                let others = CAMERA.lines().filter(|l| !l.starts_with(&format!("{} =", key.name)));
                format!("{}\n{} = {value}\n", others.collect::<Vec<_>>().join("\n"), key.name)
            }
            section => format!("{CAMERA}[{section}]\n{} = {value}\n", key.name),
        };
        crate::sensor::parse(&text, Path::new("sensor.toml")).err().map(|e| e.to_string())
    }

    #[test]
    fn every_key_exists() {
        assert!(all().len() > 50);
        // That one stands beside `file` only.
        for key in all().iter().filter(|k| k.path() != "camera.camera") {
            // Nothing is of this kind: refused for its value, and not for its name.
            let why = refused(key, "[[[]]]").unwrap_or_default();
            assert!(!why.contains("unknown section") && !why.contains("unknown key"), "{}: {why}", key.path());
        }
    }

    #[test]
    fn every_key_of_the_defaults_is_described() {
        let config = crate::sensor::parse(CAMERA, Path::new("sensor.toml")).unwrap().config;
        for (section, values) in toml::Table::try_from(config).unwrap() {
            for (name, _) in values.as_table().into_iter().flatten() {
                assert!(of(&section).any(|k| k.name == *name), "{section}.{name} is not in book/reference/sensor-toml.md");
            }
        }
    }

    #[test]
    fn limits_are_those_that_are_checked() {
        // Of these the limit hangs on another value.
        let depends = ["gate.max_mean", "gate.min_mean", "body.radius_km", "bodies.radius_km"];
        let mut checked = 0;
        for key in all().iter().filter(|k| !depends.contains(&k.path().as_str())) {
            match &key.limits {
                Limits::Choice(words) => {
                    for word in words {
                        let why = refused(key, &format!("\"{word}\"")).unwrap_or_default();
                        assert!(!why.contains("is not a valid value"), "{}: {why}", key.path());
                        checked += 1;
                    }
                }
                Limits::Number { low, above, high } => {
                    // As the file writes numbers: whole ones for whole fields.
                    let taken = |x: f64| {
                        refused(key, &format!("{x:.0}")).is_none() && x.fract() == 0.0
                            || refused(key, &format!("{x:?}")).is_none()
                    };
                    let inside =
                        if *above { low + 1e-3_f64.max(if high.is_infinite() { 1.0 } else { 0.0 }) } else { *low };
                    let of_lens = key.section == "camera";
                    assert!(taken(inside) || of_lens, "{} = {inside} is refused", key.path());
                    let outside = low - if *above { 0.0 } else { 1.0 };
                    assert!(!taken(outside), "{} = {outside} is taken", key.path());
                    if high.is_finite() {
                        assert!(
                            taken(*high) || of_lens,
                            "{} = {high} is refused: {:?}",
                            key.path(),
                            refused(key, &format!("{high:?}"))
                        );
                        assert!(!taken(high * 2.0 + 1.0), "{} = {} is taken", key.path(), high * 2.0 + 1.0);
                    }
                    checked += 1;
                }
                Limits::Words(_) => {}
            }
        }
        assert!(checked > 50, "{checked}");
    }

    #[test]
    fn rows_are_read() {
        let key = |path: &str| all().iter().find(|k| k.path() == path).unwrap();
        assert_eq!(key("reject.threshold_px").unit(), "px");
        assert_eq!(key("reject.threshold_px").limits, Limits::Number { low: 0.0, above: true, high: 1000.0 });
        assert_eq!(key("binarize.level").method.as_deref(), Some("fixed"));
        assert_eq!(key("binarize.factor").method.as_deref(), Some("dynamic"));
        assert_eq!(key("body.limb_height_km").limits, Limits::Number { low: -50.0, above: false, high: 500.0 });
        let Limits::Choice(words) = &key("recover.combine").limits else { panic!() };
        assert_eq!(words, &["median", "mean"]);
        assert_eq!(key("gate.max_mean").meaning, key("gate.min_mean").meaning);
    }
}
