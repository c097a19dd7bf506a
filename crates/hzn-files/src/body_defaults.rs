//! The values of `[body]` that depend on the kind of body: a planet has another limb height than the Earth.

use hzn_core::body::{Config, Kind, Limb};
use toml::de::{DeTable, DeValue};

use crate::merge::merge_missing;

/// Returns for each body of the file, in order, the limb height that fits its kind, and where it comes from, as TOML;
/// empty for a body with the default limb height of the Earth.
pub(crate) fn body_defaults(sensor: &DeTable<'_>) -> Vec<String> {
    let of = |body: &DeValue<'_>| body.as_table().map(|body| limb(body) + &defaults(body).unwrap_or_default());
    let of = |body: &DeValue<'_>| of(body).unwrap_or_default();
    match (sensor.get("body"), sensor.get("bodies").and_then(|bodies| bodies.get_ref().as_array())) {
        (Some(body), _) => vec![of(body.get_ref())],
        (None, Some(bodies)) => bodies.iter().map(|body| of(body.get_ref())).collect(),
        (None, None) => Vec::new(),
    }
}

/// Adds these values to `[body]` or to each of `[[bodies]]`, where the file does not have them.
pub(crate) fn merge_body_defaults<'i>(sensor: &mut DeTable<'i>, values: &'i [String]) {
    let merge = |body: &mut DeValue<'i>, values: &'i str| {
        if let (DeValue::Table(body), Ok(values)) = (body, DeTable::parse(values)) {
            merge_missing(body, values.into_inner());
        }
    };
    if let (Some(body), Some(values)) = (sensor.get_mut("body"), values.first()) {
        merge(body.get_mut(), values);
    } else if let Some(DeValue::Array(bodies)) = sensor.get_mut("bodies").map(toml::Spanned::get_mut) {
        bodies.iter_mut().zip(values).for_each(|(body, values)| merge(body.get_mut(), values));
    }
}

/// The keys that set a limb height.
const HEIGHT_KEYS: [&str; 2] = ["limb_height_km", "limb_height_by_latitude_km"];

/// Returns the height of a thermal band, or `limb = "height"` for a body whose file sets a limb height; else an empty
/// text.
fn limb(body: &DeTable<'_>) -> String {
    let is_set = HEIGHT_KEYS.iter().any(|key| body.contains_key(*key));
    let told = body.get("limb").and_then(|limb| limb.get_ref().as_str());
    let band = Limb::ALL.iter().find(|limb| told == Some(limb.name())).and_then(|limb| limb.thermal_km());
    match band {
        Some([height, sigma]) => format!("limb_height_km = {height:?}\nlimb_height_sigma_km = {sigma:?}\n"),
        None if is_set => format!("limb = {:?}\n", Limb::Height.name()),
        None => String::new(),
    }
}

/// Returns the values as TOML; `None` for a body with the limb height of the Earth. Wrong values are left to the reader
/// of the section.
fn defaults(body: &DeTable<'_>) -> Option<String> {
    let kind = body.get("kind")?.get_ref().as_str()?;
    let kind = *Kind::ALL.iter().find(|k| k.name() == kind)?;
    let config = Config::of_kind(kind, radii_km(body));
    let values = [
        ("limb_height_km", config.limb_height_km),
        ("limb_height_sigma_km", config.limb_height_sigma_km),
        ("clipped_height_km", config.clipped_height_km),
        ("clipped_sigma_km", config.clipped_sigma_km),
    ];
    config.is_ellipsoid().then(|| values.iter().map(|(key, value)| format!("{key} = {value:?}\n")).collect())
}

