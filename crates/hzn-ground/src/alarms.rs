//! What an operator should look at.

use std::time::Duration;

use hzn_flight::messages::Housekeeping;

/// A flight computer that sends nothing for so long is silent. It sends its housekeeping every second unless a
/// parameter says otherwise.
pub const SILENT_AFTER: Duration = Duration::from_secs(10);

/// Returns the alarms of a state of the flight computer, in words.
///
/// ```
/// use hzn_flight::messages::Housekeeping;
///
/// let silent = Housekeeping { flags: 8, ..Housekeeping::default() };
/// assert_eq!(hzn_ground::alarms(&silent), ["the camera is silent"]);
/// ```
pub fn alarms(h: &Housekeeping) -> Vec<String> {
    let bit = |byte: u8, bit: u8, text: &str| (byte & bit != 0).then(|| text.to_owned());
    let repairs = (h.repairs > 0).then(|| format!("{} memory errors repaired", h.repairs));
    let withheld = (h.withheld > 0).then(|| format!("{} messages withheld", h.withheld));
    let all = [
        bit(h.self_check, 1, "camera failed its check"),
        bit(h.self_check, 2, "memory failed its check"),
        bit(h.self_check, 4, "parameters failed their check"),
        bit(h.flags, 1, "parameters in use are not stored"),
        bit(h.flags, 2, "shut-down is armed"),
        bit(h.flags, 8, "the camera is silent"),
        bit(h.flags, 16, "parameters wait for their commit"),
        repairs,
        withheld,
    ];
    all.into_iter().flatten().collect()
}
