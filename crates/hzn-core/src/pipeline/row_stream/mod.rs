//! A picture that comes row by row, for a flight computer without room for a whole one.
//!
//! Each row is turned into runs of lit and dark pixels ([`runs`]). Pixels that a border can pass through become edge
//! points as soon as the rows around them have arrived ([`recent_rows`], [`points`]). After the last row, the stages
//! from `contour` on use runs and points in the same way as a picture in memory: with the same edges, the same points
//! and the same answer. The threshold must therefore be known beforehand: it is `fixed`, or it comes from the picture
//! before.
//!
//! Rows that have left the memory cannot be read again, with these consequences:
//! - When the runs do not fit, the picture ends with the last row that did. When the points do not fit, pixels are left
//!   out evenly. `dropped` counts the pixels.
//! - If an edge is so wide that its plateau lies beyond the rows in memory, the last of these rows stands for the
//!   plateau. `cut_points` counts these points.
//! - There is only one look: `[retry]` has no effect, a dark frame is not found, and a picture without an answer
//!   stays without one.
//! - The contrast that the local mid-level of an edge needs is a fraction of full scale, because the contrast of the
//!   picture itself is known only after its last row.

mod points;
mod recent_rows;
mod runs;

use core::fmt;

use super::budget;
use super::look::Look;
use super::search::Search;
use super::sensor::Sensor;
use super::workspace::Workspace;
use crate::base::real::Real;
use crate::geometry::pixel::Pixel;
use crate::image::region::Region;
use crate::image::{Pixels, Sample, StreamedPoint};
use crate::model::body::Expected;
use crate::model::observer::{Observer, Unobserved};
use crate::model::report::Report;
use crate::model::status::{Stage, Status};
use crate::stages::contour::{self, BinaryPicture};
use crate::stages::edge_points::{self, SubPixel};
use crate::stages::threshold;
use crate::stages::threshold::RowSampler;
use points::{Point, Points};
pub use recent_rows::ROWS_HELD;
use recent_rows::RecentRows;
use runs::Runs;

/// Rows that must follow a border pixel's row before the pixel is measured. At least the same number of rows before the
/// pixel's row is then in memory.
// With 32 rows in memory and the pixel's own one, both sides have at least 15 rows for the plateaus of a wide edge.
const AHEAD: u16 = 15;

/// The memory that a picture needs in addition to a [`Workspace`] when it comes row by row.
///
/// `WINDOW` is the number of samples, [`ROWS_HELD`] times the width. `HEIGHT` is the number of rows. `TURNS` is the
/// number of changes between dark and lit along the rows, for all rows together. `POINTS` is the number of edge points
/// of all edges together.
///
/// New buffers are all zeros: as a `static` they take no room in flash.
#[derive(Debug)]
pub struct RowBuffers<S, const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize> {
    window: [S; WINDOW],
    run_ends: [u16; HEIGHT],
    turns: [u16; TURNS],
    point_ends: [u16; HEIGHT],
    points: [Point; POINTS],
}

impl<S: Sample, const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize> Default
    for RowBuffers<S, WINDOW, HEIGHT, TURNS, POINTS>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<S: Sample, const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize>
    RowBuffers<S, WINDOW, HEIGHT, TURNS, POINTS>
{
    /// Makes empty buffers.
    pub const fn new() -> Self {
        Self {
            window: [S::ZERO; WINDOW],
            run_ends: [0; HEIGHT],
            turns: [0; TURNS],
            point_ends: [0; HEIGHT],
            points: [Point::NONE; POINTS],
        }
    }
}

/// Reason why a picture cannot be processed row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStreamError {
    /// The [`RowBuffers`] are too small for the picture; the fields say what it needs.
    Room {
        /// Samples in the window, the least value of `WINDOW`.
        window: usize,
        /// Rows, the least value of `HEIGHT`.
        height: usize,
    },
    /// A method needs the whole picture. The string is the key in sensor.toml.
    Method(&'static str),
    /// The number of bits per sample is not supported.
    Bits,
    /// The length of a row is not the width of the picture. The row was not added.
    Length,
    /// The picture has no more rows.
    Finished,
}

impl fmt::Display for RowStreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Room { window, height } => {
                write!(f, "the picture needs room for {window} samples in the window and for {height} rows")
            }
            Self::Method(key) => write!(f, "{key}: this method needs the whole picture; leave it at its default"),
            Self::Bits => f.write_str("bits per sample must be 8 for bytes and 8 to 16 for words"),
            Self::Length => f.write_str("a row must be as long as the picture is wide"),
            Self::Finished => f.write_str("the picture has no more rows"),
        }
    }
}
impl core::error::Error for RowStreamError {}

