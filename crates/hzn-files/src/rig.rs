//! `rig.toml`: several cameras (heads) that are one sensor.
//!
//! The file names the heads, with the sensor.toml, the pictures and the mount of each. All paths are relative to its
//! folder. The table of the keys is in the reference of the files; the joint answer is that of [`hzn_core::rig`].

use std::path::{Path, PathBuf};

use hzn_core::rig::{self, Limb, MOST_HEADS};
use serde::{Deserialize, Serialize};

use crate::{Problem, document, limited};

/// A rig.toml. The fields are its sections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// `[rig]`: what all heads share.
    #[serde(default)]
    pub rig: Common,
    /// `[[head]]`: the cameras, one to four.
    #[serde(rename = "head", default)]
    pub heads: Vec<Head>,
}

impl Rig {
    /// Returns the number of each head's limb group: heads with the same `limb_group` have the same number, and the
    /// first head has 0.
    ///
    /// ```
    /// let mut rig = hzn_files::rig::parse(
    ///     "[[head]]
    ///     name = \"left\"
    ///     pictures = \"left\"
    ///     mount.q_rig_from_camera_wxyz = [1.0, 0.0, 0.0, 0.0]",
    ///     std::path::Path::new("rig.toml"),
    /// )?;
    /// rig.heads.extend_from_within(..);
    /// rig.heads[1].limb_group = Some("infrared".to_owned());
    /// assert_eq!(rig.limb_groups(), [0, 1]);
    /// # Ok::<(), hzn_files::Problem>(())
    /// ```
    pub fn limb_groups(&self) -> Vec<u8> {
        let mut names: Vec<&Option<String>> = Vec::new();
        let mut number = |name| {
            let place = names.iter().position(|other| *other == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            });
            u8::try_from(place).unwrap_or(u8::MAX)
        };
        self.heads.iter().map(|head| number(&head.limb_group)).collect()
    }
}

/// `[rig]`: what all heads share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Common {
    /// Longest time between two pictures of one epoch, seconds.
    pub sync_s: f64,
    /// In flight, the time after the first picture of an epoch at which it ends without the heads that are late,
    /// seconds. Allow for the calculation of all heads.
    pub wait_s: f64,
    /// Probability of a false alarm of the check, for each epoch.
    pub false_alarm: f64,
    /// Probability that the error exceeds `protection_deg`, if at most one head is wrong.
    pub misleading: f64,
    /// 1σ of a tilt of the limb, kilometres: the amplitude of a height that varies as the cosine of the azimuth, along
    /// each of two axes. `None` derives it from the half-angle, see [`hzn_core::body::tilt_km`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limb_tilt_sigma_km: Option<f64>,
    /// 1σ of the limb height that each head has for itself, kilometres: the weather of its part of the limb.
    pub limb_own_sigma_km: f64,
    /// Distance along the limb at which the correlation of that height has fallen to exp(−½), kilometres.
    pub limb_own_length_km: f64,
    /// `[rig.mount]`: the attitude of the rig on the vehicle.
    pub mount: RigMount,
}

/// A turn of one degree in a tenth of a second is fast for a satellite, but the usual 0.06° a second of one that keeps
/// an axis on the Earth moves a head by 0.006° in this time, which is a third of the error of four heads.
const SYNC_S: f64 = 0.1;

/// Several times the calculation of four heads, and less than the time between two pictures of a slow camera.
const WAIT_S: f64 = 0.5;

impl Default for Common {
    fn default() -> Self {
        let rig::Config { false_alarm, misleading } = rig::Config::default();
        Self {
            sync_s: SYNC_S,
            wait_s: WAIT_S,
            false_alarm,
            misleading,
            limb_tilt_sigma_km: None,
            limb_own_sigma_km: Limb::<f64>::OWN_SIGMA_KM,
            limb_own_length_km: Limb::<f64>::OWN_LENGTH_KM,
            mount: RigMount::default(),
        }
    }
}

