//! Grows the grid of a chessboard from one corner to the next.

use std::collections::HashMap;

use super::ring::Candidate;

/// Largest distance of a corner from its predicted place, as a part of the step to it. Strong perspective changes a
/// step by a fifth from one square to the next, and the second nearest corner is a whole step away.
const MAX_MISS: f32 = 0.35;
/// Largest change of an edge's direction from one corner to the next, in radians (26°).
const MAX_TURN: f32 = 0.45;
/// Half-width of the cone in which the first neighbours are looked for, as a part of their distance.
const CONE: f32 = 0.35;

/// Column and row; negative ones lie left of and above the first corner.
type Cell = (i32, i32);

/// The steps to the four neighbours of a cell.
const STEPS: [Cell; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// A corner of the grid.
#[derive(Debug, Clone, Copy)]
struct Node {
    candidate: usize,
    at: [f32; 2],
    /// Unit vectors along rows (growing column) and along columns (growing row).
    axes: [[f32; 2]; 2],
}

/// A corner of a finished grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridCorner {
    /// Column and row, from 0.
    pub(super) cell: [usize; 2],
    /// Place in the picture that was searched, in pixels.
    pub(super) at: [f32; 2],
    /// Unit vectors along its row and its column.
    pub(super) axes: [[f32; 2]; 2],
    /// Distance to the nearest neighbour, in pixels.
    pub(super) spacing: f32,
}

/// A grid of corners.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    nodes: HashMap<Cell, Node>,
}

impl Grid {
    /// Grows a grid from one candidate.
    pub(super) fn grow(candidates: &[Candidate], seed: usize) -> Self {
        let mut grid = Self::default();
        let Some(first) = candidates.get(seed) else { return grid };
        let mut axes = first.edges;
        if cross(axes[0], axes[1]) < 0.0 {
            axes[1] = axes[1].map(|x| -x);
        }
        grid.nodes.insert((0, 0), Node { candidate: seed, at: first.at, axes });
        let mut used = vec![false; candidates.len()];
        used[seed] = true;
        let mut border = vec![(0, 0)];
        while !border.is_empty() {
            let mut next = Vec::new();
            for cell in border {
                for step in STEPS {
                    let to = (cell.0 + step.0, cell.1 + step.1);
                    if grid.nodes.contains_key(&to) {
                        continue;
                    }
                    if let Some(node) = grid.find(candidates, &used, cell, step) {
                        used[node.candidate] = true;
                        grid.nodes.insert(to, node);
                        next.push(to);
                    }
                }
            }
            // A cell that was not found from one side may be found from another side later.
            border = if next.is_empty() { Vec::new() } else { grid.open_cells() };
        }
        grid
    }

    /// Returns the cells with an empty neighbour.
    fn open_cells(&self) -> Vec<Cell> {
        let is_open = |cell: &&Cell| STEPS.iter().any(|s| !self.nodes.contains_key(&(cell.0 + s.0, cell.1 + s.1)));
        let mut cells: Vec<Cell> = self.nodes.keys().filter(is_open).copied().collect();
        // The order of a hash map changes from run to run; the result must not.
        cells.sort_unstable();
        cells
    }

