use super::*;
use crate::geometry::pixel::Pixel;
use crate::image::region::Region;
use crate::image::{Grey, Layout};
use crate::model::observer::Unobserved;
use crate::model::work;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::vec;
use std::vec::Vec;

mod reference;

type Points = Vec<(u16, u16)>;

struct Bitmap {
    w: u16,
    h: u16,
    data: Vec<u8>,
}

impl Bitmap {
    /// Reads rows of '#' and '.', and adds a dark frame of one pixel, because OpenCV counts the outside as dark.
    fn framed(rows: &[&str]) -> Self {
        let (w, h) = (rows[0].len() + 2, rows.len() + 2);
        let mut data = vec![0; w * h];
        for (y, row) in rows.iter().enumerate() {
            for (x, c) in row.bytes().enumerate() {
                data[(y + 1) * w + x + 1] = if c == b'#' { 200 } else { 10 };
            }
        }
        Self { w: w as u16, h: h as u16, data }
    }

    fn grey(&self) -> Grey<'_, u8> {
        Grey::try_new(&self.data, Layout::packed(u32::from(self.w), u32::from(self.h), 1, 8)).unwrap()
    }

    /// Returns every closed edge that search lines at a spacing find: (points, twice the area).
    fn closed(&self, spacing: u16) -> Vec<(Points, i64)> {
        let region = Region::<f64>::whole(self.w, self.h);
        let grey = self.grey();
        let binary = BinaryPicture::new(&grey, &region, 128, &Unobserved);
        let mut bits = vec![0u32; 4096];
        let mut marks = Marks::new(&mut bits, self.w, self.h, spacing, spacing);
        let (mut buffer, mut steps) = (vec![Pixel::default(); 4096], 1_000_000);
        let mut edges = Vec::new();
        for y in marks.rows(self.h) {
            binary.each_crossing(y, (0, self.w - 1), &mut marks, |start, dark, marks| {
                let mut edge = Thinned::new(&mut buffer);
                match binary.follow(start, dark, &mut edge, marks, &mut steps) {
                    End::Closed { twice_area } => {
                        edges.push((edge.pixels().iter().map(|p| (p.x, p.y)).collect(), twice_area));
                    }
                    other => panic!("{other:?}"),
                }
                true
            });
        }
        edges
    }

    fn open(&self) -> Vec<Points> {
        let region = Region::<f64>::whole(self.w, self.h);
        let grey = self.grey();
        let binary = BinaryPicture::new(&grey, &region, 128, &Unobserved);
        let mut bits = vec![0u32; 4096];
        let mut marks = Marks::new(&mut bits, self.w, self.h, 1, 1);
        let (mut buffer, mut steps) = (vec![Pixel::default(); 4096], 1_000_000);
        let mut edges = Vec::new();
        binary.each_start(1, &mut |start| {
            let mut edge = Thinned::new(&mut buffer);
            let end = binary.follow(start.pixel, start.dark, &mut edge, &mut marks, &mut steps);
            assert_eq!(end, End::Open);
            edges.push(edge.pixels().iter().map(|p| (p.x, p.y)).collect());
            true
        });
        edges
    }
}

/// Compares with `tests/golden/contours.json`: OpenCV 5.0 `findContours`, RETR_CCOMP, CHAIN_APPROX_NONE.
#[test]
fn outer_borders_equal_opencv_point_for_point() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../../../tests/golden/contours.json")).unwrap();
    let mut compared = 0;
    for case in golden["cases"].as_array().unwrap() {
        let rows: Vec<&str> = case["rows"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()).collect();
        let want: BTreeMap<(u16, u16), Points> = case["all_outer"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| {
                let points: Points = serde_json::from_value::<Vec<(u16, u16)>>(c.clone())
                    .unwrap()
                    .into_iter()
                    .map(|(x, y)| (x + 1, y + 1))
                    .collect();
                (points[0], points)
            })
            .collect();
        let all = Bitmap::framed(&rows).closed(1);
        let got: BTreeMap<(u16, u16), Points> =
            all.iter().filter(|(_, area)| *area <= 0).map(|(p, _)| (p[0], p.clone())).collect();
        assert_eq!(got, want, "{}", case["id"]);
        assert_eq!(all.len() - got.len(), case["holes"].as_array().unwrap().len(), "{} holes", case["id"]);
        compared += got.len();
    }
    assert!(compared > 20, "{compared}");
}

