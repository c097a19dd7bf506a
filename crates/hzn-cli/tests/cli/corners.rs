//! Corners of chessboards in pictures of an independent renderer (`tests/python/boards.py`) and in real pictures.

use std::path::{Path, PathBuf};

use hzn_calib::board::Board;
use hzn_calib::corners::{Found, Grey, find_corners};

const BOARD: Board = Board { columns: 9, rows: 6, square_mm: 30.0 };
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data");

fn find(path: &Path) -> Found {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).to_luma8();
    let values = picture.as_raw().iter().map(|v| f32::from(*v)).collect();
    let grey = Grey::try_new(picture.width() as usize, picture.height() as usize, values).unwrap();
    find_corners(&grey, &BOARD).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

/// A rendered picture: its file, its true corners in pixels, and which of them are visible.
type Truth = (PathBuf, Vec<[f64; 2]>, Vec<bool>);

fn truths(lens: &str) -> Vec<Truth> {
    let folder = Path::new(DATA).join("boards-rendered").join(lens);
    let text = std::fs::read(folder.join("truth.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let view = |v: &serde_json::Value| {
        let corners = v["corners_px"].as_array().unwrap().iter();
        let corners = corners.map(|c| [c[0].as_f64().unwrap(), c[1].as_f64().unwrap()]).collect();
        let visible = v["visible"].as_array().unwrap().iter().map(|v| v.as_bool().unwrap()).collect();
        (folder.join(v["file"].as_str().unwrap()), corners, visible)
    };
    truth["views"].as_array().unwrap().iter().map(view).collect()
}

#[test]
fn rendered_corners_are_found_where_they_are() {
    for lens in ["pinhole60", "fisheye94", "fisheye150"] {
        let (mut squares, mut count) = (0.0, 0);
        for (path, corners, visible) in truths(lens) {
            let found = find(&path);
            let off_px = |at: [f64; 2], n: usize| (at[0] - corners[n][0]).hypot(at[1] - corners[n][1]);
            let mut seen = vec![false; corners.len()];
            for c in &found.corners {
                let nearest = (0..corners.len()).min_by(|a, b| off_px(c.at_px, *a).total_cmp(&off_px(c.at_px, *b)));
                let n = nearest.unwrap();
                assert!(off_px(c.at_px, n) < 1.0 && !seen[n], "{}: {c:?} is no corner", path.display());
                seen[n] = true;
                if visible[n] {
                    squares += off_px(c.at_px, n).powi(2);
                    count += 1;
                }
            }
            let missed = visible.iter().zip(&seen).filter(|(visible, seen)| **visible && !**seen).count();
            assert_eq!(missed, 0, "{}", path.display());
        }
        let rms_px = (squares / f64::from(count)).sqrt();
        println!("{lens}: {count} corners, RMS error {rms_px:.4} px");
        assert!(rms_px < 0.03, "{lens}: {rms_px}");
    }
}

#[test]
fn every_real_board_is_found_whole() {
    let mut pictures = 0;
    for file in std::fs::read_dir(Path::new(DATA).join("boards")).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|e| e == "jpg") {
            assert_eq!((find(&path).corners.len(), find(&path).size), (54, [9, 6]), "{}", path.display());
            pictures += 1;
        }
    }
    assert_eq!(pictures, 13);
}
