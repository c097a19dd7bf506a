//! Applies the `[input]` of a sensor to a picture: the number of bits, the turn, and the inversion.

use hzn_core::config::Input;
use image::metadata::Orientation;

use super::picture::{Picture, Samples};
use super::turn;

impl Picture {
    /// Returns the picture with the number of bits, the turn and the inversion that the sensor's `[input]` sets.
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
        let turned = turn::apply(self, turn);
        Ok(if input.invert { turned.inverted() } else { turned })
    }

    /// Returns whether [`Self::with_input`] changes the pixels of the picture.
    pub fn is_changed(&self, input: &Input) -> bool {
        input.invert || turn::choose(input.orient, self.orientation) != Orientation::NoTransforms
    }

    /// Returns the picture with dark and bright exchanged: full scale minus each sample, but not the transparency.
    pub fn inverted(mut self) -> Self {
        let channels = usize::from(self.layout.channels.max(1));
        let full = ((1u32 << self.layout.bits.clamp(1, 16)) - 1) as u16;
        let colours = if channels.is_multiple_of(2) { channels - 1 } else { channels };
        match &mut self.samples {
            Samples::Bytes(data) => data.chunks_mut(channels).flat_map(|p| p.iter_mut().take(colours)).for_each(|v| {
                *v = (full as u8).saturating_sub(*v);
            }),
            Samples::Words(data) => data.chunks_mut(channels).flat_map(|p| p.iter_mut().take(colours)).for_each(|v| {
                *v = full.saturating_sub(*v);
            }),
        }
        self
    }

    /// Returns in words how the picture is to be turned for display, if the camera recorded a turn.
    pub fn display_turn(&self) -> Option<&'static str> {
        (self.orientation != Orientation::NoTransforms).then(|| turn::describe(self.orientation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::image::Layout;

    #[test]
    fn an_inverted_picture_is_full_scale_minus_each_sample() {
        let input = Input { invert: true, ..Input::default() };
        let bytes = Picture::new(Samples::Bytes(vec![0, 10, 255, 200]), Layout::packed(1, 1, 4, 8));
        assert!(bytes.is_changed(&input) && !bytes.is_changed(&Input::default()));
        // The fourth channel is the transparency.
        assert!(matches!(bytes.with_input(&input).unwrap().samples, Samples::Bytes(d) if d == [255, 245, 0, 200]));
        let words = Picture::new(Samples::Words(vec![0, 4095, 1000]), Layout::packed(3, 1, 1, 12));
        assert!(matches!(words.with_input(&input).unwrap().samples, Samples::Words(d) if d == [4095, 0, 3095]));
    }
}
