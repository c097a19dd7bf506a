//! Edges that stay at the same pixels while the limb moves: they belong to the vehicle, and a mask hides them.

use std::collections::{HashMap, HashSet};

use hzn_run::engine::trace::Edge;

use super::mask::Polygons;
use super::view::Point;

/// Number of cells along the longer side of a picture.
const CELLS: u32 = 160;
/// Smallest side of a cell in pixels. The edge of a part that does not move jumps by a pixel or two with the noise.
const LEAST_CELL_PX: u32 = 4;
/// Part of the pictures without an answer in which a steady edge lies at the same pixels.
const STEADY: f64 = 0.8;
/// Largest part of the answers in which the limb lies at the same pixels. If it does not move either, a steady edge may
/// be the limb.
const MOVING: f64 = 0.5;
/// Smallest number of pictures with edges and without an answer that say something.
const PICTURES: u32 = 5;
/// Smallest number of answers that show how the limb moves.
const ANSWERS: u32 = 5;
/// Smallest number of cells of a steady edge. The contour stage drops shorter edges.
const LEAST_CELLS: usize = 4;
/// Largest part of the picture that is offered as a mask. A larger one would hide most limbs.
const LARGEST: f64 = 0.25;
/// Corners of an offered polygon; sensor.toml allows this many.
const CORNERS: usize = super::mask::MAX_CORNERS;
/// Largest number of polygons that sensor.toml allows.
const MOST_POLYGONS: usize = 8;

/// A square of the picture: its column and row.
type Cell = [u8; 2];

/// The cells of a picture with an edge.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EdgeCells {
    size: [u32; 2],
    cells: Vec<Cell>,
    /// The edge is the limb of an answer. The search ends with an answer, so the other edges are not known then.
    is_limb: bool,
}

impl EdgeCells {
    /// Finds the cells with the limb of the answers, or those with any edge if there is no answer. `bodies` has the
    /// edges of each body, with the number of the candidate that became its answer.
    pub fn of<'a>(size: [u32; 2], bodies: impl Iterator<Item = (&'a [Edge], Option<u32>)> + Clone) -> Self {
        let cell_px = cell_px(size);
        let is_limb = bodies.clone().any(|(_, chosen)| chosen.is_some());
        let mut cells = HashSet::new();
        for (edge, chosen) in bodies.flat_map(|(edges, chosen)| edges.iter().map(move |edge| (edge, chosen))) {
            if chosen == Some(edge.candidate) {
                let inliers = edge.points.iter().zip(&edge.weights).filter(|(_, weight)| **weight > 0.0);
                inliers.for_each(|(point, _)| cells.extend(cells_at(*point, cell_px)));
            } else if !is_limb {
                edge.border.iter().for_each(|p| cells.extend(cells_at([p.x.into(), p.y.into()], cell_px)));
            }
        }
        Self { size, cells: cells.into_iter().collect(), is_limb }
    }
}

fn cell_px(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).div_ceil(CELLS).max(LEAST_CELL_PX)
}

/// Returns the cell of a point, and those that it would be in if it moved by a quarter of a cell.
fn cells_at([u, v]: Point, cell_px: u32) -> HashSet<Cell> {
    let side = f64::from(cell_px);
    let by = side / 4.0;
    let cell = |u: f64, v: f64| [u, v].map(|x| ((x + 0.5) / side).clamp(0.0, 255.0) as u8);
    [[0.0, 0.0], [by, 0.0], [-by, 0.0], [0.0, by], [0.0, -by]].map(|[a, b]| cell(u + a, v + b)).into()
}

/// How often each cell has an edge, over the pictures of a sequence. Its memory is bounded by the number of cells.
#[derive(Debug, Clone, Default)]
pub struct SteadyEdges {
    size: [u32; 2],
    other: HashMap<Cell, u32>,
    limb: HashMap<Cell, u32>,
    pictures: u32,
    answers: u32,
}

/// An edge that stays, as an area to mask.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyArea {
    /// Corners in pixels.
    pub polygon: Vec<Point>,
    /// Part of the pictures without an answer in which the edge is there, from 0 to 1: that of its middle cell.
    pub part: f64,
    /// Number of pictures with edges and without an answer.
    pub pictures: u32,
}

