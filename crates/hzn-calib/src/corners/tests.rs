//! Corners in small drawn pictures. The tests of the workspace use pictures of an independent renderer.

use super::*;
use crate::board::Board;
use crate::draws::Draws;

const BOARD: Board = Board { columns: 9, rows: 6, square_mm: 30.0 };
const SIZE: [usize; 2] = [480, 360];

/// A drawn board: `to_px` maps board coordinates in squares to pixels; the corner (0, 0) is at the origin.
struct Drawing {
    columns: u16,
    rows: u16,
    square_px: f64,
    /// Homography from board coordinates in squares to pixels, by rows.
    to_px: nalgebra::Matrix3<f64>,
}

impl Drawing {
    /// Makes a board with squares of `square_px` about `middle`, turned by `turn_rad`, with some perspective.
    fn new(columns: u16, rows: u16, middle: [f64; 2], square_px: f64, turn_rad: f64) -> Self {
        let (sin, cos) = turn_rad.sin_cos();
        let (s, tilt) = (square_px, 0.02);
        let centre = nalgebra::Matrix3::new(
            1.0,
            0.0,
            -0.5 * f64::from(columns - 1),
            0.0,
            1.0,
            -0.5 * f64::from(rows - 1),
            0.0,
            0.0,
            1.0,
        );
        let view =
            nalgebra::Matrix3::new(s * cos, -s * sin, middle[0], s * sin, s * cos, middle[1], 0.0, tilt / 40.0, 1.0);
        Self { columns, rows, square_px, to_px: view * centre }
    }

    /// Returns the place of a corner in the picture, px.
    fn corner_px(&self, column: u16, row: u16) -> [f64; 2] {
        let p = self.to_px * nalgebra::Vector3::new(f64::from(column), f64::from(row), 1.0);
        [p.x / p.z, p.y / p.z]
    }

    /// Draws the board on a grey wall, with edges that are 3 px wide and some noise.
    fn draw(&self, [width, height]: [usize; 2]) -> Grey {
        let back = self.to_px.try_inverse().unwrap();
        let square_px = self.square_px;
        let mut draws = Draws(3);
        // A wave of squares: from −1 to 1 over the width of an edge.
        let wave = |x: f64| {
            let part = x - x.floor();
            let from_edge = (part.min(1.0 - part) * square_px / 1.5).min(1.0);
            let sign = if x.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
            sign * from_edge * (1.5 - 0.5 * from_edge * from_edge)
        };
        let mut brightness = |n: usize| {
            let p = back * nalgebra::Vector3::new((n % width) as f64, (n / width) as f64, 1.0);
            let (a, b) = (p.x / p.z + 1.0, p.y / p.z + 1.0);
            let inside = |x: f64, corners: u16| x >= 0.0 && x < f64::from(corners) + 1.0;
            let is_board = inside(a, self.columns) && inside(b, self.rows);
            let light = if is_board { 125.0 - 85.0 * wave(a) * wave(b) } else { 130.0 };
            (light + 1.5 * draws.normal()) as f32
        };
        Grey::try_new(width, height, (0..width * height).map(&mut brightness).collect()).unwrap()
    }

    /// Returns the distance from a place to the nearest corner, px.
    fn nearest_px(&self, [u, v]: [f64; 2]) -> f64 {
        let each = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        each.map(|(column, row)| self.corner_px(column, row))
            .map(|[a, b]| (a - u).hypot(b - v))
            .fold(f64::MAX, f64::min)
    }
}

/// Returns a picture with the pixels of a disc replaced.
fn cover(picture: &Grey, [u, v]: [f64; 2], radius: f64) -> Grey {
    let mut values = Vec::new();
    for y in 0..picture.height() {
        for (x, value) in picture.row(y).iter().enumerate() {
            let is_covered = (x as f64 - u).hypot(y as f64 - v) < radius;
            values.push(if is_covered { 90.0 } else { *value });
        }
    }
    Grey::try_new(picture.width(), picture.height(), values).unwrap()
}

#[test]
fn a_whole_board_is_numbered_from_the_upper_left() {
    for turn_deg in [0.0, 20.0, -35.0] {
        let drawing = Drawing::new(9, 6, [240.0, 180.0], 32.0, f64::to_radians(turn_deg));
        let found = find_corners(&drawing.draw(SIZE), &BOARD).unwrap();
        assert_eq!((found.corners.len(), found.size), (54, [9, 6]));
        for c in &found.corners {
            let [u, v] = drawing.corner_px(c.column, c.row);
            let off_px = (c.at_px[0] - u).hypot(c.at_px[1] - v);
            assert!(off_px < 0.1, "{turn_deg} {c:?}: {off_px} px");
        }
    }
}

