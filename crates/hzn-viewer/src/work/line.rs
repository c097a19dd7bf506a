//! The line to a flight computer: a thread reads its packets and sends telecommands, with the code of the ground
//! station.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use crossbeam_channel::{Receiver, Sender, bounded};
use hzn_flight::authentication::TRAILER_BYTES;
use hzn_flight::packet::ApidBase;
use hzn_fly::key_file::Signer;
use hzn_fly::link::{Address, Patience};
use hzn_fly::tell::Tell;
use hzn_ground::{Came, Commander, Incoming, Station, encode, write_packet};
use hzn_mcap::LogLevel;

use super::Wake;
use crate::model::live::{Counts, Live, SentState};

/// Telecommands that wait for the thread.
const WAITING: usize = 16;

/// The computer at the other end of a line.
#[derive(Debug, Clone, Default)]
pub struct Computer {
    /// Its APIDs.
    pub base: ApidBase,
    /// The file with the key of its telecommands; without it they have no trailer.
    pub key: Option<PathBuf>,
}

/// A line that is open. It is closed when the handle is dropped.
pub struct Line {
    name: String,
    computer: Computer,
    live: Arc<Mutex<Live>>,
    commands: Sender<String>,
    stop: Arc<AtomicBool>,
}

impl Line {
    /// Opens a line to a computer. The other end of `tcp` may come later; a port or a device must be there.
    ///
    /// # Errors
    /// The text is no address, the port is in use, the device does not exist, or the key cannot be read.
    pub fn open(address: &str, computer: &Computer, wake: Wake) -> Result<Self, String> {
        let address: Address = address.parse()?;
        // Before the line is opened, so that a wrong file does not take the port.
        let signer = computer.key.as_deref().map(Signer::open).transpose().map_err(|e| e.to_string())?;
        let incoming = Incoming::open(&address, Patience::Waits).map_err(|e| e.to_string())?;
        let (commands, typed) = bounded(WAITING);
        let line = Self {
            name: incoming.name().to_owned(),
            computer: computer.clone(),
            live: Arc::default(),
            commands,
            stop: Arc::default(),
        };
        let thread = Thread {
            incoming,
            typed,
            live: Arc::clone(&line.live),
            stop: Arc::clone(&line.stop),
            wake,
            commander: commander(computer.base)?.signed_by(signer),
            station: Station::quiet(computer.base),
        };
        let begun = std::thread::Builder::new().name("line".into()).spawn(move || thread.run());
        begun.map_err(|e| format!("{}: {e}", line.name))?;
        Ok(line)
    }

    /// Returns the name of the line.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns what is known. The thread waits while somebody holds it.
    pub fn live(&self) -> MutexGuard<'_, Live> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the packets of a telecommand as text, with a sequence count of 0 and without the trailer of a key.
    ///
    /// # Errors
    /// The text is no telecommand, or a value of it is refused.
    pub fn preview(&self, text: &str) -> Result<String, String> {
        let shown = preview(self.computer.base, text)?;
        let trailer = self.computer.key.as_ref().map(|_| format!(" + a trailer of {TRAILER_BYTES}"));
        Ok(shown + &trailer.unwrap_or_default())
    }

    /// Sends a telecommand. The list of telecommands says what becomes of it.
    pub fn send(&self, text: &str) {
        let mut live = self.live();
        live.send(text);
        if let Err(why) = self.preview(text) {
            live.refuse_last(why);
        } else if self.commands.try_send(text.to_owned()).is_err() {
            live.refuse_last("too many telecommands wait".to_owned());
        }
    }
}

