//! Compares the follower with a plain reference on adversarial pictures.
//!
//! The reference knows nothing of searches, marks and runs. It lists all cracks: the sides between a lit pixel and a
//! dark one. Each crack has exactly one successor, so the cracks form closed paths, and every path is one edge. Sides
//! against the outside of the picture belong to paths too, but they are no edge: they cut a path into open edges.

use super::*;

/// A side of the lit pixel `at` towards its dark 4-neighbour in the direction `dark`: 0 east, 1 north, 2 west, 3 south.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Crack {
    at: (i32, i32),
    dark: usize,
}

/// Steps to the 4-neighbours, counter-clockwise on the screen from east.
const SIDES: [(i32, i32); 4] = [(1, 0), (0, -1), (-1, 0), (0, 1)];

fn plus(a: (i32, i32), b: (i32, i32)) -> (i32, i32) {
    (a.0 + b.0, a.1 + b.1)
}

impl Bitmap {
    fn contains(&self, (x, y): (i32, i32)) -> bool {
        x >= 0 && y >= 0 && x < i32::from(self.w) && y < i32::from(self.h)
    }

    fn is_lit(&self, at: (i32, i32)) -> bool {
        self.contains(at) && self.data[at.1 as usize * usize::from(self.w) + at.0 as usize] >= 128
    }

    /// Returns the next crack, with the lit side on the left. Lit pixels that touch at a corner are connected.
    fn successor(&self, Crack { at, dark }: Crack) -> Crack {
        let way = SIDES[(dark + 1) % 4];
        let (ahead, across) = (plus(at, way), plus(plus(at, SIDES[dark]), way));
        if self.is_lit(across) {
            Crack { at: across, dark: (dark + 3) % 4 }
        } else if self.is_lit(ahead) {
            Crack { at: ahead, dark }
        } else {
            Crack { at, dark: (dark + 1) % 4 }
        }
    }

    /// Returns all open and all closed edges as the reference sees them.
    fn reference(&self) -> Edges {
        let mut left = BTreeSet::new();
        for at in (0..i32::from(self.h)).flat_map(|y| (0..i32::from(self.w)).map(move |x| (x, y))) {
            let sides = (0..4).filter(|&dark| self.is_lit(at) && !self.is_lit(plus(at, SIDES[dark])));
            left.extend(sides.map(|dark| Crack { at, dark }));
        }
        let mut edges = Edges::default();
        while let Some(&first) = left.first() {
            let mut path = Vec::new();
            let mut crack = first;
            while left.remove(&crack) {
                path.push(crack);
                crack = self.successor(crack);
            }
            assert_eq!(crack, first, "a path of cracks is closed");
            edges.add(path, |c| !self.contains(plus(c.at, SIDES[c.dark])));
        }
        edges.sorted()
    }

    /// Returns all open and all closed edges that the search finds: first along the border of the picture, then on
    /// search lines.
    fn searched(&self, spacing: u16) -> Edges {
        let region = Region::<f64>::whole(self.w, self.h);
        let grey = self.grey();
        let binary = BinaryPicture::new(&grey, &region, 128, &Unobserved);
        let mut bits = vec![0u32; 1 << 14];
        let mut marks = Marks::new(&mut bits, self.w, self.h, spacing, spacing);
        let (mut buffer, mut edges) = (vec![Pixel::default(); 1 << 15], Edges::default());
        // An edge touches each side of a pixel once, so this many steps always suffice.
        let bound = 4 * u32::from(self.w) * u32::from(self.h) * (work::LOOK_AROUND + work::RUN + work::READ);
        let points = |edge: &Thinned<'_>| edge.pixels().iter().map(|p| (p.x, p.y)).collect::<Points>();
        binary.each_start(1, &mut |start| {
            let (mut edge, mut steps) = (Thinned::new(&mut buffer), bound);
            assert_eq!(binary.follow(start.pixel, start.dark, &mut edge, &mut marks, &mut steps), End::Open);
            edges.open.push(points(&edge));
            true
        });
        for y in marks.rows(self.h) {
            binary.each_crossing(y, (0, self.w - 1), &mut marks, |start, dark, marks| {
                let (mut edge, mut steps) = (Thinned::new(&mut buffer), bound);
                match binary.follow(start, dark, &mut edge, marks, &mut steps) {
                    End::Closed { twice_area } => edges.closed.push((rotated(points(&edge)), twice_area)),
                    // The first pixel of an open edge gets no mark if the dark pixel before it is its western one. The
                    // edge is then met again at its very beginning; the pipeline does not judge what ends as open here.
                    End::Open => {
                        assert!(edges.open.contains(&points(&edge)), "a part of an edge at {start:?}");
                        assert_eq!((start.y, dark), (0, 4));
                    }
                    End::OutOfSteps => panic!("out of steps at {start:?}"),
                }
                true
            });
        }
        edges.sorted()
    }

    /// Compares the search with the reference: no edge is lost, doubled or different.
    #[track_caller]
    fn compare(&self, spacing: u16) -> usize {
        let (found, expected) = (self.searched(spacing), self.reference());
        if found != expected {
            let rows: Vec<std::string::String> = self
                .data
                .chunks(usize::from(self.w))
                .map(|row| row.iter().map(|v| if *v >= 128 { '#' } else { '.' }).collect())
                .collect();
            panic!("{}\nfound {found:?}\nexpected {expected:?}", rows.join("\n"));
        }
        found.open.len() + found.closed.len()
    }

    /// Returns a picture from a function of column and row.
    fn drawn(w: u16, h: u16, lit: impl Fn(u16, u16) -> bool) -> Self {
        let data = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| if lit(x, y) { 200 } else { 0 });
        Self { w, h, data: data.collect() }
    }
}

