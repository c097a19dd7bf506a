//! The files that telemetry becomes: answers, and a table of housekeeping.

use std::path::Path;

use hzn_flight::cuc::Cuc;
use hzn_flight::messages::Housekeeping;
use hzn_mcap::FrameRecord;
use hzn_run::disk::{self, Checked};
use hzn_run::sink::{self, Existing, RowFile, Target};

use crate::error::Error;

pub(crate) fn table(path: &Path, force: bool) -> Result<csv::Writer<Checked>, Error> {
    disk::refuse_existing(path, force)?;
    let mut table = csv::Writer::from_writer(Checked::create(path).map_err(|e| disk::cannot_write(path, &e))?);
    let columns = ["time_s"].into_iter().chain(Housekeeping::FIELDS.iter().copied());
    table.write_record(columns).map_err(Error::failed)?;
    Ok(table)
}

/// The output for answers.
pub(crate) enum Sink {
    Rows(RowFile),
    Mcap(Box<hzn_mcap::Writer>),
}

impl Sink {
    pub(crate) fn create(path: &Path, existing: Existing) -> Result<Self, Error> {
        if sink::target(path)? != Target::Mcap {
            return Ok(Self::Rows(RowFile::create(path, existing)?));
        }
        let metadata = [("program".to_owned(), format!("hzn telemetry {}", env!("CARGO_PKG_VERSION")))].into();
        let options = hzn_mcap::Options { metadata, force: existing == Existing::Replace, ..Default::default() };
        let writer = hzn_mcap::Writer::create(path, &options).map_err(Error::unusable)?;
        Ok(Self::Mcap(Box::new(writer)))
    }
    pub(crate) fn write(&mut self, record: FrameRecord) -> Result<(), Error> {
        match self {
            Self::Rows(rows) => Ok(rows.write(&record.row)?),
            Self::Mcap(writer) => writer.write(&record).map_err(Error::failed),
        }
    }
    pub(crate) fn finish(self) -> Result<(), Error> {
        match self {
            Self::Rows(rows) => Ok(rows.finish()?),
            Self::Mcap(writer) => writer.finish().map(drop).map_err(Error::failed),
        }
    }
}

/// Writes a row of the table of housekeeping, if there is one.
pub(crate) fn write_housekeeping(
    time: Cuc,
    record: &Housekeeping,
    table: &mut Option<csv::Writer<Checked>>,
) -> Result<(), Error> {
    if let Some(table) = table {
        // The time of a correlated clock counts from 1958; the column `clock` says which time it is.
        let values = std::iter::once(time.us as f64 * 1e-6).chain(record.values());
        table.write_record(values.map(|v| v.to_string())).map_err(Error::failed)?;
    }
    Ok(())
}