#[test]
fn an_open_edge_ends_at_the_border() {
    // The sky is above, the ground below: one edge, from right to left, with the lit side on the left.
    let (w, h) = (6, 5);
    let data = (0..h * w).map(|i| if i / w >= 2 { 200 } else { 0 }).collect();
    let edges = Bitmap { w: 6, h: 5, data }.open();
    assert_eq!(edges, [(0..6).rev().map(|x| (x, 2)).collect::<Points>()]);
}

fn random_bitmap(w: u16, h: u16, density: u8, seed: u32) -> Bitmap {
    let mut rng = crate::base::rng::Rng::new(seed);
    let data =
        (0..u32::from(w) * u32::from(h)).map(|_| if rng.below(100) < u32::from(density) { 255 } else { 0 }).collect();
    Bitmap { w, h, data }
}

proptest! {
    /// Every edge ends. Its points are lit, and each touches a dark pixel or the border.
    #[test]
    fn points_are_lit_and_beside_the_dark(w in 2u16..40, h in 2u16..40, density in 0u8..=100, seed in 0u32..10_000) {
        let map = random_bitmap(w, h, density, seed);
        let lit = |x: i32, y: i32| {
            let place = || y as usize * usize::from(w) + x as usize;
            x >= 0 && y >= 0 && x < i32::from(w) && y < i32::from(h) && map.data[place()] >= 128
        };
        for edge in map.open() {
            for (x, y) in edge {
                let (x, y) = (i32::from(x), i32::from(y));
                prop_assert!(lit(x, y));
                let dark = (-1..=1).any(|dx| (-1..=1).any(|dy| !lit(x + dx, y + dy)));
                prop_assert!(dark);
            }
        }
    }

    /// The search with strides and the search pixel by pixel together find every start.
    #[test]
    fn no_start_is_passed_over(
        w in 3u16..40, h in 3u16..40, density in 5u8..=95, seed in 0u32..10_000, stride in 1u16..7, grain in 1u16..5,
    ) {
        let coarse = random_bitmap(w.div_ceil(grain), h.div_ceil(grain), density, seed);
        let at = |x: u16, y: u16| coarse.data[usize::from(y / grain * coarse.w + x / grain)];
        let data = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
        let map = Bitmap { w, h, data };
        let (grey, region) = (map.grey(), Region::<f64>::whole(w, h));
        let binary = BinaryPicture::new(&grey, &region, 128, &Unobserved);
        let key = |pixel: Pixel, dark: u8| (pixel.x, pixel.y, dark);
        let (mut all, mut found) = (BTreeSet::new(), BTreeSet::new());
        binary.each_start(1, &mut |s| { all.insert(key(s.pixel, s.dark)); true });
        binary.each_start(stride, &mut |s| { found.insert(key(s.pixel, s.dark)); true });
        binary.each_narrow_start(stride, &mut |s| { found.insert(key(s.pixel, s.dark)); true });
        prop_assert_eq!(&all, &found);
    }

    /// Open and closed edges together visit every lit pixel that has a dark 4-neighbour inside the picture.
    #[test]
    fn no_edge_is_missed(w in 3u16..24, h in 3u16..24, density in 5u8..=95, seed in 0u32..10_000) {
        let mut map = random_bitmap(w, h, density, seed);
        // With a dark frame, there are only closed edges.
        for y in 0..h { for x in 0..w {
            if x == 0 || y == 0 || x == w - 1 || y == h - 1 { map.data[usize::from(y * w + x)] = 0; }
        } }
        let seen: BTreeSet<(u16, u16)> = map.closed(1).into_iter().flat_map(|(p, _)| p).collect();
        let lit = |x: u16, y: u16| map.data[usize::from(y * w + x)] >= 128;
        for y in 1..h - 1 { for x in 1..w - 1 {
            if lit(x, y) && (!lit(x - 1, y) || !lit(x + 1, y) || !lit(x, y - 1) || !lit(x, y + 1)) {
                prop_assert!(seen.contains(&(x, y)), "{x} {y}");
            }
        } }
    }

    /// Runs between the search lines find the same edges as single steps.
    #[test]
    fn runs_follow_as_single_steps_do(seed in 0u32..10_000, scale in 3u16..12) {
        // Blobs must be large enough for runs: a coarse random bitmap is enlarged, and a few pixels are changed.
        let (w, h) = (120u16, 90u16);
        let mut rng = crate::base::rng::Rng::new(seed);
        let coarse: Vec<bool> = (0..40 * 40).map(|_| rng.below(100) < 45).collect();
        let data = (0..h)
            .flat_map(|y| (0..w).map(move |x| (x, y)))
            .map(|(x, y)| {
                let frame = x == 0 || y == 0 || x == w - 1 || y == h - 1;
                let lit = coarse[usize::from(y / scale) * 40 + usize::from(x / scale)] != (rng.below(100) < 3);
                if lit && !frame { 200 } else { 0 }
            })
            .collect();
        let map = Bitmap { w, h, data };
        let single: BTreeMap<Points, i64> = map
            .closed(1)
            .into_iter()
            .map(|(points, area)| (rotated(points), area))
            .collect();
        let in_runs = map.closed(16);
        prop_assert!(in_runs.iter().any(|(points, _)| points.len() > 30));
        for (points, area) in in_runs {
            let points = rotated(points);
            prop_assert_eq!(single.get(&points), Some(&area));
        }
    }
}

