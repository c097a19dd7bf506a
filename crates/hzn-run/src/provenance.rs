//! Where a drawing, a report or an export comes from: version, sensor and command.

use std::path::Path;

use hzn_core::Config;
use sha2::{Digest, Sha256};

/// Hexadecimal digits of the hash of a sensor. Two sensors have the same ones by chance less than once in 10¹⁴ pairs.
const DIGITS: usize = 12;

/// Returns the first 12 hexadecimal digits of the SHA-256 of a sensor. Sensors with the same values of all keys have
/// the same hash, whatever their files look like. `hzn info sensor.toml` prints it.
///
/// # Examples
/// ```
/// let text = "[camera]\nwidth = 640\nheight = 480\nfx_px = 500.0\nfy_px = 500.0\ncx_px = 319.5\ncy_px = 239.5\n";
/// let sensor = |text: &str| hzn_files::sensor::parse(text, "sensor.toml".as_ref()).unwrap().config;
/// let hash = hzn_run::provenance::hash(&sensor(text)).unwrap();
/// let with_comment = format!("# the camera at the bow\n{text}");
/// assert_eq!(hzn_run::provenance::hash(&sensor(&with_comment)), Some(hash));
/// ```
pub fn hash(config: &Config) -> Option<String> {
    let text = hzn_files::sensor::to_text(config).ok()?;
    let digest = Sha256::digest(text.as_bytes());
    let mut digits: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    digits.truncate(DIGITS);
    Some(digits)
}

/// Returns the hash of a sensor.toml, as [`hash`] does; `None` if the text is no sensor.
pub fn hash_of_text(text: &str) -> Option<String> {
    let sensor = hzn_files::sensor::parse(text, Path::new("sensor.toml")).ok()?;
    hash(&sensor.config)
}

/// Returns the command of this process as a user would type it; `program` is its name.
pub fn command(program: &str) -> String {
    // The program may lie anywhere, so its own path is left out.
    let words = std::env::args_os().skip(1).map(|word| quoted(Path::new(&word)));
    std::iter::once(program.to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

/// Returns the line for a drawing: version, hash of the sensor and command.
pub fn line(sensor: Option<&str>, command: &str) -> String {
    let sensor = sensor.map(|hash| format!("sensor {hash}, ")).unwrap_or_default();
    format!("hzn {}, {sensor}{command}", env!("CARGO_PKG_VERSION"))
}

/// Quotes a word of a command line if a shell would interpret it.
pub fn quoted(word: &Path) -> String {
    let text = word.to_string_lossy();
    let plain = |c: char| c.is_ascii_alphanumeric() || "_./:=@%+,-".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.into_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "[camera]\nwidth = 640\nheight = 480\nfx_px = 500.0\nfy_px = 500.0\ncx_px = 319.5\n\
                        cy_px = 239.5\n[body]\nkind = \"earth\"\n";

    #[test]
    fn the_hash_is_that_of_the_values() {
        let one = hash_of_text(TEXT).unwrap();
        assert_eq!(one.len(), DIGITS);
        assert!(one.chars().all(|c| c.is_ascii_hexdigit()), "{one}");
        let commented = TEXT.replace("[body]", "# a comment\n\n[body]");
        assert_eq!(hash_of_text(&commented), Some(one.clone()));
        assert_ne!(hash_of_text(&TEXT.replace("319.5", "319.25")), Some(one.clone()));
        let config = hzn_files::sensor::parse(TEXT, Path::new("sensor.toml")).unwrap().config;
        let written = hzn_files::sensor::to_text(&config).unwrap();
        assert_eq!(hash_of_text(&written), Some(one), "the complete text of the same sensor");
        assert_eq!(hash_of_text("[camera]\nwidth = 0\n"), None);
    }

    #[test]
    fn the_line_names_version_sensor_and_command() {
        let told = line(Some("0123456789ab"), "hzn run flight");
        assert_eq!(told, format!("hzn {}, sensor 0123456789ab, hzn run flight", env!("CARGO_PKG_VERSION")));
        assert!(!line(None, "hzn run flight").contains("sensor"));
    }
}