fn radii_km(body: &DeTable<'_>) -> Option<[f64; 3]> {
    let radii = body.get("radii_km")?.get_ref().as_array()?;
    let number = |value: &DeValue<'_>| match value {
        DeValue::Float(x) => x.as_str().parse().ok(),
        DeValue::Integer(x) => x.as_str().parse().ok(),
        _ => None,
    };
    let radii: Vec<f64> = radii.iter().filter_map(|value| number(value.get_ref())).collect();
    radii.try_into().ok()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    fn body(text: &str) -> hzn_core::body::Config {
        let camera = "[camera]\nwidth = 64\nheight = 48\nmodel = \"pinhole\"\nfx_px = 60.0\nfy_px = 60.0\n\
                      cx_px = 31.5\ncy_px = 23.5\n";
        crate::sensor::parse(&format!("{camera}{text}"), Path::new("sensor.toml")).unwrap().config.each_body()[0]
            .clone()
    }

    #[test]
    fn a_planet_has_its_own_limb_height_unless_the_file_says_another() {
        let jupiter = body("[body]\nkind = \"jupiter\"\n");
        assert_eq!((jupiter.limb_height_km, jupiter.limb_height_sigma_km), (80.0, 80.0));
        assert!((jupiter.clipped_height_km - 7.8 * 27.0 / 7.5).abs() < 1e-9);
        let told = body("[body]\nkind = \"jupiter\"\nlimb_height_km = 150\n");
        assert_eq!((told.limb_height_km, told.limb_height_sigma_km), (150.0, 80.0));
        let own = body("[[bodies]]\nkind = \"ellipsoid\"\nradii_km = [13, 11.4, 9.1]\n");
        assert_eq!((own.limb_height_km, own.clipped_height_km), (0.0, 0.0));
        assert!((own.limb_height_sigma_km - 33.5e-3).abs() < 1e-9);
        // The told height is that of the pictures, whatever their tone.
        let toned = body(&format!("[input]\ntone = \"srgb\"\n{AT_THRESHOLD}[body]\nkind = \"jupiter\"\n"));
        assert!((toned.limb_height_km - 102.9).abs() < 0.05, "{}", toned.limb_height_km);
        let told = body("[input]\ntone = 2.2\n[body]\nkind = \"jupiter\"\nlimb_height_km = 80\n");
        assert_eq!(told.limb_height_km, 80.0);
        let earth = body("[body]\nkind = \"earth\"\n");
        assert_eq!((earth.limb_height_km, earth.limb_height_sigma_km), (17.0, 7.0));
    }

    /// Edges at the threshold are at half of the counts. All others are at half of the light.
    const AT_THRESHOLD: &str = "[edge_points]\nsub_pixel = \"none\"\n";

    #[test]
    fn a_tone_moves_the_default_height_only() {
        use hzn_core::body::Limb;
        let of = |text: &str| {
            let located = body(text);
            assert!(located.limb == Limb::Height || located.limb_height_km == 17.0, "{text}");
            let body = body(&format!("{AT_THRESHOLD}{text}"));
            (body.limb, (body.limb_height_km * 10.0).round() / 10.0, body.limb_height_sigma_km)
        };
        assert_eq!(of("[input]\ntone = \"srgb\"\n"), (Limb::Visible, 23.4, 7.0));
        assert_eq!(of("[input]\ntone = \"bt709\"\n[[bodies]]\nkind = \"earth\"\n"), (Limb::Visible, 21.9, 7.0));
        assert_eq!(of("[input]\ntone = 2\n"), (Limb::Visible, 22.2, 7.0));
        assert_eq!(of("[input]\ntone = \"unknown\"\n"), (Limb::Visible, 17.0, 7.0));
        let told = "[input]\ntone = \"srgb\"\n[body]\nlimb_height_km = 17\n";
        assert_eq!(of(told), (Limb::Height, 17.0, 7.0));
        assert_eq!(of("[input]\ntone = \"srgb\"\n[body]\nlimb_height_sigma_km = 2\n"), (Limb::Visible, 23.4, 2.0));
        // A written configuration is read as it was, before and after the tone is known.
        for text in ["[body]\nkind = \"earth\"\n", "[input]\ntone = \"srgb\"\n", told] {
            let camera = "[camera]\nwidth = 64\nheight = 48\nmodel = \"pinhole\"\nfx_px = 60.0\nfy_px = 60.0\n\
                          cx_px = 31.5\ncy_px = 23.5\n";
            let read = |text: &str| crate::sensor::parse(text, Path::new("sensor.toml")).unwrap().config;
            let config = read(&format!("{camera}{text}"));
            assert_eq!(read(&crate::sensor::to_text(&config).unwrap()), config, "{text}");
        }
    }

    #[test]
    fn a_thermal_band_has_its_own_height() {
        let of = |text: &str| body(&format!("[input]\ntone = \"srgb\"\n[body]\n{text}"));
        let co2 = of("limb = \"co2-15um\"\n");
        assert!(co2.limb_height_km == 40.0 && (2.0..3.0).contains(&co2.limb_height_sigma_km));
        assert_eq!(of("limb = \"co2-15um\"\nlimb_height_sigma_km = 4\n").limb_height_sigma_km, 4.0);
        assert_eq!(of("limb = \"window-8-14um\"\n").limb_height_km, 12.0);
        assert_eq!(of("limb = \"height\"\nlimb_height_km = 25\n").limb_height_km, 25.0);
        let camera = "[camera]\nwidth = 64\nheight = 48\nfx_px = 60.0\nfy_px = 60.0\ncx_px = 31.5\ncy_px = 23.5\n";
        let both = format!("{camera}[body]\nlimb = \"co2-15um\"\nlimb_height_km = 25\n");
        let refused = crate::sensor::parse(&both, Path::new("s.toml")).unwrap_err().to_string();
        assert!(refused.contains("s.toml:9: [body] limb: the band gives the limb height: remove"), "{refused}");
        let written = crate::sensor::parse(&format!("{camera}[body]\nlimb = \"co2-15um\"\n"), Path::new("s.toml"));
        let config = written.unwrap().config;
        let again = crate::sensor::parse(&crate::sensor::to_text(&config).unwrap(), Path::new("s.toml")).unwrap();
        assert_eq!(again.config, config);
    }
}
