//! Results of equations 33 and 37 of Braun & Barf 2022, computed independently of this program with the paper's errata
//! corrected (book/theory/math.md). The tests and `cargo xtask reproduce` compare with these numbers.
//!
//! All values are three standard deviations in degrees. The camera is a level pinhole camera of 1920×1080 px, 200 km
//! above a sphere of 6371 km with its limb at 0 km. The edge errors are 1 px over 300 px. Roll is about the optical
//! axis, pitch is about the picture's horizontal.

/// By altitude (km), 94.4° wide: roll and pitch with a free half-angle (33), pitch with a known half-angle, overbound
/// (37).
pub const BY_ALTITUDE_KM: [(f64, [f64; 4]); 5] = [
    (50.0, [0.1298, 0.5744, 0.0978, 3.76]),
    (100.0, [0.1280, 0.5662, 0.0964, 2.65]),
    (200.0, [0.1247, 0.5506, 0.0936, 1.856]),
    (300.0, [0.1215, 0.5357, 0.0910, 1.502]),
    (500.0, [0.1155, 0.5077, 0.0861, 1.142]),
];

/// By field of view across the width (degrees), with the same columns.
pub const BY_FOV_DEG: [(f64, [f64; 4]); 6] = [
    (66.0, [0.1242, 0.7197, 0.0562, 2.72]),
    (82.0, [0.1244, 0.6039, 0.0753, 2.16]),
    (98.0, [0.1248, 0.5400, 0.0998, 1.78]),
    (114.0, [0.1252, 0.5166, 0.1337, 1.51]),
    (130.0, [0.1257, 0.5400, 0.1865, 1.32]),
    (146.0, [0.1262, 0.6500, 0.2849, 1.22]),
];

/// By number of rows of a 16:9 picture, 94.4° high: roll and pitch with a free half-angle.
pub const BY_ROWS: [(u16, [f64; 2]); 4] =
    [(270, [0.507, 1.93]), (540, [0.270, 1.06]), (1080, [0.1255, 0.526]), (2160, [0.0512, 0.227])];

/// By limb height (km), 94.4° high: roll and pitch with a free half-angle.
pub const BY_LIMB_HEIGHT_KM: [(f64, [f64; 2]); 4] =
    [(0.0, [0.1255, 0.5262]), (5.0, [0.1256, 0.5271]), (10.0, [0.1258, 0.5279]), (20.0, [0.1261, 0.5293])];
