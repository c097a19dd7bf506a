//! The table of the residuals of a lens calibration: `residuals.csv`.
//!
//! | column | unit | meaning |
//! |---|---|---|
//! | `file` | | the picture |
//! | `u_px`, `v_px` | px | measured place; pixel centres are at integers |
//! | `error_u_px`, `error_v_px` | px | measured minus projected place |
//! | `counts` | | 0 for an outlier, else 1 |
//! | `column`, `row` | | corner on the chessboard, from 0; empty for other points |

use std::path::{Path, PathBuf};

use hzn_files::unix_lines::UnixLines;
use hzn_files::{Problem, limited};
use serde::{Deserialize, Serialize};

use crate::calibrated::{Calibrated, Residual};

/// Name of the table next to pictures.
const NAME: &str = "residuals.csv";
/// The columns with which the first line of the file begins. Column and row of the corner are missing in older tables.
const HEADER: &str = "file,u_px,v_px,error_u_px,error_v_px,counts";

#[derive(Serialize, Deserialize)]
struct Line {
    file: String,
    u_px: f64,
    v_px: f64,
    error_u_px: f64,
    error_v_px: f64,
    counts: u8,
    #[serde(default)]
    column: Option<u16>,
    #[serde(default)]
    row: Option<u16>,
}

/// Returns the table of all pictures that count.
///
/// # Errors
/// None in practice: a number cannot be written.
pub fn write(calibrated: &Calibrated) -> Result<String, csv::Error> {
    let mut out = csv::Writer::from_writer(Vec::new());
    for view in calibrated.views.iter().filter(|v| v.dropped.is_none()) {
        for r in &view.residuals {
            let ([u_px, v_px], [error_u_px, error_v_px]) = (r.at_px, r.error_px);
            let counts = u8::from(r.counts);
            let [column, row] = [0, 1].map(|side| r.corner.map(|corner| corner[side]));
            let file = view.name.clone();
            out.serialize(Line { file, u_px, v_px, error_u_px, error_v_px, counts, column, row })?;
        }
    }
    let bytes = out.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Returns the table next to pictures, if their folder has one.
pub fn find(folder: &Path) -> Option<PathBuf> {
    Some(folder.join(NAME)).filter(|path| is_table(path))
}

/// Returns whether a file has the columns of this table. A file that cannot be read has not.
pub fn is_table(path: &Path) -> bool {
    use std::io::Read;
    let mut begin = vec![0; HEADER.len()];
    std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut begin)).is_ok() && begin == HEADER.as_bytes()
}

/// Reads a table: the name of the picture and the residual of each line.
///
/// # Errors
/// The file cannot be read, or a line has an impossible value. The error names the line.
pub fn read(path: &Path) -> Result<Vec<(String, Residual)>, Problem> {
    let refuse = |what: String| Problem::new(path, what);
    let text = limited::read_text(path, limited::TABLE_BYTES).map_err(|e| refuse(format!("cannot be read: {e}")))?;
    let mut out = Vec::new();
    for line in csv::Reader::from_reader(UnixLines::new(text.as_bytes())).deserialize::<Line>() {
        let l = line.map_err(|e| {
            let at = e.position().map(csv::Position::line);
            let problem = refuse(format!("{e}; write the table again with `hzn calibrate … -o residuals.csv`"));
            at.map_or_else(|| problem.clone(), |n| problem.clone().at_line(n as usize))
        })?;
        let residual = Residual {
            at_px: [l.u_px, l.v_px],
            error_px: [l.error_u_px, l.error_v_px],
            counts: l.counts != 0,
            corner: l.column.zip(l.row).map(<[u16; 2]>::from),
        };
        if residual.at_px.iter().chain(&residual.error_px).any(|x| !x.is_finite()) {
            return Err(refuse("has a number that is not finite".into()).at_line(out.len() + 2));
        }
        out.push((l.file, residual));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_tables_are_refused_with_their_line() {
        let dir = tempfile::tempdir().unwrap();
        let file = |text: &str| {
            std::fs::write(dir.path().join(NAME), text).unwrap();
            dir.path().join(NAME)
        };
        let path = file(&format!("{HEADER}\na.png,1,2,0.5,-0.25,1\n\"b, c.png\",3,4,9,9,0\n"));
        assert_eq!(find(dir.path()), Some(path.clone()));
        let rows = read(&path).unwrap();
        let first = Residual { at_px: [1.0, 2.0], error_px: [0.5, -0.25], counts: true, corner: None };
        assert_eq!(rows[0], ("a.png".into(), first));
        assert_eq!((rows[1].0.as_str(), rows[1].1.counts), ("b, c.png", false));
        let path = file(&format!("{HEADER},column,row\na.png,1,2,0.5,-0.25,1,8,5\na.png,1,2,0.5,-0.25,1,,\n"));
        assert_eq!(find(dir.path()), Some(path.clone()));
        assert_eq!(read(&path).unwrap().iter().map(|(_, r)| r.corner).collect::<Vec<_>>(), [Some([8, 5]), None]);
        let why = read(&file(&format!("{HEADER}\na.png,1,2,0,0,1\na.png,1,x,0,0,1\n"))).unwrap_err();
        assert_eq!(why.line, Some(3), "{why}");
        let why = read(&file(&format!("{HEADER}\na.png,1,inf,0,0,1\n"))).unwrap_err();
        assert_eq!(why.line, Some(2), "{why}");
        assert_eq!(find(file("file,time_s\n").parent().unwrap()), None);
        assert!(read(&dir.path().join("none.csv")).is_err());
    }
}
