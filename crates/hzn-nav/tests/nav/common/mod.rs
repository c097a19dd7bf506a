//! Random numbers for the tests.

use hzn_nav::frames::Vector;

/// A generator that gives the same sequence on every machine.
pub(crate) struct Draws(pub(crate) u64);

impl Draws {
    /// Returns a number between 0 and 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        // SplitMix64 (Steele, Lea & Flood 2014).
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Returns a normal number with mean 0 and standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (core::f64::consts::TAU * self.uniform()).cos()
    }
    /// Returns a vector of three normal numbers with mean 0.
    pub(crate) fn vector<F>(&mut self, sigma: f64) -> Vector<F> {
        core::array::from_fn(|_| sigma * self.normal()).into()
    }
}