/// The edges of a picture.
#[derive(Debug, Default, PartialEq, Eq)]
struct Edges {
    open: Vec<Points>,
    /// The points, beginning at the smallest, and twice the enclosed area.
    closed: Vec<(Points, i64)>,
}

impl Edges {
    /// Adds the edges of a closed path of cracks. `is_outer` says that the dark side is outside of the picture.
    fn add(&mut self, mut path: Vec<Crack>, is_outer: impl Fn(&Crack) -> bool) {
        let Some(cut) = path.iter().position(&is_outer) else {
            let points = distinct(&path);
            let around = points.iter().zip(points.iter().cycle().skip(1));
            let step = |(a, b): (&(u16, u16), &(u16, u16))| {
                (i64::from(a.0) + i64::from(b.0)) * (i64::from(b.1) - i64::from(a.1))
            };
            let twice_area = around.map(step).sum();
            self.closed.push((rotated(points), twice_area));
            return;
        };
        path.rotate_left(cut);
        let pieces = path.split(is_outer).filter(|piece| !piece.is_empty());
        // A piece that ends at its first pixel passes it twice; the follower stores it twice too.
        self.open.extend(pieces.map(|piece| piece.chunk_by(|a, b| a.at == b.at).map(|same| pixel(&same[0])).collect()));
    }

    fn sorted(mut self) -> Self {
        self.open.sort();
        self.closed.sort();
        self
    }
}

fn pixel(crack: &Crack) -> (u16, u16) {
    (crack.at.0 as u16, crack.at.1 as u16)
}

/// Returns the pixels of a closed path. Neighbouring cracks of the same pixel count once.
fn distinct(path: &[Crack]) -> Points {
    let mut points: Points = path.chunk_by(|a, b| a.at == b.at).map(|same| pixel(&same[0])).collect();
    if points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    points
}

/// All pictures of 4x4 pixels, in every kind of surroundings: bare, in a dark frame, in a lit frame, and at a corner.
#[test]
fn every_picture_of_4x4_pixels_has_the_edges_of_the_reference() {
    let mut compared = 0;
    for bits in 0..=u16::MAX {
        let inner = |x: u16, y: u16| bits >> (4 * y + x) & 1 == 1;
        let inside = |x: u16, y: u16| (1..5).contains(&x) && (1..5).contains(&y);
        compared += Bitmap::drawn(4, 4, inner).compare(1);
        compared += Bitmap::drawn(6, 6, |x, y| inside(x, y) && inner(x - 1, y - 1)).compare(1);
        compared += Bitmap::drawn(6, 6, |x, y| !inside(x, y) || inner(x - 1, y - 1)).compare(1);
        compared += Bitmap::drawn(5, 5, |x, y| (x < 4 && y < 4) && inner(x, y)).compare(1);
    }
    assert!(compared > 500_000, "{compared}");
}

/// The same pictures, enlarged, so that the follower goes in runs between the search lines.
#[test]
fn every_enlarged_picture_has_the_edges_of_the_reference() {
    for bits in (0..=u16::MAX).step_by(7) {
        let lit = |x: u16, y: u16| bits >> (4 * (y / 6) + x / 6) & 1 == 1;
        let framed = |x: u16, y: u16| (4..28).contains(&x) && (4..28).contains(&y) && lit(x - 4, y - 4);
        Bitmap::drawn(24, 24, lit).compare(4);
        Bitmap::drawn(32, 32, framed).compare(4);
    }
}

/// Returns a spiral whose arms are two pixels wide: nearly all of its edge is one long line.
fn spiral(side: u16) -> Bitmap {
    let middle = f64::from(side) / 2.0;
    Bitmap::drawn(side, side, |x, y| {
        let (dx, dy) = (f64::from(x) - middle, f64::from(y) - middle);
        (dx.hypot(dy) - dy.atan2(dx) * 2.0 / core::f64::consts::PI).rem_euclid(4.0) < 2.0
    })
}

#[test]
fn long_and_crowded_edges_are_those_of_the_reference() {
    for side in [8, 33, 64, 101] {
        let coil = spiral(side);
        let longest = coil.reference().open.iter().map(Vec::len).max();
        assert!(longest > Some(usize::from(side) * 2), "{longest:?}");
        coil.compare(1);
        Bitmap::drawn(side, side, |x, y| !coil.is_lit((x.into(), y.into()))).compare(1);
        for teeth in 1..4 {
            Bitmap::drawn(side, side, |x, y| x / teeth % 2 == 0 || y == 0).compare(1);
            Bitmap::drawn(side, side, |x, y| y / teeth % 2 == 0 || x == side - 1).compare(1);
            Bitmap::drawn(side, side, |x, y| (x / teeth + y / teeth) % 2 == 0).compare(1);
            Bitmap::drawn(side, side, |x, y| (x / teeth + y / teeth) % 2 == 1).compare(1);
        }
        // A winding edge of the greatest length: teeth of one pixel from above and from below.
        Bitmap::drawn(side, side, |x, y| (x % 4 < 1 && y + 1 < side) || (x % 4 == 2 && y > 0)).compare(1);
    }
}

#[test]
fn noise_of_every_density_has_the_edges_of_the_reference() {
    for density in 0..=100 {
        for (seed, (w, h)) in [(31, 17), (64, 64), (5, 90), (90, 5)].into_iter().enumerate() {
            random_bitmap(w, h, density, u32::from(density) * 8 + seed as u32).compare(1);
        }
    }
}
