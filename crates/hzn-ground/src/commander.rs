//! Commands on their way to the flight computer, each with its acknowledgement.

use std::collections::VecDeque;
use std::fmt;
use std::time::{Duration, Instant};

use hzn_flight::messages::{Acknowledge, Code, Function};
use hzn_flight::packet::ApidBase;
use hzn_flight::parameters::Parameters;
use hzn_fly::key_file::Signer;
use hzn_fly::tell::Tell;

use crate::encode::{encode, write_packet};
use crate::error::Error;
use crate::outcome;

/// Longest wait for an acknowledgement. A flight computer carries out a command at the latest 1.1 s after its end.
const LONGEST: Duration = Duration::from_secs(3);

/// The commands that were not acknowledged yet. Only one packet is on its way at a time.
pub struct Commander {
    tell: Tell,
    base: ApidBase,
    signer: Option<Signer>,
    /// Whether a refusal for the counter has led to a larger one.
    has_skipped: bool,
    sequence: u16,
    has_sent: bool,
    /// Whether a packet was acknowledged, or refused for its sequence count.
    knows_sequence: bool,
    waiting: VecDeque<Pending>,
}

/// A packet of a command.
struct Pending {
    text: String,
    user: Vec<u8>,
    sent: Option<Sent>,
    is_last: bool,
}

#[derive(Clone, Copy)]
struct Sent {
    sequence: u16,
    at: Instant,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq)]
pub struct Answered {
    text: String,
    /// The acknowledgement; `None` if none came.
    acknowledge: Option<Acknowledge>,
    after: Duration,
}

impl Answered {
    /// Returns whether the command was carried out.
    pub fn is_done(&self) -> bool {
        self.acknowledge.is_some_and(|a| a.code == Code::Done as u8)
    }
}

impl fmt::Display for Answered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { text, acknowledge, after } = self;
        match acknowledge {
            Some(a) => write!(f, "{text}: {} ({} ms)", outcome::describe(a), after.as_millis()),
            None => write!(f, "{text}: no acknowledgement within {} s", LONGEST.as_secs()),
        }
    }
}

impl Commander {
    /// Makes a commander; `sequence` is the sequence count of its first packet.
    ///
    /// # Errors
    /// A command is refused, see [`encode`].
    pub fn new(base: ApidBase, sequence: u16, commands: &[String], tell: Tell) -> Result<Self, Error> {
        let mut new = Self {
            tell,
            base,
            signer: None,
            has_skipped: false,
            sequence,
            has_sent: false,
            knows_sequence: false,
            waiting: VecDeque::new(),
        };
        commands.iter().try_for_each(|text| new.add(text))?;
        Ok(new)
    }

    /// Makes the packets from now on have the trailer of a key.
    #[must_use]
    pub fn signed_by(self, signer: Option<Signer>) -> Self {
        Self { signer, ..self }
    }

    /// Returns the APIDs of the flight computer.
    pub fn base(&self) -> ApidBase {
        self.base
    }

    /// Adds a command.
    ///
    /// # Errors
    /// The command is refused, see [`encode`].
    pub fn add(&mut self, text: &str) -> Result<(), Error> {
        let packets = encode(text, &self.tell)?;
        let count = packets.len();
        for (place, user) in (1..).zip(packets) {
            self.waiting.push_back(Pending { text: text.to_owned(), user, sent: None, is_last: place == count });
        }
        Ok(())
    }

    /// Makes the first packet have the sequence count after this one. Later packets count on.
    pub fn continue_after(&mut self, sequence: u16) {
        if !self.has_sent {
            self.sequence = (sequence + 1) & 0x3FFF;
        }
    }

    /// Returns whether every command was answered.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Returns the packet to send now, if there is one.
    ///
    /// # Errors
    /// A packet is too long, or the counter of the key cannot be kept.
    pub fn next(&mut self, now: Instant) -> Result<Option<Vec<u8>>, Error> {
        let Some(first) = self.waiting.front_mut().filter(|first| first.sent.is_none()) else { return Ok(None) };
        let sealed = match &mut self.signer {
            Some(signer) => &signer.seal(self.base, self.sequence, &first.user).map_err(Error::unusable)?,
            None => &first.user,
        };
        let bytes = write_packet(self.base, self.sequence, &first.text, sealed)?;
        first.sent = Some(Sent { sequence: self.sequence, at: now });
        self.sequence = (self.sequence + 1) & 0x3FFF;
        self.has_sent = true;
        Ok(Some(bytes))
    }