impl SteadyEdges {
    /// Adds a picture. Pictures without an edge, or of another size, do not count.
    pub fn add(&mut self, picture: &EdgeCells) {
        if self.pictures + self.answers == 0 {
            self.size = picture.size;
        }
        if self.size != picture.size || picture.cells.is_empty() {
            return;
        }
        let (counts, number) = match picture.is_limb {
            true => (&mut self.limb, &mut self.answers),
            false => (&mut self.other, &mut self.pictures),
        };
        *number += 1;
        picture.cells.iter().for_each(|cell| *counts.entry(*cell).or_default() += 1);
    }

    /// Returns the largest edge that stays while the limb moves, if there is one that the mask has room for.
    pub fn find(&self, masked: &Polygons) -> Option<SteadyArea> {
        let most = self.limb.values().max().copied().unwrap_or(0);
        let moves = f64::from(most) <= MOVING * f64::from(self.answers);
        if self.pictures < PICTURES || self.answers < ANSWERS || !moves || masked.len() >= MOST_POLYGONS {
            return None;
        }
        let part = |count: u32| f64::from(count) / f64::from(self.pictures);
        let mut left: HashSet<Cell> =
            self.other.iter().filter(|(_, count)| part(**count) >= STEADY).map(|(cell, _)| *cell).collect();
        let mut largest: Vec<Cell> = Vec::new();
        while let Some(first) = left.iter().min().copied() {
            let connected = take_connected(&mut left, first);
            if connected.len() > largest.len() {
                largest = connected;
            }
        }
        if largest.len() < LEAST_CELLS {
            return None;
        }
        let polygon = self.around(&largest);
        let picture = f64::from(self.size[0]) * f64::from(self.size[1]);
        let mut counts: Vec<u32> = largest.iter().filter_map(|cell| self.other.get(cell)).copied().collect();
        counts.sort_unstable();
        let middle = counts.get(counts.len() / 2).copied().unwrap_or(0);
        let area = SteadyArea { polygon, part: part(middle), pictures: self.pictures };
        (area_px(&area.polygon) <= LARGEST * picture).then_some(area)
    }

    /// Returns a polygon around cells: the intersection of the half-planes that contain them, in as many directions as
    /// a polygon may have corners.
    fn around(&self, cells: &[Cell]) -> Vec<Point> {
        let side = f64::from(cell_px(self.size));
        let corners: Vec<Point> = cells
            .iter()
            .flat_map(|[x, y]| {
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
                    .map(|[a, b]| [(f64::from(*x) + a) * side - 0.5, (f64::from(*y) + b) * side - 0.5])
            })
            .collect();
        let direction = |n: usize| (std::f64::consts::TAU * n as f64 / CORNERS as f64).sin_cos();
        let reach = |n: usize| {
            let (sin, cos) = direction(n);
            corners.iter().map(|[x, y]| x * cos + y * sin).fold(f64::NEG_INFINITY, f64::max)
        };
        // Two neighbouring lines x cos a + y sin a = reach meet in a corner.
        let corner = |n: usize| {
            let ((sin_a, cos_a), (sin_b, cos_b)) = (direction(n), direction(n + 1));
            let (a, b, turn) = (reach(n), reach((n + 1) % CORNERS), cos_a * sin_b - sin_a * cos_b);
            [(a * sin_b - b * sin_a) / turn, (b * cos_a - a * cos_b) / turn]
        };
        let mut polygon: Vec<Point> = Vec::new();
        for p in (0..CORNERS).map(corner) {
            // Where the outline has no line in a direction, two corners are one.
            if polygon.last().is_none_or(|last| (last[0] - p[0]).hypot(last[1] - p[1]) > 0.5) {
                polygon.push(p);
            }
        }
        polygon
    }
}

/// Takes the cells out of a set that are connected with one of them, also over corners.
fn take_connected(left: &mut HashSet<Cell>, first: Cell) -> Vec<Cell> {
    let (mut found, mut open) = (Vec::new(), vec![first]);
    left.remove(&first);
    while let Some([x, y]) = open.pop() {
        found.push([x, y]);
        let around = |c: u8| c.saturating_sub(1)..=c.saturating_add(1);
        let next: Vec<Cell> =
            around(x).flat_map(|x| around(y).map(move |y| [x, y])).filter(|cell| left.remove(cell)).collect();
        open.extend(next);
    }
    found
}

