//! The ground's end of the line: bytes that come, commands that go.

use std::io::{ErrorKind, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded, never, unbounded};
use hzn_fly::link::{Address, Link, Patience};

use super::commander::{Answered, Commander};
use super::station::Station;
use super::stream::Seen;
use crate::exit::{Exit, Outcome, Stop, failed};
use crate::tell;

/// Longest wait for bytes: commands and the disk are looked after this often.
const TICK: Duration = Duration::from_millis(50);

/// Bytes of a flight computer as they come.
pub(crate) struct Incoming {
    /// The line; `None` for standard input.
    link: Option<Link>,
    bytes: Receiver<Vec<u8>>,
    name: String,
    /// Messages about the line.
    pub(super) notices: Receiver<String>,
}

/// What [`Incoming::wait`] found.
pub(super) enum Came {
    Bytes,
    Nothing,
    End,
}

impl Incoming {
    /// Opens a line.
    pub(crate) fn open(address: &Address) -> Result<Self, Stop> {
        let (sender, notices) = unbounded();
        let tell = Arc::new(move |text: &str| drop(sender.send(text.to_owned())));
        let (link, bytes) = Link::open(address, Patience::Fails, Arc::default(), tell).map_err(failed)?;
        Ok(Self { link: Some(link), bytes, name: address.to_string(), notices })
    }

    /// Reads standard input.
    pub(crate) fn stdin() -> Result<Self, Stop> {
        let (sender, bytes) = bounded(64);
        std::thread::Builder::new().name("stdin".into()).spawn(move || {
            let mut piece = vec![0; 1 << 16];
            loop {
                match std::io::stdin().read(&mut piece) {
                    Err(e) if e.kind() == ErrorKind::Interrupted => {}
                    Ok(n) if n > 0 && sender.send(piece.get(..n).unwrap_or_default().to_vec()).is_ok() => {}
                    _ => return,
                }
            }
        })?;
        Ok(Self { link: None, bytes, name: "standard input".into(), notices: never() })
    }

    /// Returns whether commands can be sent.
    pub(crate) fn can_send(&self) -> bool {
        self.link.is_some()
    }
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Waits a short time for bytes and appends them.
    pub(super) fn wait(&self, rest: &mut Vec<u8>) -> Came {
        match self.bytes.recv_timeout(TICK) {
            Ok(piece) => {
                rest.extend(piece);
                self.bytes.try_iter().for_each(|piece| rest.extend(piece));
                Came::Bytes
            }
            Err(RecvTimeoutError::Timeout) => Came::Nothing,
            Err(RecvTimeoutError::Disconnected) => Came::End,
        }
    }

    /// Sends the next command if its time has come. Returns what became of a command.
    pub(super) fn command_next(&self, commander: &mut Commander, seen: &[Seen]) -> Result<Vec<Answered>, Stop> {
        let now = Instant::now();
        let acknowledged = seen.iter().filter_map(|seen| match seen {
            Seen::Acknowledge(a) => commander.take(a, now),
            _ => None,
        });
        let mut answered: Vec<Answered> = acknowledged.collect();
        answered.extend(commander.expired(now));
        if let Some(link) = self.link.as_ref().filter(|link| link.is_connected())
            && let Some(bytes) = commander.next(now)?
        {
            link.send(&bytes, None);
        }
        Ok(answered)
    }

    /// Listens until the bytes end or the user stops it. Returns the bytes after the last packet.
    pub(crate) fn listen(self, station: &mut Station, mut commander: Commander) -> Result<Vec<u8>, Stop> {
        let stop = stop_flag();
        let mut rest = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            match self.wait(&mut rest) {
                Came::Bytes => station.take(&mut rest)?,
                Came::Nothing => {}
                Came::End => break,
            }
            let seen = std::mem::take(&mut station.counts.seen);
            self.command_next(&mut commander, &seen)?.iter().for_each(tell::line);
            self.notices.try_iter().for_each(tell::line);
            station.flush_if_due()?;
        }
        Ok(rest)
    }

    /// Sends commands and waits for their acknowledgements.
    pub(crate) fn command(self, mut commander: Commander) -> Outcome {
        let (mut rest, mut is_done) = (Vec::new(), true);
        let mut station = Station::quiet(commander.base());
        let start = Instant::now();
        while !commander.is_idle() {
            match self.wait(&mut rest) {
                Came::Bytes => station.take(&mut rest)?,
                Came::Nothing => {}
                Came::End => return Err(failed(format!("{}: the line has ended", self.name))),
            }
            let seen = std::mem::take(&mut station.counts.seen);
            for answered in self.command_next(&mut commander, &seen)? {
                is_done &= answered.is_done();
                tell::line(&answered);
            }
            self.notices.try_iter().for_each(tell::line);
            // The values that a command has read.
            for note in &seen {
                if let Seen::Note(_, text) = note
                    && text.contains("  parameter ")
                {
                    tell::line(text);
                }
            }
            if !self.link.as_ref().is_some_and(Link::is_connected) && start.elapsed() > PATIENCE {
                return Err(failed(format!("{}: nobody has connected", self.name)));
            }
        }
        Ok(if is_done { Exit::Done } else { Exit::Failed })
    }
}

/// Longest wait for the other end of `tcp-listen`.
const PATIENCE: Duration = Duration::from_secs(10);

/// Returns a flag that Ctrl-C or a request to terminate sets.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let shared = Arc::clone(&flag);
    // Without a handler, Ctrl-C ends the program at once; the output can still be recovered.
    drop(ctrlc::set_handler(move || shared.store(true, Ordering::SeqCst)));
    flag
}
