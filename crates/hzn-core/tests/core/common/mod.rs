//! Pictures that several tests use.

/// Number of kinds of [`garbage`].
pub(crate) const KINDS: u8 = 10;

/// Draws 96 by 64 pixels without a meaning: noise, stripes, blocks, one lit pixel, discs, slopes.
pub(crate) fn garbage(kind: u8, seed: u64, level: u8) -> Vec<u8> {
    let mut state = seed | 1;
    (0..96u32 * 64)
        .map(|i| {
            let (x, y) = (i % 96, i / 96);
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let random = (state >> 56) as u8;
            let on = match kind {
                0 => random > level,
                1 => (x + y) % 2 == 0,
                2 => x % (2 + u32::from(level % 7)) == 0,
                3 => y % (2 + u32::from(level % 7)) == 0,
                4 => (x / 8 + y / 8) % 2 == 0,
                5 => i == u32::from(level) * 20,
                6 => y > 30 + (x * u32::from(level)) / 800,
                7 => (x as i32 - 48).pow(2) + (y as i32 - 32).pow(2) < i32::from(level) * 4,
                8 => x * 2 > y + u32::from(level),
                _ => random > 127 && y > 20,
            };
            if on { 200 } else { random / 16 }
        })
        .collect()
}