/// A picture whose rows are being added.
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::observer::Unobserved;
/// use hzn_core::pipeline::{ROWS_HELD, RowBuffers};
/// use hzn_core::{Config, FlightWorkspace, Prior, Sensor};
///
/// let mut config = Config::new(camera::Config::ideal(Model::Pinhole, 64, 48, 60.0));
/// config.body.altitude_km = Some(230.0);
/// let sensor = Sensor::<f32>::new(&config)?;
/// let expected = sensor.expect(&Prior::default())?;
/// let mut buffers = Box::new(RowBuffers::<u8, { ROWS_HELD as usize * 64 }, 48, 1024, 1024>::new());
/// let mut rows = sensor.rows(&mut buffers, 8, &expected)?;
/// for y in 0..48 {
///     rows.push_row(&[if y < 20 { 5 } else { 200 }; 64])?;
/// }
/// let report = rows.finish(&mut Box::new(FlightWorkspace::new()), &Unobserved);
/// // The first picture only gives the threshold of the next one.
/// assert!(report.solution.is_none() && report.next_level.is_some());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct RowStream<'a, T, S> {
    sensor: &'a Sensor<T>,
    expected: &'a Expected<T>,
    /// Threshold in counts; `None` if the picture only serves to find the threshold of the next one.
    level: Option<u16>,
    samples: RowSampler,
    window: RecentRows<'a, S>,
    runs: Runs<'a>,
    points: Points<'a>,
    /// Number of rows that have arrived.
    rows: u16,
    /// Whether a row did not fit. The rows after it only serve to find the next threshold.
    full: bool,
}

impl<T: Real> Sensor<T> {
    /// Begins a picture whose rows come one by one. The samples have `bits` significant bits.
    ///
    /// With a `fixed` threshold every picture can have an answer. With every other method the threshold is
    /// `expected.level`; the caller sets it to the `next_level` of the last report. Without it the status is `no-limb`
    /// at the first stage, and the report has the threshold for the next picture.
    ///
    /// # Errors
    /// The buffers are too small, a method needs the whole picture, or the number of bits is not supported.
    pub fn rows<'a, S: Sample, const WINDOW: usize, const HEIGHT: usize, const TURNS: usize, const POINTS: usize>(
        &'a self,
        rows: &'a mut RowBuffers<S, WINDOW, HEIGHT, TURNS, POINTS>,
        bits: u8,
        expected: &'a Expected<T>,
    ) -> Result<RowStream<'a, T, S>, RowStreamError> {
        let config = &self.config;
        let (width, height) = (self.camera.width(), self.camera.height());
        let window = usize::from(ROWS_HELD) * usize::from(width);
        if WINDOW < window || HEIGHT < usize::from(height) {
            return Err(RowStreamError::Room { window, height: height.into() });
        }
        if !matches!(config.edge_points.sub_pixel, SubPixel::Linear | SubPixel::None) {
            return Err(RowStreamError::Method("edge_points.sub_pixel"));
        }
        if config.contour.method != contour::Method::BorderFollowing {
            return Err(RowStreamError::Method("contour.method"));
        }
        if cfg!(feature = "horace") {
            if config.retry.method != crate::config::retry::Method::None {
                return Err(RowStreamError::Method("retry.method"));
            }
            if config.input.scale_to_height.is_some() {
                return Err(RowStreamError::Method("input.scale_to_height"));
            }
        }
        if bits < 8 || bits > S::BITS {
            return Err(RowStreamError::Bits);
        }
        let full_scale = ((1u32 << bits) - 1) as u16;
        let levels = config.threshold_of(expected.which);
        Ok(RowStream {
            sensor: self,
            expected,
            // A fixed threshold needs no earlier picture, so that the first picture can have an answer.
            level: threshold::fixed_level::<T>(levels, full_scale).or(expected.level),
            samples: RowSampler::new(config.consensus.seed, full_scale, &self.region),
            window: RecentRows::new(&mut rows.window, width, height, full_scale),
            runs: Runs::new(&mut rows.run_ends, &mut rows.turns, width),
            points: Points::new(&mut rows.point_ends, &mut rows.points),
            rows: 0,
            full: false,
        })
    }
}

