//! Makes recordings for tests, and reads them.
#![allow(dead_code, reason = "each test file takes what it needs")]
#![allow(unreachable_pub, reason = "shared between test files")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hzn_core::camera;
use hzn_core::status::Status;
use hzn_files::FrameData;
use hzn_mcap::{
    Annotations, Attitude, CandidateEdge, Contents, EncodedImage, FrameRecord, ImageFormat, Index, IndexEntry,
    LogLevel, LogLine, Options, Place, Reader, Row, RowMeta, Stamp, Writer,
};

pub const SENSOR: &str = "preset = \"hzn\"\n";

pub fn options() -> Options {
    Options {
        sensor_toml: SENSOR.into(),
        metadata: BTreeMap::from([("hzn_version".to_owned(), "0.0.0".to_owned())]),
        camera: Some(camera::Config::ideal(camera::Model::Pinhole, 640, 480, 400.0)),
        ..Options::default()
    }
}

/// Returns frame `i`. Frames differ in most parts; every third has no answer, every fourth has no picture.
pub fn frame(i: u64) -> FrameRecord {
    let f = i as f64;
    let meta = RowMeta {
        index: i,
        file: format!("{i:04}.png"),
        time_s: Some(100.0 + f * 0.1),
        body: "earth".into(),
        altitude_km: Some(230.0),
    };
    let mut row = Row::unprocessed(&meta, Status::Unreadable, "cut off");
    if !i.is_multiple_of(3) {
        row.status = Status::Ok;
        row.detail.clear();
        (row.axis_x, row.axis_y, row.axis_z) = (Some(0.0), Some(0.6), Some(0.8));
        row.rms_px = Some(0.1 + f);
    }
    FrameRecord {
        row,
        stamp: Some(Stamp { time_ns: 100_000_000_000 + i * 100_000_000, frame_id: None }),
        candidates: vec![CandidateEdge {
            length_px: i as u32,
            points: 7,
            inliers: 5,
            rms_px: Some(0.25),
            verdict: "chosen".into(),
        }],
        image: (i % 4 != 1).then(|| EncodedImage {
            format: ImageFormat::Png,
            // The bytes do not compress, like those of a picture.
            bytes: (0..2000u64).map(|k| ((k * k * 2_654_435_761 + i * 40_503) >> 13) as u8).collect(),
        }),
        annotations: Annotations {
            edges: vec![vec![[0.0, f], [1.0, f]], vec![[5.0, 5.0], [6.0, 7.5]]],
            inliers: vec![[0.25, f]],
            rejected: vec![[3.0, 4.0]],
            limb: vec![vec![[0.0, 0.0], [1.0, 1.0]]],
            axes: vec![[320.0, 200.0]],
        },
        attitude: i
            .is_multiple_of(2)
            .then_some(Attitude { q_fixed_from_camera_wxyz: [0.5, 0.5, 0.5, 0.5], position_m: [6.6e6, f, 0.0] }),
        prior: FrameData { altitude_km: Some(230.0), position_km: Some([6601.0, f, 0.1]), ..FrameData::default() },
        log: vec![LogLine { level: LogLevel::Warning, message: format!("frame {i}") }],
    }
}

pub fn read(path: &Path) -> Vec<FrameRecord> {
    Reader::open(path, Contents::All).unwrap().map(Result::unwrap).collect()
}

pub fn write(path: &Path, frames: u64, batch: u64) -> PathBuf {
    let mut writer = Writer::create(path, &options()).unwrap();
    for i in 0..frames {
        writer.write(&frame(i)).unwrap();
        if i % batch == batch - 1 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap()
}

/// Returns everything that an index finds, and the index.
pub fn index(path: &Path) -> (Vec<Place>, Vec<(Row, FrameData)>, Index) {
    let (mut pictures, mut rows) = (vec![], vec![]);
    let mut index = Index::open(path).unwrap();
    while let Some(part) = index.next_part().unwrap() {
        for found in part {
            match found {
                IndexEntry::Picture(place) => pictures.push(place),
                IndexEntry::Report(_, row, candidates, prior) => {
                    assert_eq!(candidates, frame(row.index).candidates);
                    rows.push((*row, *prior));
                }
            }
        }
    }
    (pictures, rows, index)
}
