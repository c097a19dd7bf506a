//! Drawing and editing the mask's polygons with the mouse.

use super::view::Point;

/// Largest number of corners of a polygon that sensor.toml allows.
pub const MAX_CORNERS: usize = 16;

/// Polygons as lists of corners.
pub type Polygons = Vec<Vec<Point>>;

/// Editing state: a polygon that is being drawn, or a corner that is being moved.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MaskEdit {
    /// Corners of the polygon that is being drawn.
    pub open: Vec<Point>,
    /// Corners that were taken back, the last one first.
    taken_back: Vec<Point>,
    grabbed: Option<(usize, usize)>,
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn corner_at(polygons: &Polygons, p: Point, reach: f64) -> Option<(usize, usize)> {
    let all = polygons.iter().enumerate().flat_map(|(i, c)| (0..c.len()).map(move |j| (i, j)));
    let near = |&(i, j): &(usize, usize)| distance(polygons[i][j], p);
    all.min_by(|a, b| near(a).total_cmp(&near(b))).filter(|at| near(at) <= reach)
}

/// Returns true if the point is inside the polygon, by the even-odd rule.
pub fn is_inside(polygon: &[Point], [x, y]: Point) -> bool {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges.filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]).count() % 2
        == 1
}

impl MaskEdit {
    /// Adds a corner at `p`. A click within `reach` of the first corner closes the polygon instead. The corner number
    /// [`MAX_CORNERS`] closes the polygon, too. Returns all polygons if a polygon was closed.
    pub fn click(&mut self, polygons: &Polygons, p: Point, reach: f64) -> Option<Polygons> {
        if self.open.len() >= 3 && self.open.first().is_some_and(|first| distance(*first, p) <= reach) {
            return self.close(polygons);
        }
        self.open.push(p);
        self.taken_back.clear();
        if self.open.len() == MAX_CORNERS { self.close(polygons) } else { None }
    }
    /// Closes the polygon if it has at least three corners; otherwise it stays open. Returns all polygons if it was
    /// closed.
    pub fn close(&mut self, polygons: &Polygons) -> Option<Polygons> {
        (self.open.len() >= 3).then(|| polygons.iter().cloned().chain([self.take_open()]).collect())
    }
    /// Takes the corners of the polygon that is being drawn.
    pub fn take_open(&mut self) -> Vec<Point> {
        self.taken_back.clear();
        std::mem::take(&mut self.open)
    }
    /// Takes the last corner of the polygon that is being drawn back. Returns false if there is none.
    pub fn undo_corner(&mut self) -> bool {
        let last = self.open.pop();
        self.taken_back.extend(last);
        last.is_some()
    }
    /// Returns true if a corner was taken back.
    pub fn can_redo(&self) -> bool {
        !self.taken_back.is_empty()
    }
    /// Adds the corner again that was taken back last. Returns false if there is none.
    pub fn redo_corner(&mut self) -> bool {
        let last = self.taken_back.pop();
        self.open.extend(last);
        last.is_some()
    }
    /// Grabs the corner within `reach` of `p`. Returns false if there is none.
    pub fn grab(&mut self, polygons: &Polygons, p: Point, reach: f64) -> bool {
        self.grabbed = corner_at(polygons, p, reach);
        self.grabbed.is_some()
    }
    /// Returns the polygons with the grabbed corner moved to `p`; `None` if no corner is grabbed.
    pub fn drag(&self, polygons: &Polygons, p: Point) -> Option<Polygons> {
        let (i, j) = self.grabbed?;
        let mut moved = polygons.clone();
        *moved.get_mut(i)?.get_mut(j)? = p;
        Some(moved)
    }
    /// Releases the grabbed corner.
    pub fn release(&mut self) {
        self.grabbed = None;
    }
    /// Returns true if a corner is grabbed.
    pub fn is_grabbing(&self) -> bool {
        self.grabbed.is_some()
    }
    /// Returns the polygons without the corner at `p`, or else without the polygon around `p`. A polygon with fewer
    /// than three corners is removed.
    pub fn remove(&self, polygons: &Polygons, p: Point, reach: f64) -> Option<Polygons> {
        let mut left = polygons.clone();
        if let Some((i, j)) = corner_at(polygons, p, reach) {
            left[i].remove(j);
            if left[i].len() < 3 {
                left.remove(i);
            }
            return Some(left);
        }
        let at = polygons.iter().position(|polygon| is_inside(polygon, p))?;
        left.remove(at);
        Some(left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Polygons {
        vec![vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]]
    }

    #[test]
    fn a_polygon_is_closed_on_its_first_corner() {
        let mut edit = MaskEdit::default();
        for p in [[20.0, 20.0], [30.0, 20.0], [30.0, 30.0]] {
            assert_eq!(edit.click(&square(), p, 2.0), None);
        }
        let polygons = edit.click(&square(), [21.0, 20.5], 2.0).unwrap();
        assert_eq!(polygons.len(), 2);
        assert_eq!(polygons[1], [[20.0, 20.0], [30.0, 20.0], [30.0, 30.0]]);
        assert!(edit.open.is_empty());
        // A polygon needs three corners.
        edit.click(&square(), [1.0, 1.0], 2.0);
        edit.click(&square(), [9.0, 1.0], 2.0);
        assert_eq!(edit.close(&square()), None);
        assert_eq!(edit.open.len(), 2, "so it stays open");
        assert!(edit.undo_corner() && edit.redo_corner() && !edit.redo_corner());
        assert_eq!(edit.open, [[1.0, 1.0], [9.0, 1.0]]);
    }

    #[test]
    fn the_last_corner_that_can_be_closes_it() {
        let mut edit = MaskEdit::default();
        let closed: Vec<_> =
            (0..MAX_CORNERS).filter_map(|i| edit.click(&vec![], [i as f64 * 10.0, 0.0], 2.0)).collect();
        assert_eq!((closed.len(), closed[0][0].len()), (1, MAX_CORNERS));
    }

    #[test]
    fn corners_are_moved_and_removed() {
        let mut edit = MaskEdit::default();
        assert!(!edit.grab(&square(), [5.0, 5.0], 2.0));
        assert!(edit.grab(&square(), [9.0, 9.0], 2.0));
        assert_eq!(edit.drag(&square(), [12.0, 13.0]).unwrap()[0][2], [12.0, 13.0]);
        edit.release();
        assert_eq!(edit.drag(&square(), [0.0, 0.0]), None);
        assert_eq!(edit.remove(&square(), [0.5, 0.0], 2.0).unwrap()[0].len(), 3);
        assert!(edit.remove(&square(), [5.0, 5.0], 2.0).unwrap().is_empty());
        assert_eq!(edit.remove(&square(), [50.0, 5.0], 2.0), None);
        let triangle = vec![vec![[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]];
        assert!(edit.remove(&triangle, [0.0, 0.0], 1.0).unwrap().is_empty());
    }
}
