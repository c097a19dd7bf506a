//! `hzn run --mask-pictures`: what the masks cover, against the truth of the simulator.

use std::path::Path;

use hzn_core::camera::Camera;
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use hzn_core::frames::{Cam, Fixed, Rotation};
use hzn_core::pixel::ImagePoint;
use hzn_files::truth::{self, Truth};

use crate::common::{Place, cell};

/// Returns a scene of the Earth in the infrared from orbit: the picture of a wide lens, with the attitude and its sigma
/// if they are known.
fn scene(bodies: &str, known: &str) -> String {
    format!(
        "name = \"orbit\"\nutc = 2021-07-15T00:00:00Z\nseed = 5\n{bodies}\n[capture]\nto_s = 5000.0\nframes = 6\n\
         [camera]\nwidth = 240\nheight = 180\nmodel = \"equidistant\"\nfx_px = 110.0\nfy_px = 110.0\ncx_px = 119.5\n\
         cy_px = 89.5\n[trajectory.orbit]\nperigee_km = 600.0\ninclination_deg = 97.8\n[attitude.pointing]\n\
         off_nadir_deg = [50.0, 75.0]\nazimuth_deg = [0.0, 300.0]\n[world.infrared]\n[detector]\nread_noise = 0.01\n\
         [known]\n{known}\n"
    )
}

/// Returns a vector in the fixed frame for one in the camera frame.
fn turned(q: &Rotation<Cam, Fixed, f64>, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    let unit = hzn_core::frames::UnitVec3::try_new([x, y, z]).unwrap();
    q.apply(&unit).xyz().map(|v| v * length)
}

/// Returns the height by which the ellipsoid is raised so that its mean limb has the true half-angle, metres.
fn limb_height_m(position_m: [f64; 3], half_angle_deg: f64) -> f64 {
    let at = |h: f64| {
        let cone = LimbCone::<f64>::try_new(position_m, WGS84_A_M + h, WGS84_B_M + h).unwrap();
        cone.mean_half_angle_rad().to_degrees()
    };
    let (mut low, mut high) = (0.0, 200e3);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if at(middle) < half_angle_deg { low = middle } else { high = middle }
    }
    low
}

/// Returns whether a line from `from` in this direction meets the ellipsoid.
fn meets([x, y, z]: [f64; 3], [dx, dy, dz]: [f64; 3], a_m: f64, b_m: f64) -> bool {
    let form = |p: [f64; 3], q: [f64; 3]| (p[0] * q[0] + p[1] * q[1]) / (a_m * a_m) + p[2] * q[2] / (b_m * b_m);
    let (p, d) = ([x, y, z], [dx, dy, dz]);
    let (aa, half_b, c) = (form(d, d), form(p, d), form(p, p) - 1.0);
    half_b < 0.0 && half_b * half_b - aa * c >= 0.0
}

/// Returns the number of pixels whose middle the Earth truly covers, of those the number that the mask leaves out, and
/// the number of masked pixels that it does not cover.
fn compare(folder: &Path, mask: &Path, truth: &Truth, raised_m: Option<f64>) -> [usize; 3] {
    let config = hzn_files::sensor::load(&folder.join("sensor.toml")).unwrap().config;
    let camera = Camera::<f64>::try_new(&config.camera).unwrap();
    let q = Rotation::<Cam, Fixed, f64>::assume_from_quaternion([truth.qw, truth.qx, truth.qy, truth.qz]).unwrap();
    let position_m = turned(&q, truth.position_km().unwrap().map(|km| -km * 1e3));
    let h = raised_m.unwrap_or_else(|| limb_height_m(position_m, truth.half_angle_deg));
    let mask = image::open(mask).unwrap().into_luma8();
    assert_eq!((mask.width(), mask.height()), (camera.width().into(), camera.height().into()));
    let mut counts = [0; 3];
    for (x, y, value) in mask.enumerate_pixels() {
        assert!([0, 255].contains(&value.0[0]));
        let Some(ray) = camera.unproject(ImagePoint { u: x.into(), v: y.into() }) else { continue };
        let is_covered = meets(position_m, turned(&q, ray.xyz()), WGS84_A_M + h, WGS84_B_M + h);
        counts[0] += usize::from(is_covered);
        counts[1] += usize::from(is_covered && value.0 == [0]);
        counts[2] += usize::from(!is_covered && value.0 == [255]);
    }
    counts
}