impl Common {
    /// Returns the probabilities of the check.
    pub fn check(&self) -> rig::Config {
        rig::Config { false_alarm: self.false_alarm, misleading: self.misleading }
    }
}

/// `[rig.mount]`: the attitude of the rig on the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct RigMount {
    /// Quaternion that converts coordinates of the rig to coordinates of the vehicle, scalar first.
    pub q_vehicle_from_rig_wxyz: [f64; 4],
    /// 1σ of that attitude about each axis, degrees.
    pub sigma_deg: f64,
}

impl Default for RigMount {
    fn default() -> Self {
        Self { q_vehicle_from_rig_wxyz: [1.0, 0.0, 0.0, 0.0], sigma_deg: 0.0 }
    }
}

/// `[[head]]`: one camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Short name, for the column `head`.
    pub name: String,
    /// The sensor.toml of the camera; `None` takes the one next to the pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensor: Option<PathBuf>,
    /// The pictures: a folder, a pattern or a video.
    pub pictures: PathBuf,
    /// Name of the limb that the camera sees. Heads with another name see a limb of another height, as an infrared and
    /// a visible camera do. `None` is a name, too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limb_group: Option<String>,
    /// `[head.mount]`: the attitude of the camera on the rig. [`parse`] refuses a head without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mount: Option<HeadMount>,
}

/// `[head.mount]`: the attitude of a camera on the rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeadMount {
    /// Quaternion that converts camera coordinates to coordinates of the rig, scalar first.
    pub q_rig_from_camera_wxyz: [f64; 4],
    /// 1σ of that attitude about each axis, degrees.
    #[serde(default)]
    pub sigma_deg: f64,
    /// Covariance of that attitude, deg²: xx, xy, xz, yy, yz, zz of a small rotation about the axes of the rig. It
    /// replaces `sigma_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance_deg2: Option<[f64; 6]>,
}

impl HeadMount {
    /// Returns the covariance in rad², as the upper triangle xx, xy, xz, yy, yz, zz.
    pub fn covariance_rad2(&self) -> [f64; 6] {
        let var = self.sigma_deg * self.sigma_deg;
        let deg2 = self.covariance_deg2.unwrap_or([var, 0.0, 0.0, var, 0.0, var]);
        deg2.map(|x| x * 1f64.to_radians().powi(2))
    }
}

/// Returns whether a file is a rig.toml, by its name or by its sections. It need not be correct.
pub fn is_rig(path: &Path) -> bool {
    let begins = |line: &str| ["[[head]]", "[rig]", "[rig."].iter().any(|name| line.trim_start().starts_with(name));
    path.file_name().is_some_and(|name| name == "rig.toml")
        || limited::read_text(path, limited::SETTINGS_BYTES).is_ok_and(|text| text.lines().any(begins))
}

/// Reads and checks a rig.toml. The files that it names are not read.
///
/// # Errors
/// The first error in the file.
pub fn load(path: &Path) -> Result<Rig, Problem> {
    let text = limited::read_text(path, limited::SETTINGS_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Problem::new(path, "no such file"),
        std::io::ErrorKind::InvalidData => Problem::new(path, "is not text; a rig.toml is expected"),
        _ => Problem::new(path, format!("cannot be read: {e}")),
    })?;
    parse(&text, path)
}

/// Reads a rig.toml as [`load`] does, but from text; `path` is used in messages.
///
/// ```
/// let text = "
///     [rig]
///     sync_s = 0.02
///     [[head]]
///     name = \"left\"
///     pictures = \"left\"
///     mount.q_rig_from_camera_wxyz = [1.0, 0.0, 0.0, 0.0]
/// ";
/// let rig = hzn_files::rig::parse(text, std::path::Path::new("rig.toml"))?;
/// assert_eq!((rig.heads[0].name.as_str(), rig.rig.sync_s), ("left", 0.02));
/// # Ok::<(), hzn_files::Problem>(())
/// ```
///
/// # Errors
/// The errors are those of [`load`].
pub fn parse(text: &str, path: &Path) -> Result<Rig, Problem> {
    document::parse(text, path, check)
}