#[test]
fn turned_and_mirrored_boards_keep_the_sense_of_rotation() {
    for (turn_deg, sign) in [(90.0, 1.0), (180.0, 1.0), (250.0, 1.0), (0.0, -1.0)] {
        let mut drawing = Drawing::new(9, 6, [180.0, 240.0], 24.0, f64::to_radians(turn_deg));
        if sign < 0.0 {
            let mirror = nalgebra::Matrix3::new(-1.0, 0.0, 359.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
            drawing.to_px = mirror * drawing.to_px;
        }
        let found = find_corners(&drawing.draw([360, 480]), &BOARD).unwrap();
        assert_eq!(found.corners.len(), 54);
        let at = |column, row| found.corners.iter().find(|c| (c.column, c.row) == (column, row)).unwrap().at_px;
        let (o, x, y) = (at(0, 0), at(8, 0), at(0, 5));
        let turn = (x[0] - o[0]) * (y[1] - o[1]) - (x[1] - o[1]) * (y[0] - o[0]);
        assert!(turn > 0.0, "{turn_deg}: columns × rows turns from u to v");
        assert!(found.corners.iter().all(|c| drawing.nearest_px(c.at_px) < 0.1));
    }
}

#[test]
fn a_part_of_a_board_is_found() {
    // The right border cuts three columns.
    let drawing = Drawing::new(9, 6, [380.0, 180.0], 32.0, 0.1);
    let found = find_corners(&drawing.draw(SIZE), &BOARD).unwrap();
    let inside = (0..54).filter(|n| {
        let [u, v] = drawing.corner_px(n % 9, n / 9);
        (8.0..471.0).contains(&u) && (8.0..351.0).contains(&v)
    });
    let inside = inside.count();
    assert!(
        found.corners.len() >= inside && found.size[0] < 9,
        "{} of {inside}, {:?}",
        found.corners.len(),
        found.size
    );
    assert!(found.corners.iter().all(|c| drawing.nearest_px(c.at_px) < 0.15));
    // A disc hides corners in the middle.
    let drawing = Drawing::new(9, 6, [240.0, 180.0], 32.0, 0.1);
    let (middle, radius) = (drawing.corner_px(5, 2), 40.0);
    let found = find_corners(&cover(&drawing.draw(SIZE), middle, radius), &BOARD).unwrap();
    assert!((42..54).contains(&found.corners.len()), "{}", found.corners.len());
    for c in &found.corners {
        assert!(drawing.nearest_px(c.at_px) < 0.15, "{c:?}");
        assert!((c.at_px[0] - middle[0]).hypot(c.at_px[1] - middle[1]) > radius, "{c:?} is hidden");
    }
    // A small part does not count.
    let drawing = Drawing::new(9, 6, [580.0, 180.0], 32.0, 0.0);
    let why = find_corners(&drawing.draw(SIZE), &BOARD).unwrap_err();
    assert!(matches!(why, NotFound::SmallPart { of: 54, .. } | NotFound::Nothing), "{why:?}");
}

#[test]
fn a_board_of_another_size_is_named() {
    let find = |columns, rows, square_px| {
        find_corners(&Drawing::new(columns, rows, [240.0, 180.0], square_px, 0.1).draw(SIZE), &BOARD)
    };
    assert_eq!(find(7, 7, 30.0).unwrap_err(), NotFound::OtherSize { found: [7, 7], board: [9, 6] });
    let why = find(11, 8, 28.0).unwrap_err();
    assert_eq!(
        why.to_string(),
        "the picture shows a chessboard with 11 x 8 inner corners, but the board has 9 x 6; check --board"
    );
    // A smaller board cannot be told from a part of the right one by one picture.
    assert_eq!(find(8, 5, 32.0).unwrap().size, [8, 5]);
}

#[test]
fn large_pictures_are_searched_in_a_smaller_copy() {
    let drawing = Drawing::new(9, 6, [1300.0, 1000.0], 170.0, 0.2);
    let found = find_corners(&drawing.draw([2600, 2000]), &BOARD).unwrap();
    assert_eq!(found.corners.len(), 54);
    assert!(found.corners.iter().all(|c| drawing.nearest_px(c.at_px) < 0.1));
}

#[test]
fn pictures_without_a_board_say_so() {
    let mut draws = Draws(8);
    let mut picture = |w: usize, h: usize, value: &mut dyn FnMut(usize, usize, f64) -> f32| {
        let values = (0..w * h).map(|n| value(n % w, n / w, draws.normal())).collect();
        find_corners(&Grey::try_new(w, h, values).unwrap(), &BOARD)
    };
    assert_eq!(picture(300, 200, &mut |_, _, noise| (100.0 + 20.0 * noise) as f32), Err(NotFound::Nothing));
    assert_eq!(picture(300, 200, &mut |_, _, _| 7.0), Err(NotFound::Nothing));
    assert_eq!(picture(300, 200, &mut |x, _, _| if x / 20 % 2 == 0 { 0.0 } else { 200.0 }), Err(NotFound::Nothing));
    assert_eq!(picture(300, 200, &mut |x, y, _| if x * y % 3 == 0 { f32::NAN } else { 5.0 }), Err(NotFound::Nothing));
    for (w, h) in [(0, 0), (1, 1), (5, 900), (17, 17)] {
        assert_eq!(picture(w, h, &mut |x, y, _| (x + y) as f32), Err(NotFound::Nothing), "{w} x {h}");
    }
    assert!(NotFound::Nothing.to_string().contains("squares of at least 8 pixels"));
    assert_eq!(Grey::try_new(3, 2, vec![0.0; 5]), None);
}