    /// Takes an acknowledgement. Returns what became of a command, if this decides it. Other acknowledgements belong to
    /// the commands of somebody else.
    pub fn take(&mut self, a: &Acknowledge, now: Instant) -> Option<Answered> {
        let first = self.waiting.front_mut()?;
        let sent = first.sent.filter(|sent| sent.sequence == a.sequence && first.user.first() == Some(&a.function))?;
        // The first packet begins anywhere in the count. If the computer expects another place, its refusal says which.
        // Later packets follow one that was taken, so that their refusal has another cause: a second ground station.
        if a.code == Code::Sequence as u8 && !self.knows_sequence {
            (first.sent, self.sequence, self.knows_sequence) = (None, (a.detail + 1) & 0x3FFF, true);
            return None;
        }
        // After a reset the computer refuses the counters that it had reserved. None of its own is above these.
        if a.code == Code::Replay as u8
            && !self.has_skipped
            && let Some(signer) = &mut self.signer
            && signer.skip_reserved().is_ok()
        {
            (first.sent, self.has_skipped) = (None, true);
            return None;
        }
        self.knows_sequence = true;
        let (is_last, is_done) = (first.is_last, a.code == Code::Done as u8);
        if let Some(base) = set_base(&first.user).filter(|_| is_done) {
            self.base = base;
            (self.tell)(&format!("note: the computer listens to --apid-base {:#x} from now on", base.number()));
        }
        if is_done && !is_last {
            self.waiting.pop_front();
            return None;
        }
        Some(self.end_first(Some(*a), now - sent.at))
    }

    /// Returns the command whose acknowledgement did not come.
    pub fn expired(&mut self, now: Instant) -> Option<Answered> {
        let sent = self.waiting.front()?.sent?;
        (now - sent.at > LONGEST).then(|| self.end_first(None, now - sent.at))
    }

    /// Removes the first command with all of its packets.
    fn end_first(&mut self, acknowledge: Option<Acknowledge>, after: Duration) -> Answered {
        let mut text = String::new();
        while let Some(packet) = self.waiting.pop_front() {
            text = packet.text;
            if packet.is_last {
                break;
            }
        }
        Answered { text, acknowledge, after }
    }
}

/// Returns the APID base that a telecommand sets; `None` if it sets none.
fn set_base(user: &[u8]) -> Option<ApidBase> {
    let (function, values) = user.split_first()?;
    let sets = [Function::SetParameters, Function::TryParameters].map(|function| function as u8);
    let wanted = Parameters::number_of("line.apid_base")?.to_be_bytes();
    let entries = values.get(1..).filter(|_| sets.contains(function))?;
    let entry = entries.chunks_exact(10).rfind(|entry| entry.starts_with(&wanted))?;
    let value = f64::from_be_bytes(entry.get(2..)?.try_into().ok()?);
    ApidBase::try_new(value as u16).filter(|base| f64::from(base.number()) == value)
}

#[cfg(test)]
mod tests {
    use hzn_flight::packet::{self, Scan};

    use super::*;

    fn silent() -> Tell {
        std::sync::Arc::new(|_| ())
    }

    fn ack(function: Function, sequence: u16, code: u8) -> Acknowledge {
        Acknowledge { function: function as u8, sequence, code, ..Acknowledge::default() }
    }

    #[test]
    fn each_command_waits_for_the_one_before() {
        let texts = ["ping", "mode flight"].map(str::to_owned);
        let mut commander = Commander::new(ApidBase::DEFAULT, 16383, &texts, silent()).unwrap();
        let start = Instant::now();
        let ms = |n| start + Duration::from_millis(n);
        let bytes = commander.next(ms(0)).unwrap().unwrap();
        let Scan::Packet { packet, .. } = packet::scan(&bytes) else { panic!() };
        assert_eq!((packet.sequence, packet.user), (16383, &[Function::Ping as u8][..]));
        assert_eq!(commander.next(ms(1)).unwrap(), None);
        // Acknowledgements of others decide nothing.
        assert_eq!(commander.take(&ack(Function::Report, 16383, 0), ms(2)), None);
        assert_eq!(commander.take(&ack(Function::Ping, 5, 0), ms(2)), None);
        let ping = commander.take(&ack(Function::Ping, 16383, 0), ms(7)).unwrap();
        assert_eq!((ping.to_string().as_str(), ping.is_done()), ("ping: done (7 ms)", true));
        // The count begins again after 16383.
        assert!(commander.next(ms(8)).unwrap().is_some());
        assert_eq!(commander.expired(ms(3000)), None);
        let mode = commander.expired(ms(3009)).unwrap();
        assert_eq!((mode.to_string().as_str(), mode.is_done()), ("mode flight: no acknowledgement within 3 s", false));
        assert!(commander.is_idle() && commander.add("mode fly").is_err());
    }

