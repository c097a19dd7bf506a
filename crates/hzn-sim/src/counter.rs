//! Random numbers by index: each value is a hash of (seed, stream, index). Each pixel can therefore be drawn alone, in
//! any order and on any number of threads.
//!
//! The hash is the finaliser of SplitMix64 (Steele, Lea, Flood 2014), applied twice so that neighbouring seeds and
//! neighbouring indices are unrelated.

/// The purpose of the numbers. Different uses of one seed must not share their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Noise of the detector, one number per pixel.
    Detector = 1,
    /// The choice of hot pixels.
    HotPixels,
    /// Positions of the stars.
    Stars,
    /// Errors of limb points along u.
    EdgeU,
    /// Errors of limb points along v.
    EdgeV,
    /// Error of the attitude that the sensor gets as a prior.
    AttitudePrior,
    /// Offset of every pixel.
    FixedPattern,
    /// Gain of every pixel.
    GainPattern,
    /// Drift of the vehicle's rotation.
    Drift,
    /// Errors of gyroscopes and accelerometers.
    Imu,
    /// Errors of a satellite navigation receiver.
    Gnss,
    /// Artefacts in the picture.
    Artefact,
    /// Painted discs.
    Painted,
    /// Constant errors of gyroscopes and accelerometers besides their biases.
    ImuErrors,
    /// Errors of the cameras' mounts.
    Mount,
    /// Jitter of the cameras' clocks.
    Clock,
    /// Random pictures of a body.
    Trials,
    /// Random part of an encounter with a body, and the error of its range.
    Encounter,
    /// Weather of the limb.
    Weather,
}

/// A sequence of random numbers, read by index.
#[derive(Debug, Clone, Copy)]
pub struct Counter {
    key: u64,
}

/// Finaliser of SplitMix64: a bijection of 64 bits. Each output bit depends on every input bit.
#[inline(always)]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl Counter {
    /// Returns the sequence of a seed and a purpose.
    pub fn new(seed: u64, stream: Stream) -> Self {
        Self { key: mix(seed ^ (stream as u64).wrapping_mul(0xD1B5_4A32_D192_ED03)) }
    }
    /// Returns 64 random bits.
    #[inline(always)]
    pub fn bits(&self, index: u64) -> u64 {
        mix(self.key.wrapping_add(index.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
    }
    /// Returns a uniform number between 0 and 1, without the ends.
    #[inline(always)]
    pub fn uniform(&self, index: u64) -> f64 {
        ((self.bits(index) >> 11) as f64 + 0.5) * (1.0 / 9_007_199_254_740_992.0)
    }
    /// Returns two independent normal numbers (mean 0, variance 1) by the method of Box and Muller.
    #[inline(always)]
    pub fn normal_pair(&self, index: u64) -> [f32; 2] {
        let bits = self.bits(index);
        // With 32 bits the radius reaches 6.7 sigma at most. No picture shows a difference from an unlimited
        // distribution.
        let radius_u = ((bits >> 32) as f32 + 0.5) * (1.0 / 4_294_967_296.0);
        let turn = (bits as u32 >> 8) as f32 * (1.0 / 16_777_216.0);
        let radius = (-2.0 * libm::logf(radius_u.min(1.0))).sqrt();
        let (sin, cos) = libm::sincosf(turn * core::f32::consts::TAU);
        [radius * cos, radius * sin]
    }
    /// Returns one normal number (mean 0, variance 1).
    pub fn normal(&self, index: u64) -> f64 {
        f64::from(self.normal_pair(index)[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_numbers_are_normal_and_unrelated() {
        let c = Counter::new(7, Stream::Detector);
        let n = 200_000u64;
        let (mut sum, mut square, mut fourth, mut lagged, mut last) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for i in 0..n / 2 {
            for x in c.normal_pair(i).map(f64::from) {
                sum += x;
                square += x * x;
                fourth += x.powi(4);
                lagged += x * last;
                last = x;
            }
        }
        let n = n as f64;
        // The limits are four standard errors of each moment.
        assert!((sum / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((fourth / n - 3.0).abs() < 4.0 * (96.0 / n).sqrt());
        assert!((lagged / n).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn streams_and_seeds_differ() {
        let a = Counter::new(1, Stream::Stars).bits(0);
        assert_ne!(a, Counter::new(2, Stream::Stars).bits(0));
        assert_ne!(a, Counter::new(1, Stream::HotPixels).bits(0));
    }
}
