//! The sources of the limb height.

use crate::base::keys::choices;

choices! {
    /// The source of the limb height.
    pub enum Limb {
        /// The visible limb: its height follows from `input.tone` unless `limb_height_km` has another value than the
        /// default.
        @- Visible = "visible";
        /// The height is `limb_height_km`, for any tone; without `limb`, a file that has one of the keys
        /// `limb_height_km`, `limb_height_sigma_km` and `limb_height_by_latitude_km` means this.
        @- Height = "height";
    }
}
