//! The parameters of the flight software itself, which sensor.toml does not have.

use hzn_core::keys::Value;

use crate::packet::ApidBase;

/// Limits of a parameter: the smallest and the largest value.
pub type Limits = (f64, f64);

macro_rules! operations {
    ($(
        $(#[$doc:meta])*
        @$number:literal $name:literal $field:ident: $t:ty = $default:expr, [$low:literal, $high:literal];
    )*) => {
        /// The parameters of the flight software itself.
        #[derive(Debug, Clone, PartialEq)]
        pub struct Operations {
            $($(#[$doc])* pub $field: $t,)*
        }

        impl Default for Operations {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl Operations {
    /// Number of `line.apid_base`.
    pub(crate) const APID_BASE: u16 = 302;

            /// The numbers of the parameters.
            pub const NUMBERS: &'static [u16] = &[$($number),*];

            /// Returns the name of a parameter.
            pub fn name(id: u16) -> Option<&'static str> {
                match id {
                    $($number => Some($name),)*
                    _ => None,
                }
            }
            /// Returns the limits of a parameter.
            pub fn limits(id: u16) -> Option<Limits> {
                match id {
                    $($number => Some(($low, $high)),)*
                    _ => None,
                }
            }
            /// Returns the value of a parameter.
            pub fn get(&self, id: u16) -> Option<f64> {
                match id {
                    $($number => Some(self.$field.number(0)),)*
                    _ => None,
                }
            }
            /// Sets a parameter. Returns whether it can have the value; `None` if there is no such parameter.
            pub fn set(&mut self, id: u16, value: f64) -> Option<bool> {
                match id {
                    $($number => Some(self.$field.set_number(0, value).is_some()),)*
                    _ => None,
                }
            }
        }
    };
}

operations! {
    /// Number of pictures from one housekeeping packet to the next.
    @300 "telemetry.housekeeping_every" housekeeping_every: u16 = 10, [1.0, 65535.0];
    /// Longest time from one housekeeping packet to the next, s.
    // With 5 s the computer is heard from within ten seconds, even if one packet is lost.
    @301 "telemetry.housekeeping_s" housekeeping_s: u16 = 5, [1.0, 3600.0];
    /// APID of housekeeping, a multiple of 16. The other APIDs have fixed distances from it.
    @302 "line.apid_base" apid_base: u16 = 256, [16.0, 1792.0];
    /// A telecommand is taken if its sequence count is 1 to this number above that of the last one; 0: any count.
    // At most half of the 16 384 counts, so that a replay of one of the last 8191 telecommands is refused.
    @303 "line.sequence_window" sequence_window: u16 = 0, [0.0, 8192.0];
    /// The mode after the start: 0 standby, 1 flight.
    @304 "boot.mode" boot_mode: u16 = 0, [0.0, 1.0];
    /// Time from lift-off to shut-down, s; NaN: no such shut-down.
    @305 "boot.shut_down_after_s" shut_down_after_s: Option<f64> = None, [1.0, 1e6];
    /// Most bits of the packets of pictures in a second; NaN: no limit. The packets of a picture are sent whole or not
    /// at all.
    // At most 1e9, because the bit budget multiplies it by up to an hour in microseconds, in 64 bits.
    @306 "telemetry.science_bits_s" science_bits_s: Option<f64> = None, [1.0, 1e9];
    /// Whether six resets by the watchdog in a row lead to safe mode: 0 never, 1 before lift-off, 2 always.
    @307 "boot.safe_after_resets" safe_after_resets: u16 = 1, [0.0, 2.0];
    /// Whether the integrity packets of pictures are sent: 0 no, 1 yes.
    // A switch, because they are 15 % of the bytes of a clean picture, and some lines have no room for them.
    @308 "telemetry.integrity" integrity: u16 = 1, [0.0, 1.0];
}

impl Operations {
    /// Returns the first parameter that is out of its limits, with its value.
    pub fn check(&self) -> Option<(u16, f64)> {
        let out_of_limits = |&id: &u16| {
            let (value, (low, high)) = (self.get(id)?, Self::limits(id)?);
            // NaN is the value of an optional parameter that is not set.
            let is_good = value.is_nan() || value >= low && value <= high;
            (!is_good).then_some((id, value))
        };
        // Limits cannot say that a number is a multiple of 16, so the base has a check of its own.
        let base = f64::from(self.apid_base);
        let base = ApidBase::try_new(self.apid_base).is_none().then_some((Self::APID_BASE, base));
        Self::NUMBERS.iter().find_map(out_of_limits).or(base)
    }

    /// Returns the APIDs of this computer.
    pub fn base(&self) -> ApidBase {
        // `check` refused other numbers before. The default, because a flight computer may not panic.
        ApidBase::try_new(self.apid_base).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_hold_and_the_defaults_are_within_them() {
        assert_eq!(Operations::default().check(), None);
        assert_eq!(Operations::default().base(), ApidBase::DEFAULT);
        for &id in Operations::NUMBERS {
            let (low, high) = Operations::limits(id).unwrap();
            for value in [low - 1.0, high + 1.0] {
                let mut operations = Operations::default();
                // A type refuses what it cannot hold, and `check` refuses the rest.
                let accepted = operations.set(id, value).unwrap();
                assert!(!accepted || operations.check() == Some((id, value)), "{id} {value}");
            }
        }
        let odd = Operations { apid_base: 0x101, ..Operations::default() };
        assert_eq!(odd.check(), Some((302, 257.0)));
    }
}
