//! The order in which the edges of a picture are examined: those at the border first, then those that search lines
//! meet.

use super::Search;
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::pixel::Pixel;
use crate::image::Pixels;
use crate::model::body::Expected;
use crate::model::observer::Observer;
use crate::model::work;
use crate::model::work::WorkBudget;
use crate::stages::contour;
use crate::stages::contour::{BinaryPicture, End, Marks, Thinned};

/// Largest number of words in which search lines are marked. More search lines find no further edges.
const LINE_WORDS: usize = 16384;

/// Approximate number of places at which the shorter side of the border is read. The dark and lit stretches that a limb
/// makes on the border are longer than the distance between two places. Every read of a column touches another page of
/// memory.
const BORDER_LOOKS: u16 = 128;

/// Returns the spacing of search lines in rows: the usual one (1 to 64), and the largest one, for the case that memory
/// is short (1 to 256).
///
/// The largest spacing is the smallest extent of the body's disc. The usual spacing is a quarter of it if crescents
/// occur, because search lines must cross these too; otherwise it is the same.
///
/// A disc of half-angle α spans at least 2 α f min(r', r/sin θ) rows. The code uses f/2 in place of f min(r', r/sin θ);
/// every lens in use exceeds this.
fn line_spacing<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> (u16, u16) {
    let (_, fy) = camera.focal_px();
    let disc = expected.half_angle_rad() * fy;
    let narrow = if expected.phases { disc * T::from_f64(0.25) } else { disc };
    (narrow.to_i32().clamp(1, 64) as u16, disc.to_i32().clamp(1, 256) as u16)
}

/// Whether an edge begins at the border between two pixels that were read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Missed {
    /// No edge of this kind is known so far.
    Unknown,
    /// There is at least one edge of this kind.
    Some,
    /// The border was searched pixel by pixel for edges of this kind.
    Found,
}

impl<T: Real, O: Observer<T>> Search<'_, T, O> {
    /// Examines the edges that begin at the border of the picture, the likeliest first, then those that search lines
    /// meet.
    #[inline(always)]
    pub(in crate::pipeline) fn border_following<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &mut [Pixel],
        bits: &mut [u32],
    ) {
        let (narrow, widest) = line_spacing(self.expected, &self.sensor.camera);
        let (spacing, widest) =
            self.sensor.config.contour.line_spacing_px.map_or((narrow, widest), |given| (given, given));
        let bits = bits.get_mut(..LINE_WORDS.min(bits.len())).unwrap_or_default();
        let (width, height) = (binary.region.width(), binary.region.height());
        let mut marks = Marks::new(bits, width, height, spacing, widest);
        // A stretch of the border that is narrower than the distance between two search lines is no limb.
        let stride = spacing.min(width.min(height) / BORDER_LOOKS).max(1);
        let ranked = binary.ranked_starts(stride);
        self.work.charge(binary.cost());
        for start in &ranked {
            if self.is_over() {
                break;
            }
            self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
        }
        if !self.is_over() {
            binary.each_start(stride, &mut |start| {
                if !ranked.iter().any(|r| r.pixel == start.pixel && r.dark == start.dark) {
                    self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
                }
                self.work.charge(binary.cost());
                !self.is_over()
            });
        }
        self.join_edges(binary, &ranked, border, &mut marks);
        if self.best.is_some() && !self.examines_all() {
            return;
        }
        let mut missed = Missed::Unknown;
        for y in marks.rows(height) {
            let Some((x0, x1)) = binary.region.row_span(y) else { continue };
            if self.is_over() || !self.work.try_spend(work::line_cost(x0, x1)) {
                break;
            }
            let crossings = binary.each_crossing(y, (x0, x1), &mut marks, |pixel, dark, marks| {
                self.follow_from_line(binary, pixel, dark, border, marks, &mut missed);
                !self.is_over()
            });
            self.work.charge(crossings * work::CROSSING + binary.cost());
            if missed == Missed::Some {
                missed = Missed::Found;
                if !self.work.try_spend(work::ring_cost(width, height, 1, 0)) {
                    break;
                }
                binary.each_narrow_start(stride, &mut |start| {
                    self.follow_and_judge(binary, start.pixel, start.dark, border, &mut marks);
                    self.work.charge(binary.cost());
                    !self.is_over()
                });
            }
        }
    }

    /// Examines an edge that a search line meets. An edge that ends at the border also begins there, between two pixels
    /// that were read, and only a part of it is followed from the search line. It is therefore not judged; instead,
    /// `missed` requests a search of the whole border, which finds the edge from its beginning. After that search,
    /// every edge is judged.
    fn follow_from_line<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
        missed: &mut Missed,
    ) {
        let mut edge = Thinned::new(border);
        match self.follow(binary, pixel, dark, &mut edge, marks) {
            Some(End::Open) if *missed != Missed::Found => *missed = Missed::Some,
            Some(_) => self.judge_edge(binary, &edge),
            None => {}
        }
        self.work.charge(binary.cost());
    }

    /// Examines every outer border of the picture.
    pub(in crate::pipeline) fn raster<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        border: &mut [Pixel],
        bits: &mut [u32],
    ) {
        let budget = self.work.remaining();
        let mut steps = budget;
        let ended = contour::raster::each_border(binary, bits, border, &mut steps, |edge| {
            self.judge_edge(binary, edge);
            !self.work.is_exhausted()
        });
        self.report.counters.followed += budget - steps;
        self.work.charge(budget - steps);
        if ended == contour::raster::Scanned::Truncated {
            self.work.mark_truncated();
        }
    }

    /// Examines all edge pixels of the picture as one edge, for methods that do not separate edges.
    pub(in crate::pipeline) fn judge_all_as_one<'b, P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        edges: impl FnOnce(&mut WorkBudget) -> Thinned<'b>,
    ) {
        let edge = edges(&mut self.work);
        self.judge_edge(binary, &edge);
    }

    /// Follows one edge and takes it through every stage.
    fn follow_and_judge<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        border: &mut [Pixel],
        marks: &mut Marks<'_>,
    ) {
        let mut edge = Thinned::new(border);
        if self.follow(binary, pixel, dark, &mut edge, marks).is_some() {
            self.judge_edge(binary, &edge);
        }
        // The gates have read pixels, too.
        self.work.charge(binary.cost());
    }

    /// Follows one edge and returns how it ended; `None` if the edge is a hole, or if the work budget does not allow
    /// it.
    pub(super) fn follow<P: Pixels>(
        &mut self,
        binary: &BinaryPicture<'_, T, P, O>,
        pixel: Pixel,
        dark: u8,
        edge: &mut Thinned<'_>,
        marks: &mut Marks<'_>,
    ) -> Option<End> {
        if !self.work.try_spend(work::EDGE) {
            return None;
        }
        let end = self.work.limit_edge(|steps| binary.follow(pixel, dark, edge, marks, steps));
        self.report.counters.followed += edge.total();
        // A hole is sky or ground that is seen through something.
        let hole = matches!(end, End::Closed { twice_area } if twice_area > 0);
        (!hole).then_some(end)
    }
}