/// Returns the area of a polygon in square pixels. Source: the shoelace formula.
fn area_px(polygon: &[Point]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs() / 2.0
}

#[cfg(test)]
mod tests {
    use hzn_core::pixel::Pixel;

    use super::*;
    use crate::model::mask::is_inside;

    const SIZE: [u32; 2] = [640, 480];

    /// Returns an edge along a line, as border pixels and as points with a weight.
    fn edge(candidate: u32, from: [u16; 2], to: [u16; 2], weight: f64) -> Edge {
        // A border has every pixel.
        let length = [0, 1].map(|i| from[i].abs_diff(to[i])).into_iter().max().unwrap_or(0).max(1);
        let at = |n: u16, i: usize| {
            let [from, to, n, length] = [from[i], to[i], n, length].map(f64::from);
            (from + (to - from) * n / length).round() as u16
        };
        let border: Vec<Pixel> = (0..=length).map(|n| Pixel { x: at(n, 0), y: at(n, 1) }).collect();
        let points: Vec<Point> = border.iter().map(|p| [p.x.into(), p.y.into()]).collect();
        Edge { candidate, weights: vec![weight; points.len()], points, border, ..Edge::default() }
    }

    fn add(steady: &mut SteadyEdges, edges: &[Edge], chosen: Option<u32>) {
        steady.add(&EdgeCells::of(SIZE, std::iter::once((edges, chosen))));
    }

    /// Counts 20 answers with a limb at a height that depends on the picture, and 20 pictures without an answer. Most
    /// of these show a boom, but every `missing`-th does not.
    fn seen(limb_y: impl Fn(u16) -> u16, missing: u16) -> SteadyEdges {
        let mut steady = SteadyEdges::default();
        for n in 0..20 {
            let y = limb_y(n);
            add(&mut steady, &[edge(0, [20, y], [600, y], 1.0)], Some(0));
            let jump = n % 2;
            let boom = edge(1, [500 + jump, 300], [560, 400 + jump], 0.0);
            let cloud = edge(2, [50, 20 * n], [90, 20 * n], 0.0);
            if n % missing == 0 { add(&mut steady, &[cloud], None) } else { add(&mut steady, &[cloud, boom], None) }
        }
        steady
    }

    #[test]
    fn an_edge_that_stays_while_the_limb_moves_is_offered() {
        let area = seen(|n| 40 + 10 * n, 10).find(&Vec::new()).unwrap();
        assert_eq!((area.part, area.pictures), (0.9, 20));
        assert!(area.polygon.len() <= CORNERS);
        for p in [[501.0, 302.0], [530.0, 350.0], [559.0, 399.0]] {
            assert!(is_inside(&area.polygon, p), "{p:?} {:?}", area.polygon);
        }
        for p in [[300.0, 100.0], [480.0, 300.0], [580.0, 400.0]] {
            assert!(!is_inside(&area.polygon, p), "{p:?} {:?}", area.polygon);
        }
        // It is there in too few pictures.
        assert_eq!(seen(|n| 40 + 10 * n, 3).find(&Vec::new()), None);
        // The mask has no room for another polygon.
        assert_eq!(seen(|n| 40 + 10 * n, 10).find(&vec![Vec::new(); MOST_POLYGONS]), None);
    }

    #[test]
    fn a_limb_that_does_not_move_tells_nothing_about_edges() {
        assert_eq!(seen(|_| 100, 10).find(&Vec::new()), None);
        // Without answers nothing shows whether the camera turns.
        let mut steady = SteadyEdges::default();
        for _ in 0..20 {
            add(&mut steady, &[edge(1, [500, 300], [560, 400], 0.0)], None);
        }
        assert_eq!(steady.find(&Vec::new()), None);
    }

    #[test]
    fn a_frame_around_the_picture_is_too_large_to_be_masked() {
        let mut steady = SteadyEdges::default();
        for n in 0..12 {
            add(&mut steady, &[edge(0, [20, 40 + 10 * n], [600, 40 + 10 * n], 1.0)], Some(0));
            let around = [edge(1, [5, 5], [5, 470], 0.0), edge(2, [5, 470], [630, 470], 0.0)];
            add(&mut steady, &around, None);
        }
        assert_eq!(steady.find(&Vec::new()), None);
    }
}
