//! `[track]`: the limb of a sequence is looked for where the picture before puts it.

use crate::base::keys::section;

section! {
    /// `[track]` of sensor.toml: the search of a limb where the picture before puts it, in a sequence.
    "track" pub struct Config: Copy {
        /// Number of pictures from one full search to the next in a sequence; in between, the limb is first looked for
        /// where the last answer puts it. 0 searches every picture fully.
        ///
        /// A picture whose limb is not found there, without a doubt, is searched fully, and so is the picture after
        /// one without an answer. Tracking shortens the calculation and changes answers by a part of their sigma,
        /// because fewer edge points are measured. It is for one body with a known distance; Sun and Moon, a body
        /// whose position is fitted, and a sensor with limits of its own in `[brightness]` are always searched fully.
        @140 full_every: u16 = 0, [0.0 to 65535.0];
        /// Number of places along the predicted limb at which its edge is looked for; a larger number is more accurate
        /// and takes longer.
        @141 normals: u16 = 128, [32.0 to 2048.0];
    }
}

impl Config {
    /// Returns whether pictures of a sequence are tracked.
    pub fn is_on(&self) -> bool {
        self.full_every > 1
    }
}
