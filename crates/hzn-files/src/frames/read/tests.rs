//! Tests of the reader of a frames.csv.

use hzn_core::body::{self, PriorError};

use super::*;
use crate::frames::{Unused, schema};

fn read(text: &str) -> Result<Frames, String> {
    parse(text, Path::new("frames.csv")).map_err(|e| e.to_string())
}

#[test]
fn columns_by_name_and_empty_cells() {
    let f = read("altitude_km,file,utc,note\n230,a.png,1970-01-01T00:00:02Z,x\n,b.png,,\n").unwrap();
    assert_eq!(f.get("a.png").unwrap().altitude_km, Some(230.0));
    assert_eq!(f.get("a.png").unwrap().time_s, Some(2.0));
    assert_eq!(f.get("b.png").unwrap().altitude_km, None);
    assert!(f.get("c.png").is_none());
    assert_eq!(f.warnings[0].to_string(), "frames.csv:1: note: unknown column, not used");
}

#[test]
fn only_the_rows_of_the_pictures_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("frames.csv");
    let load = |text: &str| {
        std::fs::write(&path, text).unwrap();
        load_for(&path, ["./b.png".to_owned(), "c.png".to_owned()])
    };
    let text = "\u{feff}file,time_s,altitude_km\na.png,0,230\nb.png,,\n./a.png,1,5\nd.png,2,\ne.png,3,\nf.png,4,\n";
    let frames = load(text).unwrap();
    assert_eq!(frames.rows.len(), 1);
    assert!(frames.get("b.png").is_some() && frames.get("a.png").is_none());
    assert_eq!((frames.unused.rows, frames.unused.first.len()), (5, Unused::LISTED));
    assert_eq!((frames.unused.first[0].file.as_str(), frames.unused.first[0].line), ("a.png", 2));
    // What the whole table knows does not depend on the pictures that are processed.
    assert!(frames.has_times() && frames.has_distances());
    // A wrong row is an error, whatever picture it is for.
    assert!(load("file,time_s\na.png,x\n").unwrap_err().to_string().contains("not a finite number"));
    assert!(load("file\nb.png\n./b.png\n").unwrap_err().to_string().contains("is also in line 2"));
    assert!(parse(text, &path).unwrap_err().to_string().contains("is also in line 2"));
    let everything = parse("file\na.png\nb.png\n", &path).unwrap();
    assert_eq!((everything.rows.len(), everything.unused.rows), (2, 0));
}

/// An attitude that is no rotation is a problem of its row, not of the file.
#[test]
fn each_body_has_its_own_orientation() {
    let header = "file,qw,qx,qy,qz,range_km,range_sigma_km,q_enceladus_w,q_enceladus_x,q_enceladus_y,q_enceladus_z";
    let f = read(&format!("{header},pole_saturn_x,pole_saturn_y,pole_saturn_z\na,2,0,0,0,9,1,1,0,0,0,0,0,1\n"));
    let f = f.unwrap();
    assert!(f.warnings.is_empty(), "{:?}", f.warnings);
    let (row, of_kind) = (f.get("a").unwrap(), |kind| body::Config::of_kind(kind, None));
    assert_eq!(row.for_body(0, &of_kind(Kind::Jupiter)).unwrap_err(), PriorError::Attitude);
    let enceladus = row.for_body(1, &of_kind(Kind::Enceladus)).unwrap();
    assert_eq!((enceladus.q_fixed_from_camera_wxyz, enceladus.range_km), (Some([1.0, 0.0, 0.0, 0.0]), None));
    let saturn = row.for_body(2, &of_kind(Kind::Saturn)).unwrap();
    assert_eq!((saturn.q_fixed_from_camera_wxyz, saturn.pole_camera), (None, Some([0.0, 0.0, 1.0])));
    assert!(read("file,pole_x,pole_y,pole_z\na,0,0,0\n").unwrap_err().contains("pole_z: has no direction"));
    let other = "file,pole_saturn_x,pole_saturn_y,pole_saturn_z\na,0,0,0\n";
    assert!(read(other).unwrap_err().contains("pole_saturn_z: has no direction"));
    assert!(read("file,q_vulcan_w\na,1\n").unwrap().warnings[0].to_string().contains("unknown column"));
}

