//! Conversion of the annotations of a picture to Foxglove's image annotations and back.

use foxglove::messages::points_annotation::Type;
use foxglove::messages::{Color, ImageAnnotations, KeyValuePair, Point2, PointsAnnotation, TextAnnotation};
use hzn_core::camera;
use hzn_core::status::Status;
use prost::Message;

use crate::frame::Annotations;
use crate::messages::stamp;
use crate::palette;
use crate::row::Row;

/// Foxglove's pixel coordinates begin at the corner of the top-left pixel, those of hzn at its centre.
const CENTRE_TO_CORNER_PX: f64 = 0.5;

/// Meaning and look of an annotation's lines and points. The metadata `kind` has the meaning.
#[derive(Debug, Clone, Copy)]
struct Style {
    kind: &'static str,
    shape: Type,
    color: [u8; 3],
    /// Line width in pens; for points half of their width.
    thickness: f64,
}
const AXIS: Style = Style { kind: "axis", shape: Type::LineList, color: palette::AXIS, thickness: 1.25 };
const LIMB: Style = Style { kind: "limb", shape: Type::LineStrip, color: palette::LIMB, thickness: 2.0 };
const EDGE: Style = Style { kind: "edge", shape: Type::LineStrip, color: palette::EDGE, thickness: 0.5 };
const REJECTED: Style = Style { kind: "rejected", shape: Type::Points, color: palette::REJECTED, thickness: 1.0 };
const INLIER: Style = Style { kind: "inlier", shape: Type::Points, color: palette::INLIER, thickness: 0.5 };
/// Half the length of the cross at the axis, in pens.
const CROSS: f64 = 9.0;
/// Height of the letters, in pens.
const LETTERS: f64 = 12.0;
/// Distance from one line of text to the next, in pens.
const LINE: f64 = 14.0;

/// Returns the width of a pen, in pixels of the picture: a line that is visible if the whole picture is shown on a part
/// of a screen.
pub(crate) fn pen_px(camera: Option<&camera::Config>) -> f64 {
    camera.map_or(1.0, |c| f64::from(c.width.max(c.height)) / 800.0)
}

/// Describes the answer to a picture in one line of text.
pub(crate) fn caption(row: &Row) -> String {
    let mut text = row.status.name().to_owned();
    if row.status == Status::Ok {
        if let Some(sigma) = row.sigma_max_deg {
            text += &format!("  sigma {sigma:.3} deg");
        }
        if let Some(rms) = row.rms_px {
            text += &format!("  rms {rms:.2} px");
        }
        if let (Some(inliers), Some(points)) = (row.inliers, row.edge_points) {
            text += &format!("  {inliers} of {points}");
        }
    } else if !row.detail.is_empty() {
        text += &format!(": {}", row.detail);
    }
    text
}

/// Draws lines, points, and the captions of the bodies from the top left corner. An earlier line is above a later one;
/// points are above all lines. `pen_px` is the width of a pen in pixels of the picture.
pub(crate) fn annotations(a: &Annotations, captions: &[String], pen_px: f64, ns: u64) -> ImageAnnotations {
    let mut points = Vec::new();
    let mut draw = |style: Style, xy: &[[f64; 2]]| {
        if xy.is_empty() {
            return;
        }
        let color = Some(rgb(style.color));
        points.push(PointsAnnotation {
            timestamp: stamp(ns),
            r#type: style.shape as i32,
            points: xy
                .iter()
                .map(|&[x, y]| Point2 { x: x + CENTRE_TO_CORNER_PX, y: y + CENTRE_TO_CORNER_PX })
                .collect(),
            outline_color: color,
            fill_color: color.filter(|_| style.shape == Type::Points),
            thickness: style.thickness * pen_px,
            metadata: vec![KeyValuePair { key: "kind".into(), value: style.kind.into() }],
            ..PointsAnnotation::default()
        });
    };
    let cross = CROSS * pen_px;
    for &[x, y] in &a.axes {
        draw(AXIS, &[[x - cross, y], [x + cross, y], [x, y - cross], [x, y + cross]]);
    }
    a.limb.iter().for_each(|line| draw(LIMB, line));
    a.edges.iter().for_each(|line| draw(EDGE, line));
    draw(REJECTED, &a.rejected);
    draw(INLIER, &a.inliers);
    let text = |(line, text): (u32, &String)| TextAnnotation {
        timestamp: stamp(ns),
        position: Some(Point2 { x: 4.0 * pen_px, y: f64::from(line) * LINE * pen_px }),
        text: text.clone(),
        font_size: LETTERS * pen_px,
        text_color: Some(rgb([255; 3])),
        background_color: Some(Color { a: 0.6, ..rgb([0; 3]) }),
        ..TextAnnotation::default()
    };
    let texts = (1..).zip(captions).map(text).collect();
    ImageAnnotations { timestamp: stamp(ns), points, texts, ..ImageAnnotations::default() }
}

