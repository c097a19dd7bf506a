//! The packets on their way from bytes to files.

use std::path::Path;
use std::sync::Arc;

use hzn_flight::packet::{self, ApidBase, OVERHEAD, Scan};
use hzn_fly::tell::Tell;
use hzn_run::disk::Checked;
use hzn_run::sink::Existing;

use crate::error::Error;
use crate::outputs::{Sink, table};
use crate::stream::{Seen, StreamCounts};

/// What becomes of the packets.
pub struct Station {
    counts: StreamCounts,
    tell: Tell,
    sink: Option<Sink>,
    housekeeping: Option<csv::Writer<Checked>>,
}

impl Station {
    /// Makes a station with outputs for answers and housekeeping. `tell` gets events, acknowledgements and values as
    /// they come, and the counts at the end.
    ///
    /// # Errors
    /// An output exists and `force` is not set, or an output cannot be written.
    pub fn new(
        base: ApidBase,
        output: Option<&Path>,
        housekeeping: Option<&Path>,
        force: bool,
        tell: Tell,
    ) -> Result<Self, Error> {
        let existing = if force { Existing::Replace } else { Existing::Refuse };
        Ok(Self {
            sink: output.map(|path| Sink::create(path, existing)).transpose()?,
            housekeeping: housekeeping.map(|path| table(path, force)).transpose()?,
            counts: StreamCounts::new(base, Some(Arc::clone(&tell))),
            tell,
        })
    }

    /// Makes a station without outputs.
    pub fn quiet(base: ApidBase) -> Self {
        Self { counts: StreamCounts::new(base, None), tell: Arc::new(|_| ()), sink: None, housekeeping: None }
    }

    /// Takes the packets of this computer from now on, because a telecommand has given it another base.
    pub fn follow(&mut self, base: ApidBase) {
        self.counts.base = base;
    }

    /// Makes the station tell nothing but the counts at the end; [`Station::take_seen`] has the rest.
    pub fn mute(&mut self) {
        self.counts.tell = None;
    }

    /// Returns the counts until now.
    pub fn counts(&self) -> &StreamCounts {
        &self.counts
    }

    /// Returns what was seen since the last call.
    pub fn take_seen(&mut self) -> Vec<Seen> {
        std::mem::take(&mut self.counts.seen)
    }

    /// Takes the whole packets at the beginning of the bytes out of them.
    ///
    /// # Errors
    /// An output cannot be written.
    pub fn take(&mut self, bytes: &mut Vec<u8>) -> Result<(), Error> {
        let counts = &mut self.counts;
        let mut rest = &bytes[..];
        loop {
            match packet::scan(rest) {
                Scan::More { skip } => {
                    // Noise without the beginning of a packet is not kept, however long it is.
                    counts.skipped += skip as u64;
                    rest = rest.get(skip..).unwrap_or_default();
                    break;
                }
                Scan::Bad { skip } => {
                    counts.cut += 1;
                    counts.skipped += skip as u64;
                    rest = rest.get(skip..).unwrap_or_default();
                }
                Scan::Packet { end, packet } => {
                    counts.skipped += end.saturating_sub(packet.user.len() + OVERHEAD) as u64;
                    counts.take(&packet, &mut self.sink, &mut self.housekeeping)?;
                    rest = rest.get(end..).unwrap_or_default();
                }
            }
        }
        let taken = bytes.len() - rest.len();
        bytes.drain(..taken);
        Ok(())
    }

    /// Passes finished answers to the disk if their time has come.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn flush_if_due(&mut self) -> Result<(), Error> {
        match &mut self.sink {
            Some(Sink::Mcap(writer)) => writer.flush_if_due().map_err(Error::failed),
            _ => Ok(()),
        }
    }

    /// Closes the outputs. `rest` are the bytes after the last packet, `name` is that of the stream. Returns whether
    /// every byte belonged to a whole packet.
    ///
    /// # Errors
    /// An output cannot be written, or there were bytes but no packet.
    pub fn finish(self, rest: &[u8], name: &str) -> Result<bool, Error> {
        let Self { mut counts, tell, sink, housekeeping } = self;
        let skip = match packet::scan(rest) {
            Scan::More { skip } => skip,
            _ => 0,
        };
        counts.skipped += rest.len() as u64;
        // The rest is an incomplete packet, or noise.
        counts.cut += u64::from(rest.len() > skip + packet::SYNC.len());
        if let Some(sink) = sink {
            sink.finish()?;
        }
        if let Some(mut table) = housekeeping {
            table.flush()?;
        }
        tell(&counts.summary());
        if counts.packets == 0 && counts.skipped > 0 {
            let what = "no packet was found; is this the stream of a flight computer? (book/reference/telemetry.md)";
            return Err(Error::failed(format!("{name}: {what}")));
        }
        Ok(counts.cut == 0 && counts.skipped == 0)
    }
}
