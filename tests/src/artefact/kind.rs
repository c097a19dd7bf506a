//! The list of artefacts.

/// An artefact that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A flare ring: bright along a circle in the picture, dark on both sides.
    Ring,
    /// A ghost: a disc in the picture with a radius of at least a tenth of the diagonal.
    Disc,
    /// The image of an iris with 5 to 9 corners, its blades straight or slightly curved.
    Polygon,
    /// A soft curved streak, or the edge of a veil.
    Streak,
    /// The edge of a ghost whose middle is far outside the picture, through fisheye lenses.
    FarDisc,
    /// Several ghosts on a line through the principal point, with the source of light in the picture or next to it.
    Chain,
    /// Stray light around a source in the picture or next to it.
    Glare,
    /// Straight parts of the vehicle.
    Panel,
    /// The frame of a window around the sky, with round corners or as a porthole.
    Window,
    /// The Moon, with a phase and a halo.
    Moon,
    /// Clouds, fronts and coasts seen from above, without a limb.
    Clouds,
    /// Cities, roads and lightning at night, without a limb.
    Lights,
    /// A ghost far off the axis: cut by a rim of the lens, or an ellipse.
    Vignetted,
}

impl Kind {
    /// All kinds. The pictures of a kind depend on its position in this list.
    pub const ALL: &[Self] = &[
        Self::Ring,
        Self::Disc,
        Self::Polygon,
        Self::Streak,
        Self::FarDisc,
        Self::Chain,
        Self::Glare,
        Self::Panel,
        Self::Window,
        Self::Moon,
        Self::Clouds,
        Self::Lights,
        Self::Vignetted,
    ];

    /// Returns the name in tables and on command lines.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ring => "ring",
            Self::Disc => "disc",
            Self::Polygon => "polygon",
            Self::Streak => "streak",
            Self::FarDisc => "far-disc",
            Self::Chain => "chain",
            Self::Glare => "glare",
            Self::Panel => "panel",
            Self::Window => "window",
            Self::Moon => "moon",
            Self::Clouds => "clouds",
            Self::Lights => "lights",
            Self::Vignetted => "vignetted",
        }
    }

    /// Returns the kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|k| k.name() == name)
    }

    /// Returns true if the kind has edges of discs, which can have exactly the expected half-angle.
    pub const fn is_disc(self) -> bool {
        matches!(self, Self::Disc | Self::FarDisc | Self::Chain | Self::Vignetted)
    }

    /// Returns true if the camera looks down on the body from too near to have its limb in view.
    pub const fn is_ground(self) -> bool {
        matches!(self, Self::Clouds | Self::Lights)
    }
}