/// Writes a rig.toml as text.
///
/// # Errors
/// A path is not UTF-8.
pub fn to_text(rig: &Rig) -> Result<String, String> {
    toml::to_string(rig).map_err(|e| e.to_string())
}

type Refused = (String, String);

/// Checks the values of a rig.toml.
///
/// # Errors
/// The first key that is refused, and the rule.
pub fn check(file: &Rig) -> Result<(), (String, String)> {
    check_common(&file.rig)?;
    if file.heads.is_empty() || file.heads.len() > MOST_HEADS {
        let what = format!("the file has {} of them; a rig has 1 to {MOST_HEADS} heads", file.heads.len());
        return Err(("[[head]]".into(), what));
    }
    for (i, head) in file.heads.iter().enumerate() {
        let refused = |key: &str, what: String| Err((format!("[[head]] {} {key}", i + 1), what));
        if let Some(why) = find_bad_name(&head.name) {
            return refused("name", format!("{:?} {why}", head.name));
        }
        if file.heads.iter().take(i).any(|other| other.name == head.name) {
            return refused("name", format!("{:?} is also the name of another head", head.name));
        }
        if let Some((name, why)) = head.limb_group.as_ref().and_then(|name| Some((name, find_bad_word(name)?))) {
            return refused("limb_group", format!("{name:?} {why}"));
        }
        let Some(mount) = &head.mount else {
            let what = "missing: give the attitude of the camera on the rig as q_rig_from_camera_wxyz, from the \
                        drawing; `hzn init --rig --camchain` takes it from a calibration of Kalibr (T_cn_cnm1), and \
                        `hzn calibrate rig` corrects it from a flight";
            return refused("mount", what.into());
        };
        let in_mount = |(key, what): (&str, String)| (format!("[[head]] {} mount.{key}", i + 1), what);
        check_mount("q_rig_from_camera_wxyz", &mount.q_rig_from_camera_wxyz, mount.sigma_deg).map_err(in_mount)?;
        if let Some(deg2) = &mount.covariance_deg2
            && !is_covariance(deg2)
        {
            let what = "is not a covariance: the matrix must be symmetric without negative eigenvalues";
            return refused("mount.covariance_deg2", what.into());
        }
    }
    Ok(())
}

fn check_common(rig: &Common) -> Result<(), Refused> {
    // A time of days or a height of a planet's radius is a wrong unit.
    let limits = [
        ("sync_s", rig.sync_s, 1e-6, 3600.0),
        ("wait_s", rig.wait_s, 0.0, 3600.0),
        ("limb_tilt_sigma_km", rig.limb_tilt_sigma_km.unwrap_or_default(), 0.0, 1000.0),
        ("limb_own_sigma_km", rig.limb_own_sigma_km, 0.0, 1000.0),
        ("limb_own_length_km", rig.limb_own_length_km, 1.0, 1e6),
    ];
    for (key, value, low, high) in limits {
        if !(low..=high).contains(&value) {
            return Err((format!("[rig] {key}"), format!("{value} is refused: must be between {low} and {high}")));
        }
    }
    rig::Rig::<f64>::new(&rig.check()).map_err(|e| {
        let key = e.field.split('.').next_back().unwrap_or_default();
        (format!("[rig] {key}"), format!("{} is refused: {}", e.value, e.limit))
    })?;
    let in_mount = |(key, what): (&str, String)| (format!("[rig] mount.{key}"), what);
    check_mount("q_vehicle_from_rig_wxyz", &rig.mount.q_vehicle_from_rig_wxyz, rig.mount.sigma_deg).map_err(in_mount)
}

/// Returns why a name cannot be that of a head. The names are cells of a table, topics of a recording and folders.
fn find_bad_name(name: &str) -> Option<&'static str> {
    if name == JOINT {
        return Some("is the name of the joint answer in the column `head`; choose another one");
    }
    if RESERVED.contains(&name) {
        return Some("is the name of another frame of a recording; choose another one");
    }
    find_bad_word(name)
}