#[test]
fn masks_cover_the_true_earth_and_little_more() {
    let place = Place::new();
    for (name, known) in [("blind", ""), ("aware", "attitude_sigma_deg = 0.5\n")] {
        place.write("scene.toml", scene("", known).as_bytes());
        place.run(&["simulate", "scene.toml", "-o", name, "--no-noise"]).expect(0);
        let (table, masks) = (format!("{name}.csv"), format!("{name}-masks"));
        place.run(&["run", name, "-o", &table, "--mask-pictures", &masks]).expect(0);
        let (mut excess, mut covered, mut answered) = (0, 0, 0);
        let truths = truth::load(&place.path(&format!("{name}/truth.csv"))).unwrap();
        for (row, truth) in place.rows(&table).iter().zip(&truths) {
            let mask = place.path(&format!("{masks}/{}.png", truth.file.trim_end_matches(".png")));
            if cell(row, "status") != "ok" {
                assert!(!mask.exists());
                continue;
            }
            answered += 1;
            let [inside, left_out, more] = compare(&place.path(name), &mask, truth, None);
            assert_eq!(left_out, 0, "{name} {}", truth.file);
            (covered, excess) = (covered + inside, excess + more);
        }
        assert!(answered >= 5 && covered > 20_000, "{name}: {answered} {covered}");
        // Three sigmas and half a pixel are at most three pixels along the limb.
        assert!(excess > 0 && excess < answered * 3 * 300, "{name}: {excess} of {covered}");
    }
}

#[test]
fn a_margin_is_added() {
    let place = Place::with_pictures(1);
    place.run(&["run", "in", "--mask-pictures", "a", "-q"]).expect(0);
    place.run(&["run", "in", "--mask-pictures", "b", "--mask-margin-deg", "2", "-q"]).expect(0);
    let first_row = |folder: &str| {
        let mask = image::open(place.path(&format!("{folder}/0000.png"))).unwrap().into_luma8();
        (0..240).find(|y| mask.get_pixel(160, *y).0 == [255]).unwrap()
    };
    // Two degrees are 300 px · tan 2° in the middle of the picture.
    let moved = f64::from(first_row("a")) - f64::from(first_row("b"));
    assert!((moved - 10.5).abs() <= 1.0, "{moved}");
    place.run(&["run", "in", "--mask-margin-deg", "2"]).expect(2).says("--mask-pictures");
    place.run(&["run", "in", "--mask-pictures", "c", "--mask-margin-deg", "-1"]).expect(2).says("from 0 to 90");
}

#[test]
fn refused_pictures_are_named_and_keep_no_old_mask() {
    let place = Place::with_pictures(3);
    place.run(&["run", "in", "--mask-pictures", "masks", "-q"]).expect(0);
    assert!(place.path("masks/0001.png").exists());
    image::GrayImage::new(320, 240).save(place.path("in/0001.png")).unwrap();
    place.write("in/0002.png", b"no picture");
    place.run(&["run", "in", "--mask-pictures", "masks"]).expect(2).says("contains files already");
    let again = ["run", "in", "--mask-pictures", "masks", "--force", "-o", "a.csv"];
    let told = place.run(&again).expect(3).err;
    assert!(told.contains("no mask: 0001.png: ") && told.contains("no mask: 0002.png: unreadable"), "{told}");
    assert!(told.contains("2 pictures without a mask"), "{told}");
    let left: Vec<bool> = ["0000", "0001", "0002"].map(|n| place.path(&format!("masks/{n}.png")).exists()).into();
    assert_eq!(left, [true, false, false]);
}

#[test]
fn masks_replace_no_picture() {
    let place = Place::with_pictures(1);
    place.run(&["run", "in", "--mask-pictures", "in", "--force"]).expect(2).says("is the folder of the pictures");
    let both = ["run", "in", "--mask-pictures", "m", "--overlay", "./m", "--force"];
    place.run(&["run", "in", "--overlay", "m", "-q"]).expect(0);
    place.run(&both).expect(2).says("is the folder of --overlay");
    place.write("file", b"");
    place.run(&["run", "in", "--mask-pictures", "file"]).expect(1).says("is a file, not a folder");
}
