//! The two ways to show a picture: all pixels at once, or row by row.

use core::cell::RefCell;

use hzn_core::body::Expected;
use hzn_core::image::{Grey, Layout};
use hzn_core::pipeline::{RowBuffers, RowStream, RowStreamError};
use hzn_core::{Report, Sensor, Step, Tracker, Workspace};

use super::edge_watch::{EdgeWatch, LongestEdge};
use super::row_readout::{RowRuns, RowSample};
use super::stuck::{Equality, Readout, StuckPlaces, StuckWatch};

/// The lists that a picture needs; keep them in a `static`. They are those of `hzn run --flight`, except that at most
/// 608 points are kept per edge. The default `edge_points.keep_points` needs no more; `keep_points = 0` (all) also
/// means 608 here.
// With room for all 2048 points instead of 608, the flight image took 93 KB of static RAM instead of 40 KB.
pub type Lists = Workspace<f32, 2048, 76, 512>;

/// The memory of a board that has no room for a picture, in addition to the [`Lists`]; keep it in a `static`.
///
/// `WINDOW` is [`super::ROWS_HELD`] times the width of the picture, `HEIGHT` the number of its rows. `TURNS` is the
/// number of changes between dark and lit along the rows, `POINTS` the number of edge points, both of all rows
/// together. [`RowBuffers`] says what happens when the last two are full.
#[derive(Debug)]
pub struct RowMemory<const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize> {
    rows: RowBuffers<u8, WINDOW, HEIGHT, TURNS, POINTS>,
    runs: [RowRuns; HEIGHT],
    sample: RowSample,
}

impl<const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize> Default
    for RowMemory<WINDOW, HEIGHT, TURNS, POINTS>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize>
    RowMemory<WINDOW, HEIGHT, TURNS, POINTS>
{
    /// Makes memory without a picture.
    pub const fn new() -> Self {
        Self { rows: RowBuffers::new(), runs: [RowRuns::NONE; HEIGHT], sample: RowSample::NONE }
    }
}

/// Why a picture cannot come row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// A method needs the whole picture.
    Method = 1,
    /// The memory for rows is too small.
    Room = 2,
}

/// What was seen of a picture.
// There is no heap for the large variant.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub(crate) enum Seen {
    /// The number of pixels, which is too small.
    Part(usize),
    /// The picture was refused.
    Refused(Refusal),
    /// The report, with the stuck pixels at the limb.
    Whole(Report<f32>, Option<StuckPlaces>),
}

/// What the pictures before say about a picture.
#[derive(Debug)]
pub(crate) struct Before<'a> {
    /// The expected limb.
    pub(crate) expected: &'a Expected<f32>,
    /// Where the limb was, if it is looked for there first.
    pub(crate) tracker: &'a mut Tracker<f32>,
    /// The turn since then.
    pub(crate) step: &'a Step<f32>,
}

/// The view of one picture. The board shows it the pixels ([`Self::see`]), or the rows one by one ([`Self::rows`]).
#[derive(Debug)]
pub struct Viewer<'a> {
    sensor: &'a Sensor<f32>,
    before: Before<'a>,
    workspace: &'a mut Lists,
    edge: &'a mut LongestEdge,
    /// Whether the longest edge is wanted.
    wanted: bool,
    seen: Seen,
}

impl<'a> Viewer<'a> {
    pub(crate) fn new(
        sensor: &'a Sensor<f32>,
        before: Before<'a>,
        workspace: &'a mut Lists,
        edge: &'a mut LongestEdge,
        wanted: bool,
    ) -> Self {
        edge.clear();
        // Nothing has been seen, so that a board that shows nothing is reported as a picture of wrong size.
        Self { sensor, before, workspace, edge, wanted, seen: Seen::Part(0) }
    }
    pub(crate) fn into_seen(self) -> Seen {
        self.seen
    }