impl Drop for Line {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn commander(base: ApidBase) -> Result<Commander, String> {
    Commander::new(base, 0, &[], Arc::new(|_| ())).map_err(|e| e.to_string())
}

fn preview(base: ApidBase, text: &str) -> Result<String, String> {
    let silent: Tell = Arc::new(|_| ());
    let packets = encode(text, &silent).map_err(|e| e.to_string())?;
    let first = packets.first().map_or(&[][..], |user| user.as_slice());
    let bytes = write_packet(base, 0, text, first).map_err(|e| e.to_string())?;
    let hex: Vec<String> = bytes.iter().take(40).map(|b| format!("{b:02x}")).collect();
    let more = if bytes.len() > hex.len() { " …" } else { "" };
    let count = match packets.len() {
        1 => "1 packet".to_owned(),
        n => format!("{n} packets, the first"),
    };
    Ok(format!("{count} of {} bytes: {}{more}", bytes.len(), hex.join(" ")))
}

struct Thread {
    incoming: Incoming,
    typed: Receiver<String>,
    live: Arc<Mutex<Live>>,
    stop: Arc<AtomicBool>,
    wake: Wake,
    commander: Commander,
    station: Station,
}

impl Thread {
    fn run(mut self) {
        let mut rest = Vec::new();
        while !self.stop.load(Ordering::Relaxed) {
            let ended = match self.turn(&mut rest) {
                Ok(true) => continue,
                Ok(false) => "the other end has closed it".to_owned(),
                Err(e) => e.to_string(),
            };
            self.live.lock().unwrap_or_else(PoisonError::into_inner).ended = Some(ended);
            return (self.wake)();
        }
    }

    /// Takes what has come, and sends what was typed. Returns false if the line has ended.
    fn turn(&mut self, rest: &mut Vec<u8>) -> Result<bool, hzn_ground::Error> {
        let came = self.incoming.wait(rest);
        if came == Came::Bytes {
            self.station.take(rest)?;
        }
        let seen = self.station.take_seen();
        let answered = self.incoming.command_next(&mut self.commander, &seen)?;
        self.station.follow(self.commander.base());
        let notices = self.incoming.take_notices();
        let is_news = came == Came::Bytes || !answered.is_empty() || !notices.is_empty();
        let (counts, now) = (self.station.counts(), Instant::now());
        let counts = Counts { packets: counts.packets, lost: counts.lost, broken: counts.cut, answers: counts.answers };
        let mut live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
        let was_connected = std::mem::replace(&mut live.is_connected, self.incoming.is_connected());
        live.take(seen, now);
        live.take_counts(counts, now);
        for notice in notices {
            live.tell(LogLevel::Warning, &notice);
        }
        for answered in answered {
            let state = if answered.is_done() { SentState::Done } else { SentState::Failed };
            live.answer_first(state(answered.to_string()));
        }
        let last = live.last_sequence();
        let is_news = is_news || was_connected != live.is_connected;
        drop(live);
        for text in self.typed.try_iter() {
            if let Some(last) = last.filter(|_| self.commander.is_idle()) {
                self.commander.continue_after(last);
            }
            if let Err(error) = self.commander.add(&text) {
                let mut live = self.live.lock().unwrap_or_else(PoisonError::into_inner);
                live.answer_first(SentState::Failed(error.to_string()));
            }
        }
        if is_news {
            (self.wake)();
        }
        Ok(came != Came::End)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_telecommand_is_shown_as_it_is_sent() {
        let shown = preview(ApidBase::DEFAULT, "ping").unwrap();
        assert!(shown.starts_with("1 packet of ") && shown.contains("1a cf fc 1d"), "{shown}");
        let refused = preview(ApidBase::DEFAULT, "pign").unwrap_err();
        assert!(refused.contains("did you mean \"ping\"?"), "{refused}");
        assert!(preview(ApidBase::DEFAULT, "").is_err());
    }

    #[test]
    fn a_line_that_cannot_be_opened_says_why() {
        let error = |text: &str| Line::open(text, &Computer::default(), Arc::new(|| {})).err().unwrap();
        assert!(error("tcp:nowhere").contains("must be HOST:PORT"));
        assert!(error("udp:192.0.2.1:5000").contains("no such address"));
        let stranger = Computer { key: Some("no/such.key".into()), ..Computer::default() };
        let refused = Line::open("udp:127.0.0.1:0", &stranger, Arc::new(|| {})).err().unwrap();
        assert!(refused.contains("no/such.key"), "{refused}");
    }
}