/// Returns why a text is no name.
fn find_bad_word(name: &str) -> Option<&'static str> {
    let is_plain = |c: char| c.is_alphanumeric() || c == '_';
    let is_good = name.starts_with(is_plain) && name.chars().all(|c| is_plain(c) || c == '-');
    // A spreadsheet takes a cell that begins with - for a formula.
    (!is_good).then_some("is not a name: use letters, digits, _ and -, and begin with no -")
}

/// The frames that a recording of a rig has besides those of the heads, which have the names of the heads.
const RESERVED: [&str; 2] = ["vehicle", "fixed"];

/// The value of the column `head` for the joint answer.
pub const JOINT: &str = "rig";

fn check_mount<'a>(key: &'a str, q: &[f64; 4], sigma_deg: f64) -> Result<(), (&'a str, String)> {
    let n2: f64 = q.iter().map(|x| x * x).sum();
    // As for the mount of a single camera: a quaternion may be written with three digits.
    if !((n2 - 1.0).abs() < 0.01) {
        return Err((key, format!("{n2} is refused: the quaternion's squared length must be 1 (scalar first)")));
    }
    if !(0.0..=90.0).contains(&sigma_deg) {
        return Err(("sigma_deg", format!("{sigma_deg} is refused: must be between 0 and 90")));
    }
    Ok(())
}

/// Returns whether a symmetric matrix has no negative principal minor, apart from rounding.
fn is_covariance([xx, xy, xz, yy, yz, zz]: &[f64; 6]) -> bool {
    let all = [xx, xy, xz, yy, yz, zz];
    let scale = all.iter().fold(0f64, |most, x| most.max(x.abs()));
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let minors = [xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz];
    let is_not_negative = |x: f64, power: i32| x >= -1e-9 * scale.powi(power);
    all.iter().all(|x| x.is_finite())
        && [xx, yy, zz].iter().all(|x| **x >= 0.0)
        && minors.iter().all(|x| is_not_negative(*x, 2))
        && is_not_negative(determinant, 3)
}