    /// Sees a picture in memory: one byte per pixel, row by row from the top, without gaps. More bytes than the picture
    /// has are not read.
    // Not inlined, so that its stack is free again when the packets are sent.
    #[inline(never)]
    pub fn see(&mut self, pixels: &[u8]) {
        let camera = self.sensor.camera();
        let layout = Layout::packed(camera.width().into(), camera.height().into(), 1, 8);
        let whole = pixels.get(..usize::from(camera.width()) * usize::from(camera.height()));
        let Some((pixels, grey)) = whole.and_then(|pixels| Some((pixels, Grey::try_new(pixels, layout).ok()?))) else {
            self.seen = Seen::Part(pixels.len());
            return;
        };
        let readout = Readout::Pixels(pixels, camera.width().into());
        let watch = EdgeWatch {
            wanted: self.wanted,
            longest: RefCell::new(&mut *self.edge),
            stuck: RefCell::new(StuckWatch::new(readout, Equality::sample(pixels), camera)),
        };
        let Before { expected, tracker, step } = &mut self.before;
        let report = self.sensor.track(self.workspace, tracker, &grey, (expected, step), &watch);
        let stuck = watch.found(&report);
        self.seen = Seen::Whole(report, stuck);
    }

    /// Begins a picture that the camera sends row by row. Give every row to [`RowView::push`], then call
    /// [`RowView::finish`]. `None` if the picture cannot come row by row: the flight software reports why, and the
    /// board leaves the rows out.
    pub fn rows<'v, const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize>(
        &'v mut self,
        memory: &'v mut RowMemory<WINDOW, HEIGHT, TURNS, POINTS>,
    ) -> Option<RowView<'v>> {
        let camera = self.sensor.camera();
        // The rows of a limb that moves are not known before it is found, so these pictures are not tracked.
        self.before.tracker.forget();
        // The step of the sample depends on the whole size, so that it must be known before the first row.
        memory.sample.begin(usize::from(camera.width()) * usize::from(camera.height()));
        match self.sensor.rows(&mut memory.rows, 8, self.before.expected) {
            Ok(stream) => Some(RowView {
                level: stream.level(),
                stream,
                sensor: self.sensor,
                workspace: self.workspace,
                edge: self.edge,
                wanted: self.wanted,
                seen: &mut self.seen,
                runs: &mut memory.runs,
                sample: &mut memory.sample,
                pixels: 0,
                rows: 0,
            }),
            Err(RowStreamError::Method(_)) => {
                self.seen = Seen::Refused(Refusal::Method);
                None
            }
            Err(_) => {
                self.seen = Seen::Refused(Refusal::Room);
                None
            }
        }
    }
}

/// The view of a picture whose rows are being shown.
#[derive(Debug)]
pub struct RowView<'a> {
    level: Option<u16>,
    stream: RowStream<'a, f32, u8>,
    sensor: &'a Sensor<f32>,
    workspace: &'a mut Lists,
    edge: &'a mut LongestEdge,
    wanted: bool,
    seen: &'a mut Seen,
    runs: &'a mut [RowRuns],
    sample: &'a mut RowSample,
    /// Number of pixels and of rows so far.
    pixels: usize,
    rows: usize,
}

impl RowView<'_> {
    /// Sees the next row, from the top: one byte per pixel. A row of another length, and a row after the last one, are
    /// not part of the picture.
    pub fn push(&mut self, row: &[u8]) {
        if self.stream.push_row(row).is_err() {
            return;
        }
        self.sample.take_row(row);
        // Without a threshold the picture has no answer that could be wrong.
        if let (Some(level), Some(runs)) = (self.level, self.runs.get_mut(self.rows)) {
            *runs = RowRuns::find(row, level);
        }
        self.pixels += row.len();
        self.rows += 1;
    }

    /// Finds the limb after the last row. Call it as well when the camera stops before: the flight software then
    /// reports a picture of wrong size.
    #[inline(never)]
    pub fn finish(self) {
        let camera = self.sensor.camera();
        if self.rows < usize::from(camera.height()) {
            *self.seen = Seen::Part(self.pixels);
            return;
        }
        let readout = Readout::Rows(self.runs.get(..self.rows).unwrap_or_default());
        let watch = EdgeWatch {
            wanted: self.wanted,
            longest: RefCell::new(self.edge),
            stuck: RefCell::new(StuckWatch::new(readout, Equality::of_rows(self.sample), camera)),
        };
        let report = self.stream.finish(self.workspace, &watch);
        let stuck = watch.found(&report);
        *self.seen = Seen::Whole(report, stuck);
    }
}
