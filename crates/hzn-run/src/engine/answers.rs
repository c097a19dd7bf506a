//! The answers of a run with their edge points, for a calibration on the pictures of a flight.

use std::collections::HashMap;
use std::sync::atomic::AtomicBool;

use hzn_core::{Prior, Solution};
use hzn_files::FrameData;

use super::outcome::Finished;
use super::plan::Plan;
use super::pool::End;
use super::sequence::{self, Sink};
use crate::error::Error;
use crate::source::Source;

/// An answer of the pipeline with its edge points.
pub struct Answered<'a> {
    /// Name of the picture.
    pub name: &'a str,
    /// Number of the body, from 0.
    pub which: usize,
    /// Edge points of the answer, px, with their weights.
    pub points: Vec<([f64; 2], f64)>,
    /// Part of those points whose lit side is clipped at full scale, from 0 to 1.
    pub clipped: f64,
    /// The prior of the picture, without defaults of the sensor.
    pub prior: Prior<f64>,
    /// The row of the picture in frames.csv.
    pub data: Option<&'a FrameData>,
    /// The answer.
    pub solution: &'a Solution<f64>,
}

/// A sink that stores nothing; only the measurements of the pictures are kept.
struct NoSink;

impl Sink for NoSink {
    fn write(&mut self, _: &mut Finished) -> Result<(), Error> {
        Ok(())
    }
    fn flush(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// What a flight measured.
#[derive(Debug, Clone)]
pub struct Measured<T> {
    /// One measurement for a body and picture.
    pub answers: Vec<T>,
    /// Names of the pictures that were left out, because they are an earlier picture to the last bit, with the name of
    /// that one.
    pub copies: Vec<(String, String)>,
}

impl<T> Measured<T> {
    /// Returns in words how many pictures were left out as copies; `None` if none was.
    pub fn copies_in_words(&self) -> Option<String> {
        let (copy, first) = self.copies.first()?;
        Some(match self.copies.len() {
            1 => format!("1 picture is left out: {copy} is {first} to the last bit, and says nothing new"),
            n => format!(
                "{n} pictures are left out: each is an earlier picture to the last bit, as {copy} is {first}, and \
                 says nothing new"
            ),
        })
    }
}

/// Processes the pictures and measures each answer: one for a body and picture. `plan` must keep the traces; `seen`
/// gets each picture. A picture whose samples are those of an earlier one is left out: another exposure differs at
/// least by noise, and a copy would count as independent. Returns `None` if `stop` was set before the end.
///
/// # Errors
/// The source fails, see [`run`](super::run).
pub fn measure_answers<T>(
    plan: &Plan,
    source: &mut dyn Source,
    stop: &AtomicBool,
    mut seen: impl FnMut(&Finished),
    mut measure: impl FnMut(Answered<'_>) -> Option<T>,
) -> Result<Option<Measured<T>>, Error> {
    let mut measured = Measured { answers: Vec::new(), copies: Vec::new() };
    let mut firsts: HashMap<u64, String> = HashMap::new();
    let mut each = |frame: &Finished| {
        seen(frame);
        let Some(digest) = frame.traces.as_ref().map(|traces| traces.samples_digest) else { return };
        if let Some(first) = firsts.get(&digest) {
            measured.copies.push((frame.name.clone(), first.clone()));
            return;
        }
        firsts.insert(digest, frame.name.clone());
        measured.answers.extend((0..frame.outcomes.len()).filter_map(|which| measure(answer(frame, which)?)));
    };
    let end = sequence::run(plan, source, 0, stop, &mut NoSink, &mut each)?;
    Ok((end == End::Complete).then_some(measured))
}

/// Returns the answer of a picture for one body, from 0; `None` without one.
fn answer(frame: &Finished, which: usize) -> Option<Answered<'_>> {
    let report = frame.outcomes.get(which)?.report.as_ref().ok()?;
    let solution = report.solution.as_ref()?;
    let edges = frame.traces.as_ref()?.each.get(which)?.edges();
    let edge = edges.iter().find(|e| e.candidate == solution.candidate)?;
    Some(Answered {
        name: &frame.name,
        which,
        points: edge.points.iter().copied().zip(edge.weights.iter().copied()).collect(),
        clipped: edge.clipped,
        data: frame.data.as_ref(),
        prior: frame.data.as_ref().map_or_else(Prior::default, |d| d.to_prior(None)),
        solution,
    })
}
