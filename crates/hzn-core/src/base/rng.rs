//! A small random number generator: the same seed gives the same numbers on every target.

/// PCG32 with a 64-bit state (O'Neill 2014, XSH-RR).
#[derive(Debug, Clone)]
// The generator is fixed and not that of a crate, because another version of a crate would give other draws, and with
// them other answers in the last digits.
pub(crate) struct Rng(u64);

impl Rng {
    /// Seeds the generator.
    pub(crate) fn new(seed: u32) -> Self {
        // The product spreads the seeds over the whole state: with 0, 1, 2, ... as states the first numbers would be
        // related.
        let mut rng = Self(u64::from(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x853C_49E6_748F_EA9B);
        // An output is computed from the state before the step, so the first one depends on the seed alone. It is left
        // out.
        rng.next();
        rng
    }

    fn next(&mut self) -> u32 {
        let old = self.0;
        self.0 = old.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let xorshifted = (((old >> 18) ^ old) >> 27) as u32;
        xorshifted.rotate_right((old >> 59) as u32)
    }

    /// Returns a random number below `n`; 0 when `n` is 0. The probabilities are equal to within n/2³².
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        // A product and a shift replace the remainder of a division, which is slower on a Cortex-M and has a panic path
        // for 0.
        ((u64::from(self.next()) * u64::from(n)) >> 32) as u32
    }
}
