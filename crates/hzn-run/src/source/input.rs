//! Applies the `[input]` of a sensor to a picture: the number of bits and the turn.

use hzn_core::config::Input;
use image::metadata::Orientation;

use super::picture::Picture;
use super::turn;

impl Picture {
    /// Returns the picture with the number of bits and the turn that the sensor's `[input]` sets.
    ///
    /// # Errors
    /// A sample has more bits.
    pub fn with_input(mut self, input: &Input) -> Result<Self, String> {
        if let (Some(largest), Some(bits)) = (self.largest_word(), input.bits) {
            if u32::from(largest) >> bits > 0 {
                let needed = 16 - largest.leading_zeros();
                return Err(format!(
                    "a sample of {largest} has more bits than input.bits = {bits} (from sensor.toml or from the other \
                     pictures): set bits = {needed} or more in [input] of sensor.toml"
                ));
            }
            self.layout.bits = bits;
        }
        let turn = turn::choose(input.orient, self.orientation);
        Ok(turn::apply(self, turn))
    }

    /// Returns whether [`Self::with_input`] turns the picture.
    pub fn is_turned(&self, input: &Input) -> bool {
        turn::choose(input.orient, self.orientation) != Orientation::NoTransforms
    }

    /// Returns in words how the picture is to be turned for display, if the camera recorded a turn.
    pub fn display_turn(&self) -> Option<&'static str> {
        (self.orientation != Orientation::NoTransforms).then(|| turn::describe(self.orientation))
    }
}