    /// Looks for the neighbour of a cell in one direction.
    fn find(&self, candidates: &[Candidate], used: &[bool], cell: Cell, step: Cell) -> Option<Node> {
        let from = self.nodes.get(&cell)?;
        let parity = (cell.0 + step.0 + cell.1 + step.1).rem_euclid(2) as usize;
        let open = candidates.iter().enumerate().filter(|(n, _)| !used[*n]);
        let matching = open.filter_map(|(n, c)| {
            let axes = matching_axes(c, parity, &from.axes)?;
            Some(Node { candidate: n, at: c.at, axes })
        });
        match self.predict(cell, step, from.at) {
            Some(to) => {
                let limit = MAX_MISS * distance(to, from.at);
                let near = matching.map(|node| (distance(node.at, to), node)).filter(|(miss, _)| *miss < limit);
                near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, node)| node)
            }
            None => {
                let along = if step.0 != 0 { from.axes[0] } else { from.axes[1] };
                let sign = (step.0 + step.1) as f32;
                let ahead = matching.filter_map(|node| {
                    let way = [node.at[0] - from.at[0], node.at[1] - from.at[1]];
                    let forward = sign * (way[0] * along[0] + way[1] * along[1]);
                    (forward > 0.0 && cross(along, way).abs() < CONE * forward).then_some((forward, node))
                });
                ahead.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, node)| node)
            }
        }
    }

    /// Predicts the place of a neighbour: along the row by the last three corners or two, else by the step of the row
    /// next to it; `None` if nothing is known.
    fn predict(&self, (i, j): Cell, (di, dj): Cell, from: [f32; 2]) -> Option<[f32; 2]> {
        let at = |k: i32, side: Cell| self.nodes.get(&(i + k * di + side.0, j + k * dj + side.1)).map(|n| n.at);
        match (at(-1, (0, 0)), at(-2, (0, 0))) {
            (Some(p), Some(q)) => return Some([0, 1].map(|k| 3.0 * (from[k] - p[k]) + q[k])),
            (Some(p), None) => return Some([0, 1].map(|k| 2.0 * from[k] - p[k])),
            _ => {}
        }
        [(dj, di), (-dj, -di)].into_iter().find_map(|side| {
            let (p, q) = (at(0, side)?, at(1, side)?);
            Some([0, 1].map(|k| from[k] + q[k] - p[k]))
        })
    }

    /// Returns the number of corners.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }
    /// Returns the candidates of the grid.
    pub(super) fn candidates(&self) -> impl Iterator<Item = usize> + '_ {
        self.nodes.values().map(|n| n.candidate)
    }

    /// Removes outer rows and columns that have fewer than half of their corners, as long as the grid is larger than
    /// the board. Reflections and patterns next to the board add such rows.
    pub(super) fn trim(&mut self, size: [usize; 2]) {
        loop {
            let Some([(left, right), (top, bottom)]) = self.ends() else { return };
            let (columns, rows) = ((right - left + 1) as usize, (bottom - top + 1) as usize);
            let fits = |c: usize, r: usize| c <= size[0] && r <= size[1];
            if fits(columns, rows) || fits(rows, columns) {
                return;
            }
            let count = |axis: usize, value: i32| {
                self.nodes.keys().filter(|cell| if axis == 0 { cell.0 == value } else { cell.1 == value }).count()
            };
            let lines = [(0, left, rows), (0, right, rows), (1, top, columns), (1, bottom, columns)];
            let sparse =
                lines.into_iter().map(|(axis, value, of)| (count(axis, value) as f32 / of as f32, axis, value));
            let Some((_, axis, value)) = sparse.filter(|l| l.0 < 0.5).min_by(|a, b| a.0.total_cmp(&b.0)) else {
                return;
            };
            self.nodes.retain(|cell, _| if axis == 0 { cell.0 != value } else { cell.1 != value });
        }
    }

    /// Returns the distance from a corner to the nearest of its neighbours, in pixels.
    fn spacing(&self, cell: Cell, at: [f32; 2]) -> f32 {
        let neighbours = STEPS.iter().filter_map(|s| self.nodes.get(&(cell.0 + s.0, cell.1 + s.1)));
        neighbours.map(|n| distance(n.at, at)).fold(f32::MAX, f32::min)
    }

    fn ends(&self) -> Option<[(i32, i32); 2]> {
        let ends = |of: fn(&Cell) -> i32| Some((self.nodes.keys().map(of).min()?, self.nodes.keys().map(of).max()?));
        Some([ends(|c| c.0)?, ends(|c| c.1)?])
    }

    /// Returns number of columns and rows, and the corners ordered by row, then by column.
    pub(super) fn corners(&self) -> ([usize; 2], Vec<GridCorner>) {
        let Some([(left, right), (top, bottom)]) = self.ends() else { return ([0; 2], Vec::new()) };
        let corner = |(cell, node): (&Cell, &Node)| GridCorner {
            cell: [(cell.0 - left) as usize, (cell.1 - top) as usize],
            at: node.at,
            axes: node.axes,
            spacing: self.spacing(*cell, node.at),
        };
        let mut corners: Vec<GridCorner> = self.nodes.iter().map(corner).collect();
        corners.sort_unstable_by_key(|c| (c.cell[1], c.cell[0]));
        ([(right - left + 1) as usize, (bottom - top + 1) as usize], corners)
    }
}

/// Returns the axes of a candidate with the signs of its neighbour's; `None` if its edges have other directions. The
/// first edge runs along the rows at every second corner: bright and dark squares change places from one corner to the
/// next.
fn matching_axes(candidate: &Candidate, parity: usize, near: &[[f32; 2]; 2]) -> Option<[[f32; 2]; 2]> {
    let mut axes = [candidate.edges[parity], candidate.edges[1 - parity]];
    for (axis, near) in axes.iter_mut().zip(near) {
        let cos = axis[0] * near[0] + axis[1] * near[1];
        if cos.abs() < MAX_TURN.cos() {
            return None;
        }
        if cos < 0.0 {
            *axis = axis.map(|x| -x);
        }
    }
    Some(axes)
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
