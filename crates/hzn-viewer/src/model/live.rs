//! What the window knows of a flight computer whose telemetry comes over a line. Its memory is bounded, however long
//! the line is open.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use hzn_core::frames::{Cam, Cov3};
use hzn_core::status::Status;
use hzn_flight::assembly::Assembled;
use hzn_flight::messages::Housekeeping;
use hzn_ground::{SILENT_AFTER, Seen, alarms};
use hzn_mcap::LogLevel;
use hzn_run::terminal::one_line;

/// Most answers that are kept: an hour at ten pictures a second.
pub const ANSWERS: usize = 36_000;
/// Most messages that are kept.
const MESSAGES: usize = 500;
/// Most characters of a message that are kept. An edge that a telecommand has read has thousands.
const MESSAGE_LENGTH: usize = 400;
/// Most telecommands that are kept.
const SENT: usize = 50;
/// Time over which the loss of packets is counted.
const LOSS_WINDOW: Duration = Duration::from_secs(60);

/// One answer, as the plots show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Time of the exposure on the clock of the flight computer, s.
    pub time_s: f64,
    /// Angle from the optical axis to the axis of the body, degrees; NaN without an answer.
    pub nadir_deg: f32,
    /// Larger 1-sigma of the direction, degrees; NaN without an answer.
    pub sigma_deg: f32,
    /// Altitude of the free fit, km; NaN if it is unknown.
    pub altitude_km: f32,
    /// Status of the picture; `None` if its number has no meaning.
    pub status: Option<Status>,
}

impl Point {
    fn of(picture: &Assembled) -> Self {
        let direction = picture.answer.direction.as_ref();
        let nadir_deg = direction.map(|d| f64::from(d.axis[2]).clamp(-1.0, 1.0).acos().to_degrees());
        let sigma = |cov: [f32; 6]| Cov3::<Cam, f64>::from_upper(cov.map(f64::from)).sigma_max_rad().to_degrees();
        Self {
            time_s: picture.exposure.exposure_us as f64 * 1e-6,
            nadir_deg: nadir_deg.map_or(f32::NAN, |x| x as f32),
            sigma_deg: direction.map_or(f32::NAN, |d| sigma(d.cov) as f32),
            altitude_km: direction.map_or(f32::NAN, |d| d.altitude_est_m * 1e-3),
            status: Status::ALL.get(usize::from(picture.answer.status)).copied(),
        }
    }
}

/// A telecommand of the window.
#[derive(Debug, Clone, PartialEq)]
pub struct Sent {
    /// The words.
    pub text: String,
    /// What became of it.
    pub state: SentState,
}

/// What became of a telecommand.
#[derive(Debug, Clone, PartialEq)]
pub enum SentState {
    /// Its acknowledgement has not come.
    Waits,
    /// It was carried out.
    Done(String),
    /// It was refused, here or by the flight computer, or no acknowledgement came.
    Failed(String),
}

/// Counts of the packets.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Packets that came.
    pub packets: u64,
    /// Packets that were lost on the way.
    pub lost: u64,
    /// Broken packets.
    pub broken: u64,
    /// Answers to pictures.
    pub answers: u64,
}

/// The counts at a time, for the loss of the last minute.
#[derive(Debug, Clone, Copy)]
struct CountsAt {
    at: Instant,
    counts: Counts,
}

/// The state of a line.
#[derive(Debug, Default)]
pub struct Live {
    /// The other end is connected.
    pub is_connected: bool,
    /// The line has ended for good, for this reason.
    pub ended: Option<String>,
    /// Answers, the oldest first.
    pub points: VecDeque<Point>,
    /// The last answer.
    pub last: Option<Box<Assembled>>,
    /// The last state of the flight computer.
    pub housekeeping: Option<Box<Housekeeping>>,
    /// Messages, the oldest first.
    pub messages: VecDeque<(LogLevel, String)>,
    /// Telecommands, the oldest first.
    pub sent: VecDeque<Sent>,
    counts: Counts,
    /// The counts of about the last minute, one a second.
    earlier: VecDeque<CountsAt>,
    heard: Option<Instant>,
    answered: Option<Instant>,
    /// Number of times that the clock of the flight computer has begun again.
    pub restarts: u32,
}

