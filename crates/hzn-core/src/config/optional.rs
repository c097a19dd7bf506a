//! What a build may lack: methods and presets of published systems stand behind features, so that a flight computer
//! links only what it flies.

/// A value in sensor.toml that needs a feature of this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Optional {
    /// The key, such as `estimate.method`.
    pub key: &'static str,
    /// The value, as it is written there.
    pub value: &'static str,
    /// The feature.
    pub feature: &'static str,
    /// Whether this build has it.
    pub built: bool,
}

macro_rules! optional {
    ($($feature:literal: $key:literal = $value:literal;)*) => {
        &[$(Optional { key: $key, value: $value, feature: $feature, built: cfg!(feature = $feature) }),*]
    };
}

/// Every value that needs a feature, as lines `"dlr": "estimate.method" = "direct";`.
pub const OPTIONAL: &[Optional] = optional! {
    "erf": "candidates.sub_pixel" = "erf";
    "zju": "candidates.sub_pixel" = "zernike";
    "zju": "contour.method" = "sobel";
    "zju": "preset" = "zju-2022";
    "dlr": "covariance.method" = "braun-barf";
    "reml": "covariance.noise" = "reml";
    "dlr": "estimate.method" = "conic";
    "dlr": "estimate.method" = "direct";
    "dlr": "preset" = "dlr-2022";
    "dlr": "reject.method" = "ransac";
    "horace": "contour.method" = "erode";
    "horace": "contour.method" = "raster";
    "horace": "estimate.method" = "circle";
    "horace": "preset" = "horace-2015";
    "horace": "recover.method" = "division";
    "zju": "estimate.method" = "tls";
    "zju": "reject.method" = "mlesac";
    "zju": "reject.method" = "ransac-preverify";
    "zju": "estimate.method" = "wtls";
};

/// The feature that a value of a key needs and this build lacks.
pub fn lacking(key: &str, value: &str) -> Option<&'static str> {
    OPTIONAL.iter().find(|o| !o.built && o.key == key && o.value == value).map(|o| o.feature)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_not_built_is_lacking() {
        for o in OPTIONAL {
            assert_eq!(lacking(o.key, o.value), (!o.built).then_some(o.feature));
        }
        assert_eq!(lacking("estimate.method", "sphere"), None);
    }
}