#[test]
fn wrong_cells_name_row_and_column() {
    assert_eq!(
        read("file,altitude_km\na.png,230\nb.png,NaN\n").unwrap_err(),
        "frames.csv:3: b.png altitude_km: \"NaN\" is not a finite number; leave the cell empty if it is not known"
    );
    assert_eq!(
        read("file,x_km,y_km,z_km\na.png,1,,3\n").unwrap_err(),
        "frames.csv:2: a.png y_km: missing: x_km, y_km, z_km belong together"
    );
    assert_eq!(
        read("file\na.png\na.png\n").unwrap_err(),
        "frames.csv:3: a.png file: is also in line 2; each picture has only one row"
    );
    assert_eq!(
        read("name,altitude\na,1\n").unwrap_err(),
        "frames.csv:1: the column `file` is missing (found: name, altitude); it names the picture of each row"
    );
    assert!(read("").unwrap_err().starts_with("frames.csv: is empty; its first line names the columns"));
    assert_eq!(
        read("file,time_s\na\n").unwrap_err(),
        "frames.csv:2: this row has 1 cells, but the header has 2 columns"
    );
    assert!(read("file,sun_x,sun_y,sun_z\na,0,0,0\n").unwrap_err().contains("sun_x, sun_y, sun_z: has no direction"));
    // Spreadsheet programs of some countries write semicolons and decimal commas.
    assert!(read("file;altitude_km\r\na;1,5\r\n").unwrap_err().contains("separated by commas here, not by semicolons"));
    assert!(read("file\taltitude_km\n").unwrap_err().contains("not by tabs"));
    assert!(
        read("file,altitude_km\na,\"400,5\"\n").unwrap_err().contains("\"400,5\" has a decimal comma; write a point")
    );
}

#[test]
fn the_rows_of_a_vehicle_belong_to_times() {
    let read = |text: &str| parse_vehicle(text, Path::new("frames.csv")).map_err(|e| e.to_string());
    let f = read("time_s,altitude_km\n1,500\n2,501\n4,503\n").unwrap();
    let nearest = |time_s: f64| f.nearest(time_s, 0.4).and_then(|row| row.altitude_km);
    let got = [0.7, 1.4, 1.5, 1.7, 3.0, 4.3, 9.0].map(nearest);
    assert_eq!(got, [Some(500.0), Some(500.0), None, Some(501.0), None, Some(503.0), None]);
    assert!(f.has_priors() && !read("file,utc\na,1970-01-01T00:00:02Z\n").unwrap().has_priors());
    // Pictures of two heads may have the same name.
    assert_eq!(read("file,time_s\na,1\na,2\n").unwrap().rows.len(), 2);
    let later = "time_s: 2 is not later than the row before it; sort the rows by time";
    assert_eq!(read("file,time_s\na,2\nb,2\n").unwrap_err(), format!("frames.csv:3: b: {later}"));
    assert!(read("file,time_s\na,\n").unwrap_err().ends_with("a row of a vehicle needs its time"));
    assert!(read("altitude_km\n1\n").unwrap_err().ends_with("the rows of a vehicle belong to times"));
}

#[test]
fn rates_go_to_the_prior() {
    let f = read("file,altitude_km,rate_x,rate_y,rate_z\na.png,230,0.1,-0.2,0.3\nb.png,230,,,\n").unwrap();
    assert_eq!(f.rows[0].to_prior::<f64>(None).rate_rad_s, Some([0.1, -0.2, 0.3]));
    assert_eq!(f.rows[1].to_prior::<f64>(None).rate_rad_s, None);
}

#[test]
fn the_documents_have_every_column() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../book/reference");
    let read = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    let written: serde_json::Value = serde_json::from_str(&read("frames.schema.json")).unwrap();
    assert!(written == schema(), "the columns of frames.csv changed: run `cargo xtask keys`");
    let page = read("files.md");
    for column in COLUMNS {
        assert!(page.contains(&format!("| `{column}`")) || page.contains(&format!(", `{column}`")), "{column}");
    }
}

#[test]
fn a_latitude_is_told_how_a_position_is_written() {
    let read = read("file,lat,longitude_deg,lateral\na,1,2,3\n").unwrap();
    let texts: Vec<String> = read.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(texts.iter().filter(|text| text.contains("x_km, y_km, z_km (ECEF")).count(), 3, "{texts:?}");
}
