//! The files that telemetry becomes: answers, and a table of housekeeping.

use std::path::Path;

use hzn_flight::cuc::Cuc;
use hzn_flight::messages::Housekeeping;
use hzn_mcap::FrameRecord;
use hzn_run::disk;
use hzn_run::sink::{self, Existing, RowFile, Target};

use crate::exit::{Stop, failed, usage};

pub(super) fn table(path: &Path, force: bool) -> Result<csv::Writer<std::fs::File>, Stop> {
    disk::refuse_existing(path, force)?;
    let mut table = csv::Writer::from_path(path).map_err(|e| failed(format!("{}: {e}", path.display())))?;
    let columns = ["time_s"].into_iter().chain(Housekeeping::FIELDS.iter().copied());
    table.write_record(columns).map_err(failed)?;
    Ok(table)
}

/// The output for answers.
pub(super) enum Sink {
    Rows(RowFile),
    Mcap(Box<hzn_mcap::Writer>),
}

impl Sink {
    pub(super) fn create(path: &Path, existing: Existing) -> Result<Self, Stop> {
        if sink::target(path)? != Target::Mcap {
            return Ok(Self::Rows(RowFile::create(path, existing)?));
        }
        let metadata = [("program".to_owned(), format!("hzn {}", env!("CARGO_PKG_VERSION")))].into();
        let options = hzn_mcap::Options { metadata, force: existing == Existing::Replace, ..Default::default() };
        let writer = hzn_mcap::Writer::create(path, &options).map_err(usage)?;
        Ok(Self::Mcap(Box::new(writer)))
    }
    pub(super) fn write(&mut self, record: FrameRecord) -> Result<(), Stop> {
        match self {
            Self::Rows(rows) => Ok(rows.write(&record.row)?),
            Self::Mcap(writer) => writer.write(&record).map_err(failed),
        }
    }
    pub(super) fn finish(self) -> Result<(), Stop> {
        match self {
            Self::Rows(rows) => Ok(rows.finish()?),
            Self::Mcap(writer) => writer.finish().map(drop).map_err(failed),
        }
    }
}

/// Writes a row of the table of housekeeping, if there is one.
pub(super) fn write_housekeeping(
    time: Cuc,
    record: &Housekeeping,
    table: &mut Option<csv::Writer<std::fs::File>>,
) -> Result<(), Stop> {
    if let Some(table) = table {
        // The time of a correlated clock counts from 1958; the column `clock` says which time it is.
        let values = std::iter::once(time.us as f64 * 1e-6).chain(record.values());
        table.write_record(values.map(|v| v.to_string())).map_err(failed)?;
    }
    Ok(())
}
