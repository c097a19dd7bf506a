//! The ground's end of the line: bytes that come, commands that go.

use std::io::{ErrorKind, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded, never, unbounded};
use hzn_fly::link::{Address, Link, Patience};
use hzn_fly::tell::Tell;

use crate::commander::{Answered, Commander};
use crate::error::Error;
use crate::station::Station;
use crate::stream::Seen;

/// Longest wait for bytes: commands and the disk are looked after this often.
const TICK: Duration = Duration::from_millis(50);

/// Bytes of a flight computer as they come.
pub struct Incoming {
    /// The line; `None` for standard input.
    link: Option<Link>,
    bytes: Receiver<Vec<u8>>,
    name: String,
    /// Messages about the line.
    notices: Receiver<String>,
}

/// What [`Incoming::wait`] found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Came {
    /// Bytes came.
    Bytes,
    /// No bytes came.
    Nothing,
    /// The bytes have ended.
    End,
}

impl Incoming {
    /// Opens a line. `patience` says whether the other end may come later.
    ///
    /// # Errors
    /// The line cannot be opened.
    pub fn open(address: &Address, patience: Patience) -> Result<Self, Error> {
        let (sender, notices) = unbounded();
        let tell = Arc::new(move |text: &str| drop(sender.send(text.to_owned())));
        let (link, bytes) = Link::open(address, patience, Arc::default(), tell).map_err(Error::failed)?;
        Ok(Self { link: Some(link), bytes, name: address.to_string(), notices })
    }

    /// Reads standard input.
    ///
    /// # Errors
    /// The thread that reads cannot be started.
    pub fn stdin() -> Result<Self, Error> {
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
    pub fn can_send(&self) -> bool {
        self.link.is_some()
    }
    /// Returns whether the other end is connected. Standard input always is.
    pub fn is_connected(&self) -> bool {
        self.link.as_ref().is_none_or(Link::is_connected)
    }

    /// Returns the name of the line.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Waits a short time for bytes and appends them.
    pub fn wait(&self, rest: &mut Vec<u8>) -> Came {
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

    /// Returns the messages about the line since the last call.
    pub fn take_notices(&self) -> Vec<String> {
        self.notices.try_iter().collect()
    }

    /// Sends the next command if its time has come. Returns what became of a command.
    ///
    /// # Errors
    /// A packet is too long.
    pub fn command_next(&self, commander: &mut Commander, seen: &[Seen]) -> Result<Vec<Answered>, Error> {
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

    /// Listens until the bytes end or `stop` is set. Returns the bytes after the last packet. `tell` gets what became
    /// of the commands, and messages about the line.
    ///
    /// # Errors
    /// An output cannot be written, or a packet is too long.
    pub fn listen(
        self,
        station: &mut Station,
        mut commander: Commander,
        stop: &AtomicBool,
        tell: &Tell,
    ) -> Result<Vec<u8>, Error> {
        let mut rest = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            match self.wait(&mut rest) {
                Came::Bytes => station.take(&mut rest)?,
                Came::Nothing => {}
                Came::End => break,
            }
            let seen = station.take_seen();
            self.command_next(&mut commander, &seen)?.iter().for_each(|answered| tell(&answered.to_string()));
            station.follow(commander.base());
            self.take_notices().iter().for_each(|notice| tell(notice));
            station.flush_if_due()?;
        }
        Ok(rest)
    }

    /// Sends commands and waits for their acknowledgements. Returns whether all were carried out. `tell` gets what
    /// became of each, the values that were read, and messages about the line.
    ///
    /// # Errors
    /// The line has ended, or nobody has connected.
    pub fn command(self, mut commander: Commander, tell: &Tell) -> Result<bool, Error> {
        let (mut rest, mut is_done) = (Vec::new(), true);
        let mut station = Station::quiet(commander.base());
        let start = Instant::now();
        while !commander.is_idle() {
            match self.wait(&mut rest) {
                Came::Bytes => station.take(&mut rest)?,
                Came::Nothing => {}
                Came::End => return Err(Error::failed(format!("{}: the line has ended", self.name))),
            }
            let seen = station.take_seen();
            for answered in self.command_next(&mut commander, &seen)? {
                is_done &= answered.is_done();
                tell(&answered.to_string());
            }
            station.follow(commander.base());
            self.take_notices().iter().for_each(|notice| tell(notice));
            // The values that a command has read.
            for seen in &seen {
                if let Seen::Value(text) = seen {
                    tell(text);
                }
            }
            if !self.link.as_ref().is_some_and(Link::is_connected) && start.elapsed() > PATIENCE {
                return Err(Error::failed(format!("{}: nobody has connected", self.name)));
            }
        }
        Ok(is_done)
    }
}

/// Longest wait for the other end of `tcp-listen`.
const PATIENCE: Duration = Duration::from_secs(10);