impl Live {
    /// Takes the counts of the line at a time.
    pub fn take_counts(&mut self, counts: Counts, now: Instant) {
        if counts.packets > self.counts.packets {
            self.heard = Some(now);
        }
        self.counts = counts;
        if self.earlier.back().is_none_or(|last| now.duration_since(last.at) >= Duration::from_secs(1)) {
            self.earlier.push_back(CountsAt { at: now, counts });
        }
        while self.earlier.front().is_some_and(|first| now.duration_since(first.at) > LOSS_WINDOW) {
            self.earlier.pop_front();
        }
    }

    /// Takes what was seen in the packets.
    pub fn take(&mut self, seen: Vec<Seen>, now: Instant) {
        for seen in seen {
            match seen {
                Seen::Answer(picture) => self.take_answer(picture, now),
                Seen::Housekeeping(record) => self.housekeeping = Some(record),
                Seen::Acknowledge(_) => {}
                Seen::Value(text) => self.tell(LogLevel::Info, &text),
                Seen::Note(level, text) => self.tell(level, &text),
            }
        }
    }

    fn take_answer(&mut self, picture: Box<Assembled>, now: Instant) {
        let point = Point::of(&picture);
        // The clock of the flight computer begins again after a reset.
        if self.points.back().is_some_and(|last| last.time_s > point.time_s) {
            self.points.clear();
            self.restarts += 1;
        }
        self.points.push_back(point);
        if self.points.len() > ANSWERS {
            self.points.pop_front();
        }
        self.answered = Some(now);
        self.last = Some(picture);
    }

    /// Keeps a message.
    pub fn tell(&mut self, level: LogLevel, text: &str) {
        let mut text = one_line(text);
        if let Some((end, _)) = text.char_indices().nth(MESSAGE_LENGTH) {
            text.truncate(end);
            text.push('…');
        }
        self.messages.push_back((level, text));
        if self.messages.len() > MESSAGES {
            self.messages.pop_front();
        }
    }

    /// Keeps a telecommand that waits for its acknowledgement.
    pub fn send(&mut self, text: &str) {
        self.sent.push_back(Sent { text: one_line(text), state: SentState::Waits });
        if self.sent.len() > SENT {
            self.sent.pop_front();
        }
    }

    /// Takes what became of the telecommand that waits longest.
    pub fn answer_first(&mut self, state: SentState) {
        if let Some(sent) = self.sent.iter_mut().find(|sent| sent.state == SentState::Waits) {
            sent.state = state;
        }
    }

    /// Takes the refusal of the telecommand that was typed last.
    pub fn refuse_last(&mut self, why: String) {
        if let Some(sent) = self.sent.back_mut() {
            sent.state = SentState::Failed(why);
        }
    }

    /// Returns the counts.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the part of the packets of the last minute that was lost, 0 to 1; `None` if none came.
    pub fn loss(&self) -> Option<f64> {
        let first = self.earlier.front()?.counts;
        // The counts begin again when a line is opened again.
        let lost = self.counts.lost.saturating_sub(first.lost) as f64;
        let came = self.counts.packets.saturating_sub(first.packets) as f64;
        (lost + came > 0.0).then(|| lost / (lost + came))
    }

    /// Returns the time since the last packet.
    pub fn age(&self, now: Instant) -> Option<Duration> {
        Some(now.saturating_duration_since(self.heard?))
    }

    /// Returns the time since the last answer.
    pub fn age_of_answer(&self, now: Instant) -> Option<Duration> {
        Some(now.saturating_duration_since(self.answered?))
    }

