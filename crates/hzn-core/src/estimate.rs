//! The fit.

/// What the fit takes for the half-angle of the cone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum HalfAngle {
    /// Fitted freely, then fused with the expected one by their covariances. Never worse than the better of the two.
    #[default]
    Fused,
    /// The expected one, exactly.
    Known,
    /// Fitted; the expected one is only a start.
    Free,
}

/// `[estimate]` of sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// What the fit takes for the half-angle.
    pub half_angle: HalfAngle,
}