fn rgb(color: [u8; 3]) -> Color {
    let [r, g, b] = color.map(|c| f64::from(c) / 255.0);
    Color { r, g, b, a: 1.0 }
}

/// Reads the lines and points of a message of hzn.
pub(crate) fn parse(data: &[u8]) -> Result<Annotations, prost::DecodeError> {
    let message = ImageAnnotations::decode(data)?;
    let mut a = Annotations::default();
    for p in message.points {
        let kind = p.metadata.iter().find(|m| m.key == "kind").map_or("", |m| m.value.as_str());
        let mut xy: Vec<[f64; 2]> =
            p.points.iter().map(|p| [p.x - CENTRE_TO_CORNER_PX, p.y - CENTRE_TO_CORNER_PX]).collect();
        match kind {
            "edge" => a.edges.push(xy),
            "limb" => a.limb.push(xy),
            "inlier" => a.inliers.append(&mut xy),
            "rejected" => a.rejected.append(&mut xy),
            // The centre of the cross is midway between the ends of an arm.
            "axis" => {
                if let [[x0, y], [x1, _], ..] = xy[..] {
                    a.axes.push([(x0 + x1) / 2.0, y]);
                }
            }
            _ => {}
        }
    }
    Ok(a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::RowMeta;

    #[test]
    fn foxglove_counts_from_the_corner() {
        // The centre of the top-left pixel is (0, 0) in hzn and (0.5, 0.5) in Foxglove.
        let a = Annotations {
            edges: vec![vec![[0.0, 0.0], [1.0, 2.25]]],
            inliers: vec![[10.0, 20.0]],
            rejected: vec![[3.5, -0.5]],
            limb: vec![vec![[5.0, 5.0], [6.0, 5.5]], vec![[7.0, 8.0], [9.0, 9.0]]],
            axes: vec![[7.0, 8.0], [100.0, 50.0]],
        };
        for pen_px in [0.5, 1.0, 2.5] {
            let m = annotations(&a, &[], pen_px, 0);
            let points = |kind: &str| m.points.iter().filter(|p| p.metadata[0].value == kind).collect::<Vec<_>>();
            assert_eq!(points("edge")[0].points, [Point2 { x: 0.5, y: 0.5 }, Point2 { x: 1.5, y: 2.75 }]);
            let cross = &points("axis")[1].points;
            let mid = |f: fn(&Point2) -> f64| cross.iter().map(f).sum::<f64>() / 4.0;
            assert_eq!((mid(|p| p.x), mid(|p| p.y)), (100.5, 50.5));
            assert_eq!(parse(&m.encode_to_vec()).unwrap(), a);
        }
    }

    #[test]
    fn an_inlier_hides_neither_limb_nor_edge() {
        let line = vec![[0.0, 0.0], [9.0, 9.0]];
        let a = Annotations { limb: vec![line.clone()], inliers: line, ..Annotations::default() };
        let width = |m: &ImageAnnotations, kind: &str| {
            let p = m.points.iter().find(|p| p.metadata[0].value == kind).unwrap();
            p.thickness * if p.r#type == Type::Points as i32 { 2.0 } else { 1.0 }
        };
        for camera in [(384, 288), (1920, 1080)] {
            let camera = camera::Config::ideal(camera::Model::Pinhole, camera.0, camera.1, 400.0);
            let m = annotations(&a, &[], pen_px(Some(&camera)), 0);
            assert!(width(&m, "inlier") <= 0.5 * width(&m, "limb"));
            assert!(width(&m, "inlier") < 0.002 * f64::from(camera.width));
        }
    }

    #[test]
    fn the_answer_is_written_in_the_picture() {
        let meta = RowMeta { index: 0, file: "a.png".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let mut row = Row::unprocessed(&meta, Status::Unreadable, "cut off");
        assert_eq!(caption(&row), "unreadable: cut off");
        (row.status, row.sigma_max_deg, row.rms_px) = (Status::Ok, Some(0.0149), Some(0.1));
        (row.inliers, row.edge_points) = (Some(426), Some(430));
        assert_eq!(caption(&row), "ok  sigma 0.015 deg  rms 0.10 px  426 of 430");
        let m = annotations(&Annotations::default(), &[caption(&row), "moon  no-limb".into()], 2.0, 0);
        let at: Vec<f64> = m.texts.iter().map(|t| t.position.as_ref().unwrap().y).collect();
        assert_eq!(at, [28.0, 56.0]);
        assert_eq!(parse(&m.encode_to_vec()).unwrap(), Annotations::default());
    }
}