    /// Returns what an operator should look at, the most urgent first.
    pub fn alarms(&self, now: Instant) -> Vec<String> {
        let mut all: Vec<String> = self.ended.iter().map(|why| format!("the line has ended: {why}")).collect();
        if let Some(age) = self.age(now).filter(|age| *age >= SILENT_AFTER) {
            all.push(format!("no packet for {} s", age.as_secs()));
        }
        all.extend(self.housekeeping.as_deref().map(alarms).unwrap_or_default());
        all
    }

    /// Returns the sequence count of the last telecommand that the flight computer has taken, if it has told.
    pub fn last_sequence(&self) -> Option<u16> {
        self.housekeeping.as_ref().map(|h| h.last_sequence).filter(|&n| n != u16::MAX)
    }
}

#[cfg(test)]
mod tests {
    use hzn_flight::answer::{Direction, Outcome, PictureAnswer};
    use hzn_flight::messages::Exposure;

    use super::*;

    fn picture(n: u32) -> Seen {
        let exposure = Exposure { picture: n, exposure_us: u64::from(n) * 100_000, ..Exposure::default() };
        let direction = Direction { axis: [0.0, 0.6, 0.8], cov: [4e-6, 0.0, 0.0, 1e-6, 0.0, 0.0], ..Direction::NONE };
        let outcome = Outcome { status: Status::Ok as u8, ..Outcome::default() };
        let answer = PictureAnswer {
            outcome,
            direction: Some(direction),
            position: None,
            integrity: None,
            edges: Default::default(),
        };
        Seen::Answer(Box::new(Assembled { exposure, answer, navigation: None, attitude: None, missing_candidates: 0 }))
    }

    #[test]
    fn a_day_takes_no_more_memory_than_an_hour() {
        let (mut live, now) = (Live::default(), Instant::now());
        for n in 0..100_000 {
            live.take(vec![picture(n), Seen::Note(LogLevel::Info, "x".repeat(2 * MESSAGE_LENGTH))], now);
            live.send("ping");
            let at = now + Duration::from_millis(u64::from(n) * 100);
            live.take_counts(Counts { packets: n.into(), ..Counts::default() }, at);
        }
        assert_eq!((live.points.len(), live.messages.len(), live.sent.len()), (ANSWERS, MESSAGES, SENT));
        assert!(live.points.capacity() <= 2 * ANSWERS && live.earlier.len() <= 62);
        assert!(live.messages.iter().all(|(_, text)| text.chars().count() <= MESSAGE_LENGTH + 1));
        let first = live.points[0];
        assert!((first.time_s - (100_000 - ANSWERS) as f64 * 0.1).abs() < 1e-6);
        assert!((first.nadir_deg - 36.8699).abs() < 1e-3 && (first.sigma_deg - 0.114_59).abs() < 1e-4);
        assert!(first.altitude_km.is_nan() && first.status == Some(Status::Ok));
    }

    #[test]
    fn a_restart_of_the_computer_begins_the_plots_again() {
        let mut live = Live::default();
        live.take((10..20).map(picture).collect(), Instant::now());
        live.take(vec![picture(3)], Instant::now());
        assert_eq!((live.points.len(), live.restarts), (1, 1));
    }

    #[test]
    fn the_loss_is_that_of_the_last_minute() {
        let (mut live, begin) = (Live::default(), Instant::now());
        assert_eq!((live.loss(), live.age(begin)), (None, None));
        for s in 0..200u64 {
            // Every second packet is lost until 100 s, and none after that.
            let counts =
                Counts { packets: s.min(100) + 2 * s.saturating_sub(100), lost: s.min(100), ..Counts::default() };
            live.take_counts(counts, begin + Duration::from_secs(s));
            match s {
                90 => assert_eq!(live.loss(), Some(0.5)),
                199 => assert_eq!(live.loss(), Some(0.0)),
                _ => {}
            }
        }
        let later = begin + Duration::from_secs(199 + 12);
        assert_eq!(live.age(later), Some(Duration::from_secs(12)));
        assert_eq!(live.alarms(later), ["no packet for 12 s"]);
        assert!(live.alarms(begin + Duration::from_secs(200)).is_empty());
    }
}