/// Returns the product of two quaternions, scalar first: the rotation `b` and then the rotation `a`.
pub fn turn_after([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 4] {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "[[head]]\nname = \"left\"\npictures = \"left\"\nmount.q_rig_from_camera_wxyz = [1, 0, 0, 0]\n\
                       [[head]]\nname = \"right\"\npictures = \"r/*.png\"\nsensor = \"r.toml\"\n\
                       mount = { q_rig_from_camera_wxyz = [0, 0, 0, 1], sigma_deg = 0.02 }\n";

    fn read(text: &str) -> Result<Rig, String> {
        parse(text, Path::new("rig.toml")).map_err(|e| e.to_string())
    }

    #[test]
    fn two_heads_are_enough_and_come_back() {
        let rig = read(TWO).unwrap();
        assert_eq!((rig.rig, rig.heads.len()), (Common::default(), 2));
        assert_eq!((rig.heads[0].sensor.as_deref(), rig.heads[1].sensor.as_deref()), (None, Some(Path::new("r.toml"))));
        let var = 0.02f64.to_radians().powi(2);
        let [xx, xy, .., zz] = rig.heads[1].mount.unwrap().covariance_rad2();
        assert!((xx - var).abs() < 1e-18 && xy == 0.0 && (zz - var).abs() < 1e-18);
        assert_eq!(read(&toml::to_string(&rig).unwrap()).unwrap(), rig);
    }

    #[test]
    fn heads_with_one_name_of_a_limb_are_a_group() {
        let groups = |names: &[Option<&str>]| {
            let mut rig = read(TWO).unwrap();
            let head = rig.heads[0].clone();
            let of = |name: &Option<&str>| Head { limb_group: name.map(str::to_owned), ..head.clone() };
            rig.heads = names.iter().map(of).collect();
            rig.limb_groups()
        };
        assert_eq!(groups(&[None, None, None]), [0, 0, 0]);
        assert_eq!(groups(&[Some("infrared"), None, Some("infrared"), Some("visible")]), [0, 1, 0, 2]);
    }

    #[test]
    fn errors_name_line_and_field() {
        let with = |from: &str, to: &str| read(&TWO.replacen(from, to, 1)).unwrap_err();
        assert_eq!(
            with("pictures =", "picture ="),
            "rig.toml:3: [[head]] 1 picture: unknown key; did you mean pictures?"
        );
        assert_eq!(
            with("\"right\"", "\"left\""),
            "rig.toml:6: [[head]] 2 name: \"left\" is also the name of another head"
        );
        let refused = "is the name of the joint answer in the column `head`; choose another one";
        assert_eq!(with("\"right\"", "\"rig\""), format!("rig.toml:6: [[head]] 2 name: \"rig\" {refused}"));
        for bad in ["the right", "-right", "", "=a"] {
            assert!(with("\"right\"", &format!("\"{bad}\"")).contains("use letters, digits, _ and -"), "{bad}");
        }
        for reserved in ["vehicle", "fixed"] {
            assert!(with("\"right\"", &format!("\"{reserved}\"")).contains("is the name of another frame"));
        }
        let quaternion = "2 is refused: the quaternion's squared length must be 1 (scalar first)";
        assert_eq!(
            with("[0, 0, 0, 1]", "[0, 1, 0, 1]"),
            format!("rig.toml:9: [[head]] 2 mount.q_rig_from_camera_wxyz: {quaternion}")
        );
        assert_eq!(
            with("[0, 0, 0, 1]", "[0, 0, 0, 1, 0]"),
            "rig.toml:9: [[head]] 2 mount.q_rig_from_camera_wxyz: has 5 numbers; at most 4 are allowed"
        );
        assert!(
            with("mount.q_rig_from_camera_wxyz = [1, 0, 0, 0]\n", "")
                .starts_with("rig.toml:1: [[head]] 1 mount: missing: give the attitude of the camera on the rig")
        );
        assert!(with("0.02", "-1").contains("[[head]] 2 mount.sigma_deg: -1 is refused: must be between 0 and 90"));
        assert!(
            with("sigma_deg = 0.02 }", "sigma_deg = 0.02 }\nlimb_group = \"a b\"").contains("limb_group: \"a b\" is")
        );
        let not_one = "covariance_deg2 = [1, 2, 0, 1, 0, 1]";
        assert!(with("sigma_deg = 0.02", not_one).contains("mount.covariance_deg2: is not a covariance"));
        let common = |line: &str| read(&format!("[rig]\n{line}\n{TWO}")).unwrap_err();
        assert_eq!(common("sync_s = 0"), "rig.toml:2: [rig] sync_s: 0 is refused: must be between 0.000001 and 3600");
        assert!(common("sync = 1").ends_with("[rig] sync: unknown key; did you mean sync_s?"));
        assert!(common("false_alarm = 2").starts_with("rig.toml:2: [rig] false_alarm: 2 is refused: must be between"));
        assert!(common("limb_tilt_sigma_km = nan").contains("[rig] limb_tilt_sigma_km: NaN is refused"));
        assert_eq!(read("").unwrap_err(), "rig.toml: [[head]]: the file has 0 of them; a rig has 1 to 4 heads");
        assert!(read(&TWO.replace("[[head]]", "[[heads]]")).unwrap_err().contains("did you mean head?"));
    }

    #[test]
    fn turns_follow_each_other() {
        let half = 0.5f64.sqrt();
        let (about_x, about_z) = ([half, half, 0.0, 0.0], [half, 0.0, 0.0, half]);
        let turned = turn_after(about_z, about_x);
        // x stays x, and then becomes y.
        let rotation = hzn_core::frames::Rotation::<hzn_core::frames::Cam, hzn_core::frames::Vehicle, f64>::
            assume_from_quaternion(turned).unwrap();
        let x = hzn_core::frames::UnitVec3::try_new([1.0, 0.0, 0.0]).unwrap();
        assert!((rotation.apply(&x).xyz()[1] - 1.0).abs() < 1e-15);
    }
}
