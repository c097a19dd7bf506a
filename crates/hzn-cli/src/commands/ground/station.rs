//! The packets on their way from bytes to files.

use std::path::Path;

use hzn_flight::packet::{self, ApidBase, OVERHEAD, Scan};
use hzn_run::sink::Existing;

use super::outputs::{Sink, table};
use super::stream::StreamCounts;
use crate::exit::{Exit, Outcome, Stop, failed};

/// What becomes of the packets.
pub(crate) struct Station {
    pub(super) counts: StreamCounts,
    sink: Option<Sink>,
    housekeeping: Option<csv::Writer<std::fs::File>>,
}

impl Station {
    /// Makes a station with outputs for answers and housekeeping.
    pub(crate) fn new(
        base: ApidBase,
        output: Option<&Path>,
        housekeeping: Option<&Path>,
        force: bool,
    ) -> Result<Self, Stop> {
        let existing = if force { Existing::Replace } else { Existing::Refuse };
        Ok(Self {
            sink: output.map(|path| Sink::create(path, existing)).transpose()?,
            housekeeping: housekeeping.map(|path| table(path, force)).transpose()?,
            counts: StreamCounts::new(base, false),
        })
    }

    /// Makes a station without outputs.
    pub(super) fn quiet(base: ApidBase) -> Self {
        Self { counts: StreamCounts::new(base, true), sink: None, housekeeping: None }
    }

    /// Takes the whole packets at the beginning of the bytes out of them.
    pub(crate) fn take(&mut self, bytes: &mut Vec<u8>) -> Result<(), Stop> {
        let counts = &mut self.counts;
        let mut rest = &bytes[..];
        loop {
            match packet::scan(rest) {
                Scan::More { .. } => break,
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
    pub(super) fn flush_if_due(&mut self) -> Result<(), Stop> {
        match &mut self.sink {
            Some(Sink::Mcap(writer)) => writer.flush_if_due().map_err(failed),
            _ => Ok(()),
        }
    }

    /// Closes the outputs. `rest` are the bytes after the last packet.
    pub(crate) fn finish(self, rest: &[u8], name: &str) -> Outcome {
        let Self { mut counts, sink, housekeeping } = self;
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
        counts.summary();
        if counts.packets == 0 && counts.skipped > 0 {
            let what = "no packet was found; is this the stream of a flight computer? (book/reference/telemetry.md)";
            return Err(failed(format!("{name}: {what}")));
        }
        Ok(Exit::Done)
    }
}
