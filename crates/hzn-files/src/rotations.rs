//! Rotations that a file has in another order or sense than the expected one.

/// How a quaternion was written that is read as w, x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// As it is read.
    AsRead,
    /// As x, y, z, w.
    ScalarLast,
    /// As the inverse rotation.
    Inverted,
    /// As the inverse rotation, with the scalar last.
    InvertedScalarLast,
}

impl Written {
    /// All ways, the likeliest first.
    pub const ALL: [Self; 4] = [Self::AsRead, Self::ScalarLast, Self::Inverted, Self::InvertedScalarLast];

    /// Returns the rotation that was meant by a quaternion that was read.
    ///
    /// ```
    /// use hzn_files::rotations::Written;
    ///
    /// // The file has x, y, z, w = 0.1, 0.2, 0.3, 0.9.
    /// assert_eq!(Written::ScalarLast.meant([0.1, 0.2, 0.3, 0.9]), [0.9, 0.1, 0.2, 0.3]);
    /// assert_eq!(Written::Inverted.meant([0.9, 0.1, 0.2, 0.3]), [0.9, -0.1, -0.2, -0.3]);
    /// ```
    #[must_use]
    pub fn meant(self, [w, x, y, z]: [f64; 4]) -> [f64; 4] {
        match self {
            Self::AsRead => [w, x, y, z],
            Self::ScalarLast => [z, w, x, y],
            Self::Inverted => [w, -x, -y, -z],
            Self::InvertedScalarLast => [z, -w, -x, -y],
        }
    }
}

/// The frames of a key `q_TO_from_FROM_wxyz`.
struct Frames<'a> {
    key: &'a str,
    to: &'a str,
    from: &'a str,
}

impl<'a> Frames<'a> {
    fn of(key: &'a str) -> Option<Self> {
        let (to, from) = key.strip_prefix("q_")?.strip_suffix("_wxyz")?.split_once("_from_")?;
        Some(Self { key, to, from })
    }
}

/// Returns what to do with a rotation whose key says another order or sense than the valid key `q_TO_from_FROM_wxyz`.
/// `None` if it says neither.
///
/// ```
/// use hzn_files::rotations::conversion;
///
/// let valid = ["q_vehicle_from_camera_wxyz"];
/// let text = conversion("q_vehicle_from_camera_xyzw", &valid).unwrap();
/// assert!(text.ends_with("the last number of yours becomes the first"), "{text}");
/// assert!(conversion("camera_from_vehicle", &valid).unwrap().ends_with("x, y and z of yours are negated"));
/// assert_eq!(conversion("rpy_deg", &valid), None);
/// ```
pub fn conversion(name: &str, valid: &[&str]) -> Option<String> {
    let name = name.to_lowercase();
    let says = |a: &str, b: &str| name.contains(&format!("{a}_from_{b}")) || name.contains(&format!("{b}_to_{a}"));
    let is_last = name.ends_with("xyzw");
    valid.iter().filter_map(|key| Frames::of(key)).find_map(|Frames { key, to, from }| {
        let what = match (says(to, from), says(from, to)) {
            (true, _) if is_last => "the last number of yours becomes the first",
            (true, _) => "its first number is w, the cosine of half the angle",
            (_, true) if is_last => "the last number of yours becomes the first, and the others are negated",
            (_, true) => "x, y and z of yours are negated",
            _ => return None,
        };
        Some(format!("write {key}; {what}"))
    })
}

/// Returns what a rotation in the form of angles or of a matrix is to be written as. `None` if the name is that of no
/// rotation, or if no rotation is valid there.
///
/// ```
/// use hzn_files::rotations::form;
///
/// let text = form("rpy_deg", &["q_vehicle_from_camera_wxyz"]).unwrap();
/// assert!(text.contains("from the axes of the camera into those of the vehicle"), "{text}");
/// assert_eq!(form("radius_km", &["q_vehicle_from_camera_wxyz"]), None);
/// ```
pub fn form(name: &str, valid: &[&str]) -> Option<String> {
    let words = ["rpy", "roll", "pitch", "yaw", "euler", "rot", "matrix", "dcm", "quat", "q_", "axis"];
    let name = name.to_lowercase();
    let Frames { key, to, from } = valid.iter().find_map(|key| Frames::of(key))?;
    words.iter().any(|word| name.starts_with(word)).then(|| {
        let turns = format!("turns directions from the axes of the {from} into those of the {to}");
        format!("write {key}: the unit quaternion w, x, y, z that {turns}")
    })
}
