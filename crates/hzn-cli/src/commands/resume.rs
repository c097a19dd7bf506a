//! The pictures that an output contains already: which are skipped, and which are processed again.

use std::path::{Path, PathBuf};

use hzn_mcap::Row;
use hzn_run::checked_row;
use hzn_run::engine::{self, AnySensor, Plan, REMEMBERED, Sums, Turns};
use hzn_run::sink::{self, StoredResults};
use hzn_run::source::{Item, Source};

use crate::exit::{Stop, usage};
use crate::tell;

/// Skips the pictures that the output contains already, and checks that this run would give the same results. The last
/// of them is processed again, and so is each picture that was changed since; each must give the row in the output. If
/// the table of the pictures was changed, this holds for all pictures, and if a row was changed, for those from there
/// on. Returns the answers and turns up to the last of them.
pub(super) fn skip_stored(
    source: &mut dyn Source,
    stored: &StoredResults,
    plan: &Plan,
    outputs: &[PathBuf],
) -> Result<Turns, Stop> {
    let name = outputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
    let other = |what: String| Err(usage(format!("{name}: {what}, or start over with --force")));
    let table = plan.frames.as_ref().map(|frames| &frames.path);
    let changed_table = table.filter(|table| stored.frames > 0 && stored.is_older_than(table));
    changed_table.iter().for_each(|table| tell_changed(table));
    let contradicted_from = stored.contradicted_from();
    contradicted_from.iter().for_each(|from| tell_contradicted(&name, *from));
    let mut again = Again { sensor: None, plan: Plan { overlay: None, masks: None, ..plan.clone() }, stored };
    let mut turns = Turns::default();
    for n in 0..stored.frames {
        let Some(item) = source.next() else {
            let what = format!("contains {} pictures, but the input has only {n}", stored.frames);
            return other(format!("{what}; give the input that it was begun with"));
        };
        let item = item?;
        let is_last = n + 1 == stored.frames;
        if let (true, Some(row)) = (is_last, &stored.last)
            && item.name != row.file
        {
            let what = format!("its last picture is {}, but the input has {} in this place", row.file, item.name);
            return other(format!("{what}; give the input that it was begun with"));
        }
        let changed = stored.is_changed(n, std::iter::once(&item.payload));
        let contradicted = contradicted_from.is_some_and(|from| n >= from);
        let before = turns.clone();
        again.replay(n, &item, &mut turns);
        if !(is_last || changed || contradicted || changed_table.is_some()) {
            // The pictures after these are compared with their bytes.
            if n + REMEMBERED as u64 >= stored.frames {
                turns.see_sums(sums(item, plan));
            }
            continue;
        }
        let picture = item.name.clone();
        let (same, sums) = again.gives_the_same(n, item, before)?;
        turns.see_sums(sums);
        let looked = Looked { picture: &picture, is_last, changed, contradicted, changed_table };
        if let Some(what) = looked.refusal(same) {
            return other(what);
        }
    }
    Ok(turns)
}

/// A picture that was looked at again, with the reasons for it.
struct Looked<'a> {
    picture: &'a str,
    is_last: bool,
    /// Whether the picture was changed.
    changed: bool,
    /// Whether its rows are not those that were written.
    contradicted: bool,
    /// The table of the pictures, if it was changed.
    changed_table: Option<&'a PathBuf>,
}

impl Looked<'_> {
    /// Returns why the run cannot go on, if so. `same` says whether the picture gives its rows again; `None` if this
    /// also depends on the pictures before it.
    fn refusal(&self, same: Option<bool>) -> Option<String> {
        let picture = self.picture;
        let depends = "and its result depends on the pictures before it, so that it cannot be compared alone";
        match (same, self.changed_table) {
            (Some(true), _) => None,
            (Some(false), _) if self.changed => Some(format!(
                "the picture {picture} was changed since these results were written, and now gives another result; \
                 give the pictures that it was begun with"
            )),
            (Some(false), _) => {
                let which = if self.is_last { "its last picture, " } else { "its picture " };
                Some(format!(
                    "{which}{picture}, now gives another result; give the sensor.toml, frames.csv and options \
                     (--altitude-km, --fps, --flight) that it was begun with"
                ))
            }
            (None, _) if self.changed => {
                Some(format!("{picture} was changed since these results were written, {depends}"))
            }
            (None, _) if self.contradicted => {
                Some(format!("its row of the picture {picture} is not the one that was written, {depends}"))
            }
            (None, Some(table)) => {
                Some(format!("{} was changed since these results were written, {depends}", table.display()))
            }
            // Without the pictures before it, a picture would give another result.
            (None, None) => None,
        }
    }
}

fn tell_changed(table: &Path) {
    let what = "was changed since these results were written, so that all pictures are compared with it";
    tell::line(format_args!("note: {} {what}", table.display()));
}

fn tell_contradicted(outputs: &str, from: u64) {
    let what = "the rows are not those that were written, so that they are compared with their pictures";
    tell::line(format_args!("note: {outputs}: from picture {from} on, {what}"));
}

/// Returns the checksums of a picture as the sensor sees it; `None` if it cannot be read.
fn sums(item: Item, plan: &Plan) -> Option<Sums> {
    item.decode(&plan.config).as_ref().map(Sums::of)
}

/// Processes pictures again and compares them with what is stored.
struct Again<'a> {
    sensor: Option<AnySensor>,
    plan: Plan,
    stored: &'a StoredResults,
}

impl Again<'_> {
    /// Takes the stored answers of a picture into the comparison with the turn of the vehicle.
    fn replay(&self, n: u64, item: &Item, turns: &mut Turns) {
        let (config, bodies) = (&self.plan.config, self.plan.config.each_body().len());
        let first = n as usize * bodies;
        let answers = self.stored.answers.get(first..first + bodies).unwrap_or_default();
        let time_s = self.stored.times_s.get(n as usize).copied().flatten();
        match &self.plan.frames {
            Some(frames) => turns.replay(frames.get(&item.name), time_s, answers, config),
            None => turns.replay(item.data.as_ref(), time_s, answers, config),
        }
    }

    /// Returns whether a picture gives its stored rows again, after the answers and turns before it; `None` if that
    /// also depends on the threshold of the pictures before it. The other value has the checksums of the picture.
    fn gives_the_same(&mut self, n: u64, item: Item, mut before: Turns) -> Result<(Option<bool>, Option<Sums>), Stop> {
        // The limb of a picture in the middle of a block was tracked from the picture before it.
        let every = u64::from(self.plan.config.track.full_every);
        if self.plan.config.tracks() || (self.plan.config.track.is_on() && !n.is_multiple_of(every)) {
            return Ok((None, sums(item, &self.plan)));
        }
        let sensor = match &mut self.sensor {
            Some(sensor) => sensor,
            none => none.insert(AnySensor::new(&self.plan.config, self.plan.flight).map_err(usage)?),
        };
        // In a run with several threads, an answer does not depend on those before it.
        sensor.remember(&vec![None; self.plan.config.each_body().len()]);
        let mut processed = engine::process_one(&self.plan, sensor, n, item)?;
        before.judge(&mut processed, &self.plan.config);
        let rows: Vec<Row> = sink::rows(&processed, &self.plan.config);
        let row_sums = rows.iter().map(checked_row::sum).collect::<Result<Vec<u32>, _>>()?;
        let first = n as usize * rows.len();
        let same = self.stored.sums.get(first..first + rows.len()) == Some(row_sums.as_slice());
        Ok((Some(same), processed.bytes.map(|bytes| bytes.sums)))
    }
}
