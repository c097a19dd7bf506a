//! The time code of packets: CUC, the unsegmented time code of CCSDS 301.0-B.
//!
//! A time has eight bytes: the P-field, which says what the time counts from, four bytes of seconds and three bytes of
//! their fraction (2^-24 s, 60 ns).

/// What a time counts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Epoch {
    /// The start of the computer: its clock was not correlated yet. The P-field is `2F` (epoch of the agency).
    Start,
    /// 1958-01-01 TAI, the epoch of CCSDS. The P-field is `1F`.
    Tai,
}

/// A time.
///
/// ```
/// use hzn_flight::cuc::Cuc;
///
/// let time = Cuc::tai(1_500_000);
/// assert_eq!(time.to_bytes(), [0x1F, 0, 0, 0, 1, 0x80, 0, 0]); // one and a half seconds
/// assert_eq!(Cuc::from_bytes(time.to_bytes()), Some(time));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cuc {
    /// What the time counts from.
    pub epoch: Epoch,
    /// The time in microseconds. The code holds times below 2^32 seconds.
    pub us: u64,
}

/// Extension no; time code 001 (epoch 1958) or 010 (epoch of the agency); 4 bytes of seconds; 3 bytes of fraction.
// The P-field is sent, because both epochs occur in one stream: the clock is correlated only after the start. Four
// bytes of seconds since 1958 last until 2094. Three bytes of fraction, because two would have steps of 15 µs.
const TAI: u8 = 0b0001_1111;
const START: u8 = 0b0010_1111;
const US_PER_S: u64 = 1_000_000;

impl Cuc {
    /// Number of bytes of a time.
    pub const BYTES: usize = 8;

    /// Makes a time since the start of the computer, from microseconds.
    pub const fn since_start(us: u64) -> Self {
        Self { epoch: Epoch::Start, us }
    }
    /// Makes a time since 1958-01-01 TAI, from microseconds.
    pub const fn tai(us: u64) -> Self {
        Self { epoch: Epoch::Tai, us }
    }
    /// Returns the bytes of the code. Microseconds survive exactly.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let p_field = match self.epoch {
            Epoch::Start => START,
            Epoch::Tai => TAI,
        };
        // The remainder has 20 bits, so that the shift cannot overflow.
        let fraction = ((self.us % US_PER_S) << 24) / US_PER_S;
        let code = (self.us / US_PER_S) << 24 | fraction;
        // The mask cuts seconds from 2^32 on, because they would change the P-field.
        (u64::from(p_field) << 56 | code & (u64::MAX >> 8)).to_be_bytes()
    }
    /// Reads a code; `None` if its P-field is another.
    pub fn from_bytes(bytes: [u8; Self::BYTES]) -> Option<Self> {
        let [p_field, ..] = bytes;
        let epoch = match p_field {
            TAI => Epoch::Tai,
            START => Epoch::Start,
            // The first version of telemetry had microseconds here, whose first byte is 0.
            _ => return None,
        };
        let code = u64::from_be_bytes(bytes) & (u64::MAX >> 8);
        let (seconds, fraction) = (code >> 24, code & 0xFF_FFFF);
        // It rounds to the nearest, because `to_bytes` rounds down. Otherwise most times would lose 1 µs.
        Some(Self { epoch, us: seconds * US_PER_S + ((fraction * US_PER_S + (1 << 23)) >> 24) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_implementation_reads_the_code() {
        use spacepackets::time::TimeReader;
        use spacepackets::time::cuc::CucTime;
        for (us, seconds) in [(0, 0), (2_171_923_200_500_000, 2_171_923_200u64), (4_294_967_295_999_999, 4_294_967_295)]
        {
            let theirs = CucTime::from_bytes(&Cuc::tai(us).to_bytes()).unwrap();
            assert_eq!(u64::from(theirs.counter()), seconds);
            let fraction = f64::from(theirs.fractions().counter()) / f64::from(1 << 24);
            assert!((fraction - (us % 1_000_000) as f64 * 1e-6).abs() < 1e-7, "{fraction}");
        }
    }

    #[test]
    fn microseconds_survive() {
        // Miri takes milliseconds for each.
        let step = if cfg!(miri) { 7007 } else { 7 };
        for us in (0..1_000_000).step_by(step).chain([1, 999_999, 4_294_967_295_999_999]) {
            for time in [Cuc::tai(us), Cuc::since_start(us)] {
                assert_eq!(Cuc::from_bytes(time.to_bytes()), Some(time));
            }
        }
        assert_eq!(Cuc::from_bytes(1_000_000u64.to_be_bytes()), None, "microseconds, as in the first version");
    }
}