/// Rotates a closed edge so that it begins at its smallest point.
fn rotated(mut points: Points) -> Points {
    // An edge may pass its smallest point twice. Then the rotation that is smallest as a whole is used.
    let least = points.iter().min().copied();
    let best = (0..points.len())
        .filter(|&i| Some(points[i]) == least)
        .min_by_key(|&i| points[i..].iter().chain(&points[..i]).copied().collect::<Points>());
    points.rotate_left(best.unwrap_or(0));
    points
}

/// Makes a picture with a lit lower half under a frame of `px` dark pixels.
fn under_a_frame(px: u16) -> Bitmap {
    let (w, h) = (60u16, 50u16);
    let lit = |x: u16, y: u16| y >= 20 && x >= px && x < w - px && y < h - px;
    let data = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| if lit(x, y) { 200 } else { 0 }).collect();
    Bitmap { w, h, data }
}

#[test]
fn a_dark_frame_is_measured_and_nothing_else_is_one() {
    let frame = |map: &Bitmap, most: u16| {
        let region = Region::<f64>::whole(map.w, map.h);
        let grey = map.grey();
        BinaryPicture::new(&grey, &region, 100, &Unobserved)
            .dark_frame_px(most, &mut crate::model::work::WorkBudget::unlimited())
    };
    for px in 0..=9 {
        assert_eq!(frame(&under_a_frame(px), 8), if px <= 8 { px } else { 0 }, "{px}");
        assert_eq!(frame(&under_a_frame(px), 0), 0);
    }
    // A disc near the border of the picture makes no frame: the share of lit pixels grows gradually inwards.
    for (r, x0) in [(20i32, 25i32), (22, 30), (24, 30)] {
        let inside = |i: i32| (i % 60 - x0).pow(2) + (i / 60 - 25).pow(2) < r * r;
        let data = (0..60 * 50).map(|i| if inside(i) { 200 } else { 0 }).collect();
        assert_eq!(frame(&Bitmap { w: 60, h: 50, data }, 8), 0, "{r}");
    }
}