    #[test]
    fn commands_after_another_base_go_to_that_base() {
        let texts = ["set line.apid_base 288 boot.mode 1", "ping"].map(str::to_owned);
        let mut commander = Commander::new(ApidBase::DEFAULT, 0, &texts, silent()).unwrap();
        let now = Instant::now();
        let apid = |bytes: &[u8]| match packet::scan(bytes) {
            Scan::Packet { packet, .. } => packet.apid,
            _ => panic!(),
        };
        assert_eq!(apid(&commander.next(now).unwrap().unwrap()), 0x1C0);
        assert!(commander.take(&ack(Function::SetParameters, 0, 0), now).unwrap().is_done());
        assert_eq!((commander.base().number(), apid(&commander.next(now).unwrap().unwrap())), (0x120, 0x1E0));
    }

    #[test]
    fn a_refusal_says_what_was_refused() {
        let texts = ["set consensus.threshold_px 900".to_owned()];
        let mut commander = Commander::new(ApidBase::DEFAULT, 0, &texts, silent()).unwrap();
        let now = Instant::now();
        commander.next(now).unwrap().unwrap();
        let refused = Acknowledge { detail: 81, ..ack(Function::SetParameters, 0, Code::Refused as u8) };
        let answer = commander.take(&refused, now).unwrap().to_string();
        assert!(
            answer.ends_with(": value refused; nothing changed: parameter 81 consensus.threshold_px (0 ms)"),
            "{answer}"
        );
    }

    #[test]
    fn a_sequence_window_does_not_lock_the_ground_out() {
        let mut commander = Commander::new(ApidBase::DEFAULT, 0, &["ping".into(), "ping".into()], silent()).unwrap();
        let now = Instant::now();
        let sequence = |commander: &mut Commander| {
            let bytes = commander.next(now).unwrap().unwrap();
            let Scan::Packet { packet, .. } = packet::scan(&bytes) else { panic!() };
            packet.sequence
        };
        let outside = |sequence| Acknowledge { detail: 16383, ..ack(Function::Ping, sequence, Code::Sequence as u8) };
        assert_eq!(sequence(&mut commander), 0);
        assert_eq!(commander.take(&outside(0), now), None);
        // The last count was 16383, so that 0 is the next one.
        assert_eq!(sequence(&mut commander), 0);
        assert!(commander.take(&ack(Function::Ping, 0, 0), now).unwrap().is_done());
        assert_eq!(sequence(&mut commander), 1);
        // A second refusal is told: somebody else sends, too.
        let told = commander.take(&outside(1), now).unwrap();
        assert!(!told.is_done() && told.to_string().contains("the last one taken has 16383"), "{told}");
    }

    #[test]
    fn a_load_is_one_command() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("sensor.toml");
        let lens = "model = \"pinhole\"\nfx_px = 600.0\nfy_px = 600.0\ncx_px = 319.5\ncy_px = 239.5";
        let camera = format!("[camera]\nwidth = 640\nheight = 480\n{lens}\n[body]\naltitude_km = 230.0\n");
        // A mask of four polygons with eight corners needs several packets.
        let corner = |i: usize, k: usize| {
            let (sin, cos) = (k as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
            format!("[{:.3}, {:.3}]", 100.0 * i as f64 + 30.0 * cos, 60.0 + 30.0 * sin)
        };
        let polygon = |i: usize| format!("[{}]", (0..8).map(|k| corner(i, k)).collect::<Vec<_>>().join(", "));
        let mask = (1..5).map(polygon).collect::<Vec<_>>().join(", ");
        std::fs::write(&path, format!("{camera}[mask]\npolygons_px = [{mask}]\n")).unwrap();
        let text = format!("load {}", path.display());
        let staged = std::cell::Cell::new(0);
        let load = |code: u8, at: u16| {
            let mut commander = Commander::new(ApidBase::DEFAULT, 0, &[text.clone(), "ping".into()], silent()).unwrap();
            let now = Instant::now();
            for sequence in 0.. {
                let bytes = commander.next(now).unwrap().unwrap();
                let Scan::Packet { packet, .. } = packet::scan(&bytes) else { panic!() };
                let function = Function::from_number(packet.user[0]).unwrap();
                if function == Function::StageParameters {
                    // The parameters of the flight software, from 300 to 399, are not part of a sensor.toml.
                    let ids = packet.user[2..].chunks(10).map(|p| u16::from_be_bytes([p[0], p[1]]));
                    assert!(
                        ids.clone().count() == usize::from(packet.user[1])
                            && !ids.clone().any(|id| (300..400).contains(&id))
                    );
                    staged.set(staged.get() + ids.count());
                }
                let code = if sequence == at { code } else { 0 };
                if let Some(answer) = commander.take(&ack(function, sequence, code), now) {
                    assert!(!commander.is_idle());
                    return (function, answer.is_done());
                }
            }
            unreachable!()
        };
        assert_eq!(load(0, 0), (Function::CommitParameters, true));
        assert!(staged.get() > 4 * 8 * 2, "the mask is loaded, too: {}", staged.get());
        // What follows a refused packet is not sent.
        assert_eq!(load(6, 1), (Function::StageParameters, false));
    }
}