impl<T: Real, S: Sample> RowStream<'_, T, S> {
    /// Returns the threshold in counts; `None` if the picture only serves to find that of the next one.
    pub fn level(&self) -> Option<u16> {
        self.level
    }

    /// Adds the next row, from the top.
    ///
    /// # Errors
    /// The row has another length, or the picture already has all its rows. Nothing changes then.
    pub fn push_row(&mut self, row: &[S]) -> Result<(), RowStreamError> {
        let camera = &self.sensor.camera;
        // The length is checked before anything is stored, so that a refused row can be sent again.
        if row.len() != usize::from(camera.width()) {
            return Err(RowStreamError::Length);
        }
        if self.rows == camera.height() {
            return Err(RowStreamError::Finished);
        }
        // The sample is drawn from every row, also from those that no longer fit: it gives the threshold of the next
        // picture.
        self.samples.row(&self.sensor.region, self.rows, row, &Unobserved);
        self.rows += 1;
        // After a row that did not fit, no other is stored: a gap would join edges that do not touch.
        if let (Some(level), false) = (self.level, self.full) {
            self.window.push(row);
            self.full = !self.runs.push(row.iter().map(|&s| s.into() >= level));
            if !self.full
                && let Some(y) = self.runs.rows().checked_sub(AHEAD + 1)
            {
                self.measure(y, level, &self.sensor.region);
            }
        }
        Ok(())
    }

    /// Finds the limb after the last row. With fewer rows than the picture has, the status is `rejected` at the first
    /// stage.
    pub fn finish<O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        mut self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        observer: &O,
    ) -> Report<T> {
        let mut report = Report::empty();
        if self.rows == self.sensor.camera.height() {
            self.look(workspace, observer, &mut report);
        }
        observer.leave();
        report
    }

    fn look<O: Observer<T>, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
        &mut self,
        workspace: &mut Workspace<T, POINTS, BLOCKS, WORDS>,
        observer: &O,
        report: &mut Report<T>,
    ) {
        observer.enter(Stage::Threshold);
        let config = &self.sensor.config;
        let levels = config.threshold_of(self.expected.which);
        let next = match self.samples.split::<T, O>(&config.brightness, levels, None, observer) {
            Ok(found) => found.level,
            Err(status) => {
                report.status = status;
                return;
            }
        };
        report.next_level = Some(next);
        let Some(level) = self.level else {
            report.status = Status::NoLimb;
            return;
        };
        report.level = level;
        report.stage = Stage::Contour;
        observer.enter(Stage::Contour);
        // The picture ends with the last row that was stored, so that an edge ends there as at the border of a picture.
        let region = self.sensor.region.first_rows(self.runs.rows());
        for y in self.runs.rows().saturating_sub(AHEAD)..self.runs.rows() {
            self.measure(y, level, &region);
        }
        let picture = Memory { runs: &self.runs, points: &self.points, width: region.width(), height: region.height() };
        let lists = workspace.lists();
        // An edge needs a dark row or column next to a lit one; a single row has no border to follow.
        if picture.height > 1 {
            // The picture has two shades, therefore its threshold is 1.
            let binary = BinaryPicture::new(&picture, &region, 1, observer).with_blooming(self.expected.blooms());
            let work = budget::new(&self.sensor.config, lists.border.len());
            let own = self.sensor.camera_for(self.expected);
            let camera = own.as_ref().unwrap_or(&self.sensor.camera);
            let look = Look { lists, picture: &picture, expected: self.expected, taken: &[], observer, report };
            let mut search = Search::new(self.sensor, camera, look, work);
            let (border, marks) = search.take_lists();
            search.border_following(&binary, border, marks);
            search.conclude();
        }
        report.next_level = Some(next);
        report.counters.dropped += self.points.dropped();
        if self.full {
            report.counters.dropped += u32::from(self.rows - self.runs.rows()) * u32::from(picture.width);
            // An answer from the first rows has passed every gate, so it counts.
            if report.solution.is_none() {
                report.status = Status::Truncated;
            }
        }
    }

    /// Measures the edge points of a row. The rows around it must have arrived.
    fn measure(&mut self, y: u16, level: u16, region: &Region<T>) {
        let config = &self.sensor.config.edge_points;
        let binary = BinaryPicture::new(&self.window, region, level, &Unobserved)
            .with_blooming(self.expected.blooms())
            .with_tone(self.sensor.config.input.tone);
        self.runs.each_border(y, |x| {
            if region.contains(x, y) && self.points.wants(x, y) {
                let found = edge_points::locate_streamed_point(&binary, config, Pixel { x, y });
                let cut = self.window.went_beyond();
                // A point that was lost because rows are missing is counted, too.
                if let Some(found) = found.or(cut.then_some(StreamedPoint::LOST)) {
                    let marks = found.marks | (u8::from(cut) * StreamedPoint::CUT);
                    self.points.push(x, StreamedPoint { marks, ..found });
                }
            }
        });
        self.points.end_row();
    }
}

/// The part of the picture that is still in memory after the last row: two shades, and edge points.
struct Memory<'a> {
    runs: &'a Runs<'a>,
    points: &'a Points<'a>,
    width: u16,
    height: u16,
}

impl Pixels for Memory<'_> {
    const STREAMED: bool = true;
    fn width(&self) -> u16 {
        self.width
    }
    fn height(&self) -> u16 {
        self.height
    }
    fn full_scale(&self) -> u16 {
        1
    }
    fn index(&self, x: u16, y: u16) -> usize {
        // Row and column lie in separate halves of the index, so that a read needs no division by the width.
        usize::from(y) << 16 | usize::from(x)
    }
    fn across(&self) -> usize {
        1
    }
    fn down(&self) -> usize {
        1 << 16
    }
    #[inline]
    fn read(&self, index: usize) -> u16 {
        u16::from(self.runs.lit((index & 0xFFFF) as u16, (index >> 16) as u16))
    }
    fn streamed_point(&self, x: u16, y: u16) -> Option<StreamedPoint> {
        self.points.get(x, y)
    }
}
