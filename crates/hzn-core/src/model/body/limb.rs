//! The sources of the limb height.

use crate::base::keys::choices;

choices! {
    /// The source of the limb height.
    pub enum Limb {
        /// The visible limb: its sigma follows from `input.tone`, and where edges are at half of the counts, its height
        /// does, unless they have other values than the defaults.
        @- Visible = "visible";
        /// The limb in the band of CO2 at 15 µm, of a thermal camera with such a filter: a table by month and latitude,
        /// for a time (UTC) and a position; without them its mean, 40 km, with a wider sigma.
        @- Co2 = "co2-15um";
        /// The limb from 8 to 14 µm, of a thermal camera without a filter: 12 ± 7 km, because clouds, water vapour and
        /// ozone form it, and nobody published its height.
        @- Window = "window-8-14um";
        /// The height is `limb_height_km`, for any tone; without `limb`, a file that has one of the keys
        /// `limb_height_km`, `limb_height_sigma_km` and `limb_height_by_latitude_km` means this.
        @- Height = "height";
    }
}

choices! {
    /// What the sensor does in a picture in which the Sun is known to be down.
    pub enum Night {
        /// Refuse every edge: at night no part of the limb is seen in sunlight.
        @0 Refuse = "refuse";
        /// Search for the outer edge of the layer of airglow.
        @1 Airglow = "airglow";
    }
}
