//! Ellipsoids: exact limb, rendered limb, phases, haze, rings, truth.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use hzn_core::camera::{Camera, Config, Model};
use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M};
use hzn_core::frames::{Fixed, UnitVec3};
use hzn_sim::{
    Detector, EdgeNoise, Ellipsoid, EllipsoidLimb, Haze, Light, LimbArc, Picture, Pose, Reflection, Ring, Scene,
    Trials, World, pose::position_m,
};
use nalgebra::{Matrix3, Vector3};

/// A pose at a position that looks at the centre, with a turn about the optical axis.
fn towards_centre(position_m: [f64; 3], roll_rad: f64) -> Pose {
    let axis = -Vector3::from(position_m).normalize();
    let helper = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let right = axis.cross(&helper).normalize();
    let down = axis.cross(&right);
    let (sin, cos) = roll_rad.sin_cos();
    let axes = [right * cos + down * sin, down * cos - right * sin, axis];
    Pose::from_axes(position_m, axes.map(Into::into))
}

/// A full-phase, noiseless scene of a body.
fn scene(body: Ellipsoid, camera: Config, pose: Pose) -> Scene {
    Scene {
        world: World::Ellipsoid(Box::new(body)),
        light: Light::Sun { direction: pose.position_m, twilight_rad: 0.0 },
        detector: Detector { psf_sigma_px: 0.0, bits: 16, ..Detector::default() },
        ..Scene::new(camera, pose)
    }
}

fn phase(scene: &mut Scene, sun: Vector3<f64>) {
    scene.light = Light::Sun { direction: sun.into(), twilight_rad: 0.0 };
}

/// Light at a point between pixels, as a fraction of full scale.
fn light(picture: &Picture, u: f64, v: f64) -> f64 {
    let (x, y) = (u.floor(), v.floor());
    let at = |dx: f64, dy: f64| f64::from(picture.at((x + dx) as u16, (y + dy) as u16)) / 65_535.0;
    let (fx, fy) = (u - x, v - y);
    (at(0.0, 0.0) * (1.0 - fx) + at(1.0, 0.0) * fx) * (1.0 - fy) + (at(0.0, 1.0) * (1.0 - fx) + at(1.0, 1.0) * fx) * fy
}

fn even(radii_km: [f64; 3]) -> Ellipsoid {
    let mut body = Ellipsoid::from_radii(radii_km);
    body.surface.reflection = Reflection::LommelSeeliger;
    body
}

#[test]
fn limb_rays_touch_and_have_their_azimuth() {
    let poses = [
        ([256.6, 251.4, 248.3], [-1500.0, 2300.0, 900.0]),
        ([13.0, 11.4, 9.1], [5.0, -14.0, 3.0]),
        ([71_492.0, 71_492.0, 66_854.0], [6e7, 1e7, -3e6]),
        ([6378.137, 6378.137, 6356.752], [100.0, -6500.0, 2000.0]),
    ];
    for (radii_km, position_km) in poses {
        let axes_m = Vector3::from(radii_km) * 1e3;
        let pose = towards_centre(position_km.map(|x: f64| x * 1e3), 0.7);
        let limb = EllipsoidLimb::try_new(axes_m.into(), &pose).unwrap();
        let rotation = pose.fixed_from_camera().unwrap();
        for i in 0..360 {
            let azimuth = f64::from(i).to_radians() - PI + 1e-3;
            let ray = limb.ray(azimuth);
            assert!((limb.azimuth_rad(ray) - azimuth).abs() < 1e-12);
            let body = rotation.apply(&UnitVec3::try_new(ray).unwrap()).xyz();
            // The discriminant of the intersection, in scaled space and relative to its parts.
            let s = Vector3::from(body).component_div(&axes_m);
            let y = Vector3::from(pose.position_m).component_div(&axes_m);
            let closest = y - s * (y.dot(&s) / s.norm_squared());
            assert!((closest.norm() - 1.0).abs() < 1e-9, "{radii_km:?} {i} {:e}", closest.norm() - 1.0);
            assert!(y.dot(&s) < 0.0, "the limb is in front of the camera");
        }
        let truth_km = rotation.inverse().apply(&UnitVec3::<Fixed, f64>::try_new(pose.position_m.map(|x| -x)).unwrap());
        let range_km = Vector3::from(position_km).norm();
        let want = Vector3::from(truth_km.xyz()) * range_km;
        assert!((Vector3::from(limb.position_km()) - want).norm() < 1e-9 * range_km);
    }
    let inside = Pose { position_m: [0.0, 0.0, 1e3], q_fixed_from_camera_wxyz: [1.0, 0.0, 0.0, 0.0] };
    assert_eq!(EllipsoidLimb::try_new([2e3; 3], &inside), None);
}

/// Rays of SPICE's `edlimb`, with which the sensor's own limb is tested too.
#[test]
fn limb_agrees_with_an_independent_library() {
    let golden: serde_json::Value = serde_json::from_str(include_str!("../data/limb_ellipsoid.json")).unwrap();
    let three = |v: &serde_json::Value| core::array::from_fn::<f64, 3, _>(|i| v[i].as_f64().unwrap());
    for case in golden["cases"].as_array().unwrap() {
        let (a, b) = (case["a_m"].as_f64().unwrap(), case["b_m"].as_f64().unwrap());
        let rows: [[f64; 3]; 3] = core::array::from_fn(|i| three(&case["R_ec"][i]));
        let columns = core::array::from_fn(|c| rows.map(|row| row[c]));
        let limb = EllipsoidLimb::try_new([a, a, b], &Pose::from_axes(three(&case["r_ecef_m"]), columns)).unwrap();
        for ray in case["rays_c"].as_array().unwrap().iter().map(three) {
            let own = Vector3::from(limb.ray(limb.azimuth_rad(ray)));
            assert!((own - Vector3::from(ray).normalize()).norm() < 1e-9, "{}", case["id"]);
        }
    }
}

#[test]
fn truth_of_the_earth_is_that_of_its_own_world() {
    let pose = towards_centre(position_m(40.0, 20.0, 3000.0), 0.3);
    let camera = Config::ideal(Model::Equidistant, 640, 480, 300.0);
    let earth = Scene {
        light: Light::Sun { direction: [1.0, 0.5, 0.2], twilight_rad: 0.0 },
        ..Scene::new(camera.clone(), pose)
    };
    let mut body = even([WGS84_A_M / 1e3, WGS84_A_M / 1e3, WGS84_B_M / 1e3]);
    body.surface_height_km = earth.body.limb_height_km;
    let mut same = scene(body, camera, pose);
    same.light = earth.light;
    let (a, b) = (earth.truth("a.png", 1.0).unwrap(), same.truth("a.png", 1.0).unwrap());
    let near = |x: f64, y: f64| assert!((x - y).abs() < 1e-9, "{x} {y}");
    let numbers = |t: &hzn_files::truth::Truth| {
        let [x, y, z] = t.position_km().unwrap();
        let (sun, phase) = (t.sun_x.unwrap(), t.phase_deg.unwrap());
        [t.axis_x, t.axis_y, t.axis_z, t.half_angle_deg, t.qw, sun, phase, x, y, z]
    };
    numbers(&a).into_iter().zip(numbers(&b)).for_each(|(x, y)| near(x, y));
    let cone = LimbCone::try_new(pose.position_m, WGS84_A_M + 17e3, WGS84_B_M + 17e3).unwrap();
    near(b.half_angle_deg, cone.mean_half_angle_rad().to_degrees());
    assert_eq!((b.body.as_str(), b.limb), ("ellipsoid", a.limb));
    assert!((earth.visible_limb_px().unwrap() - same.visible_limb_px().unwrap()).abs() < 1.0);
}

/// A body that does not darken, at full phase and without blur: the light of all pixels together is the area of the
/// limb, and half of the light is at the limb.
#[test]
fn rendered_limb_is_the_exact_limb() {
    for (radii_km, range_km, focal_px) in [
        // From far away, the angles of the Sun and of the camera are the same.
        ([256.6, 251.4, 248.3], 6e6, 1.5e6),
        ([13.0, 11.4, 9.1], 6e5, 3e6),
        ([71_492.0, 71_492.0, 66_854.0], 6e9, 4e6),
        // Eight pixels.
        ([13.0, 11.4, 9.1], 1e6, 3.6e5),
    ] {
        let camera = Config::ideal(Model::Pinhole, 256, 256, focal_px);
        let direction = Vector3::new(0.4, -0.7, 0.5).normalize();
        let mut s = scene(even(radii_km), camera.clone(), towards_centre((direction * range_km * 1e3).into(), 0.4));
        let picture = s.render().unwrap();
        let lens = Camera::<f64>::try_new(&camera).unwrap();
        let limb = EllipsoidLimb::try_new(radii_km.map(|r| r * 1e3), &s.pose).unwrap();
        let arc = LimbArc { middle_rad: 0.0, length_rad: TAU, count: 3600 };
        let points = limb.points(&lens, arc, EdgeNoise::None, 1);
        assert_eq!(points.len(), 3600);
        let twice: f64 = (0..3600)
            .map(|i| {
                let (p, q) = (points[i].exact, points[(i + 1) % 3600].exact);
                p.u * q.v - q.u * p.v
            })
            .sum();
        let (area, full) = (0.5 * twice.abs(), 0.8);
        let mut sums = [0.0; 3];
        for (x, y) in (0..256u16).flat_map(|y| (0..256u16).map(move |x| (x, y))) {
            let share = f64::from(picture.at(x, y)) / 65_535.0 / full;
            sums = [sums[0] + share, sums[1] + share * f64::from(x), sums[2] + share * f64::from(y)];
        }
        let radius_px = (area / PI).sqrt();
        // An error of the radius by δ changes the area by 2 π r δ.
        let error_px = (sums[0] - area) / (TAU * radius_px);
        println!("{radii_km:?}: radius {radius_px:.2} px, error {error_px:.5} px");
        assert!(error_px.abs() < 0.002, "{radii_km:?}: {error_px}");
        let middle: Vector3<f64> = points.iter().map(|p| Vector3::new(p.exact.u, p.exact.v, 1.0)).sum::<Vector3<f64>>();
        if radii_km[0] > 1e4 {
            let off = [sums[1] / sums[0] - middle.x / middle.z, sums[2] / sums[0] - middle.y / middle.z];
            assert!(off[0].hypot(off[1]) < 0.005, "{off:?}");
        }
        // With a blur much smaller than the radius, half of the light is at the limb.
        if radius_px > 20.0 {
            s.detector.psf_sigma_px = 1.0;
            let picture = s.render().unwrap();
            let halves = points.iter().step_by(100).map(|p| light(&picture, p.exact.u, p.exact.v) / full);
            halves.for_each(|half| assert!((half - 0.5).abs() < 0.02, "{half}"));
        }
    }
}

/// Lambert's law at full phase: the brightness μ = √(1 − (ρ/R)²) falls to zero at the limb. The area of light is that
/// of the integral, 2/3 of the disc.
#[test]
fn a_matt_body_darkens_towards_its_limb() {
    let camera = Config::ideal(Model::Pinhole, 256, 256, 4000.0);
    let s = scene(Ellipsoid::from_radii([100.0; 3]), camera, towards_centre([4e6, 0.0, 0.0], 0.0));
    let picture = s.render().unwrap();
    let sum: f64 = (0..256u16)
        .flat_map(|y| (0..256u16).map(move |x| (x, y)))
        .map(|(x, y)| f64::from(picture.at(x, y)) / 65_535.0 / 0.8)
        .sum();
    let area = PI * 4000f64.powi(2) * (100f64 / 4000.0).asin().tan().powi(2);
    assert!((sum / area - 2.0 / 3.0).abs() < 2e-2, "{}", sum / area);
    assert!((light(&picture, 127.5, 127.5) / 0.8 - 1.0).abs() < 1e-3);
}

/// From far away, the lit share of a sphere's disc is (1 + cos φ)/2, and its terminator is where the Sun sets.
#[test]
fn phases_have_their_lit_share_and_terminator() {
    let camera = Config::ideal(Model::Pinhole, 256, 256, 1e6);
    for degrees in [0.0f64, 45.0, 90.0, 130.0, 161.0, 170.0] {
        let mut s = scene(even([100.0; 3]), camera.clone(), towards_centre([1e9, 0.0, 0.0], 0.0));
        let (sin, cos) = degrees.to_radians().sin_cos();
        // The z axis is up in the picture.
        phase(&mut s, Vector3::new(cos, 0.0, sin));
        let truth = s.truth("", 0.0).unwrap();
        assert!((truth.phase_deg.unwrap() - degrees).abs() < 1e-9);
        let picture = s.render().unwrap();
        let column = |y: u16| f64::from(picture.at(127, y)) + f64::from(picture.at(128, y));
        let lit_px = (0..256u16).filter(|y| column(*y) > 0.0).count() as f64;
        let wanted_px = 200.0 * (1.0 + cos) / 2.0;
        assert!((lit_px - wanted_px).abs() < 2.5, "{degrees}: {lit_px} {wanted_px}");
        let limb_px = s.visible_limb_px().unwrap();
        let half = if degrees == 0.0 { 0.0..TAU * 101.0 } else { PI * 99.0..PI * 101.0 };
        assert!(half.contains(&limb_px), "{degrees}: {limb_px}");
        // Only the lit side is limb: above the middle.
        let points = s.limb_points(50, EdgeNoise::None).unwrap();
        assert!(degrees == 0.0 || points.iter().all(|p| p.exact.v < 128.0));
    }
    // The night side has no limb.
    let mut night = scene(even([100.0; 3]), camera, towards_centre([1e9, 0.0, 0.0], 0.0));
    phase(&mut night, Vector3::new(-1.0, 0.0, 0.0));
    assert_eq!(night.visible_limb_px().unwrap(), 0.0);
    assert!(!night.truth("", 0.0).unwrap().has_limb());
}

/// Along the sunlit limb, half of the light of thick haze is at the limb height that the body tells.
#[test]
fn haze_is_as_high_as_told() {
    for (optical_depth, scale_height_km) in [(0.3, 30.0), (2.0, 50.0), (0.05, 15.0)] {
        let haze = Haze { scale_height_km, optical_depth, brightness: 0.4, asymmetry: 0.0 };
        let mut body = Ellipsoid::named("jupiter");
        body.haze = Some(haze);
        body.surface.albedo = 0.0;
        let told_km = body.limb_height_km();
        assert!(told_km > scale_height_km, "{told_km}");
        // One pixel is 2 km at the limb; the picture is at the limb.
        let range_m = 3e9;
        let position = Vector3::new(range_m, 0.0, 0.0);
        let sun = Vector3::new(60f64.to_radians().cos(), 60f64.to_radians().sin(), 0.0);
        let edge = position - Vector3::new(0.0, 71_492e3, 0.0);
        let axis = -edge.normalize();
        let right = Vector3::z();
        let pose = Pose::from_axes(position.into(), [right, axis.cross(&right), axis].map(Into::into));
        let camera = Config::ideal(Model::Pinhole, 64, 1024, range_m / 2e3);
        let mut s = scene(body, camera, pose);
        phase(&mut s, sun);
        let rays: Vec<[f64; 3]> = (0..1024)
            .map(|y| Vector3::new(0.0, (f64::from(y) - 511.5) * 2e3 / range_m, 1.0).normalize().into())
            .collect();
        let view_km = |ray: &[f64; 3]| {
            // Jupiter is round about its pole, and the camera is in its equator.
            let body_ray = right * ray[0] + axis.cross(&right) * ray[1] + axis * ray[2];
            position.cross(&body_ray).norm() / 1e3 - 71_492.0
        };
        let picture = s.render().unwrap();
        let profile: Vec<(f64, f64)> =
            (0..1024).map(|y| (view_km(&rays[y]), f64::from(picture.at(32, y as u16)) / 65_535.0)).collect();
        // The brightest haze is a bit inside; the outermost place with half of it counts.
        let half = 0.5 * profile.iter().map(|p| p.1).fold(0.0, f64::max);
        let crossings = profile.windows(2).filter(|w| (w[0].1 - half) * (w[1].1 - half) <= 0.0);
        let heights = crossings.map(|w| w[0].0 + (half - w[0].1) / (w[1].1 - w[0].1) * (w[1].0 - w[0].0));
        let height_km = heights.fold(f64::NEG_INFINITY, f64::max);
        println!("told {told_km:.1} km, seen {height_km:.1} km");
        assert!((height_km - told_km).abs() < 0.02 * scale_height_km, "{height_km} {told_km}");
    }
}

/// Beyond the terminator, haze still shines along the limb if the Sun is behind the body, and more of it the more
/// forward it scatters.
#[test]
fn haze_shines_all_around_a_body_in_front_of_the_sun() {
    let camera = Config::ideal(Model::Pinhole, 256, 256, 4000.0);
    let ring_light = |haze: Option<Haze>| {
        let mut body = Ellipsoid::named("titan");
        body.haze = haze;
        let mut s = scene(body, camera.clone(), towards_centre([1e8, 0.0, 0.0], 0.0));
        phase(&mut s, Vector3::new(-1.0, 0.0, 0.06));
        let picture = s.render().unwrap();
        // The side away from the Sun: below.
        (200..250u16).map(|y| f64::from(picture.at(128, y))).fold(0.0, f64::max) / 65_535.0
    };
    let hazy = |asymmetry| Some(Haze { scale_height_km: 45.0, optical_depth: 2.0, brightness: 0.2, asymmetry });
    assert_eq!(ring_light(None), 0.0);
    assert!(ring_light(hazy(0.0)) > 0.05);
    assert!(ring_light(hazy(0.5)) > 2.0 * ring_light(hazy(0.0)));
}

#[test]
fn rings_hide_what_is_behind_them() {
    let camera = Config::ideal(Model::Pinhole, 512, 512, 2000.0);
    let tilt = 20f64.to_radians();
    let position = Vector3::new(tilt.cos(), 0.0, tilt.sin()) * 1.2e9;
    let with = |rings: Vec<Ring>| {
        let mut body = Ellipsoid::named("saturn");
        body.surface.reflection = Reflection::LommelSeeliger;
        body.rings = rings;
        scene(body, camera.clone(), towards_centre(position.into(), 0.0))
    };
    let dark = Ring { inner_km: 91_975.0, outer_km: 117_507.0, opacity: 1.0, brightness: 0.0 };
    let (bare, ringed) = (with(vec![]), with(vec![dark]));
    let (a, b) = (bare.render().unwrap(), ringed.render().unwrap());
    // In front of the disc, below its middle (the camera is above the plane): the ring's near side is at
    // −R_ring sin(tilt) in the picture. Its far side is behind the disc or in the sky.
    let px = 2000.0 / 1.2e6;
    let near = |radius_km: f64| 255.5 + radius_km * tilt.sin() * px;
    let middle_y = near(104_000.0).round() as u16;
    assert!(a.at(255, middle_y) > 30_000 && b.at(255, middle_y) == 0);
    let above_y = (255.5 - 104_000.0 * tilt.sin() * px).round() as u16;
    assert!(a.at(255, above_y) > 30_000 && b.at(255, above_y) == a.at(255, above_y));
    // The limb behind the ring is no visible limb.
    let (whole, cut) = (bare.visible_limb_px().unwrap(), ringed.visible_limb_px().unwrap());
    assert!(cut < whole - 10.0, "{whole} {cut}");
    // Outside the disc, at the ansa, half of a half-opaque ring's brightness is seen.
    let half = Ring { opacity: 0.5, brightness: 0.6, ..dark };
    let picture = with(vec![half]).render().unwrap();
    let ansa_x = (255.5 + 104_000.0 * px).round() as u16;
    assert!((f64::from(picture.at(ansa_x, 255)) / 65_535.0 - 0.3).abs() < 0.01);
    assert_eq!(a.at(ansa_x, 255), 0);
}

#[test]
fn edge_points_have_their_noise_and_arc() {
    let camera = Camera::<f64>::try_new(&Config::ideal(Model::Pinhole, 1024, 1024, 4000.0)).unwrap();
    let pose = towards_centre([3e6, 0.0, 0.0], 0.0);
    let limb = EllipsoidLimb::try_new([256.6e3, 251.4e3, 248.3e3], &pose).unwrap();
    let arc = LimbArc { middle_rad: 1.0, length_rad: FRAC_PI_2, count: 500 };
    let azimuths: Vec<f64> = limb.rays(arc).into_iter().map(|ray| limb.azimuth_rad(ray)).collect();
    assert!(azimuths.iter().all(|a| (a - 1.0).abs() < FRAC_PI_2 / 2.0) && azimuths.len() == 500);
    let (mut square, mut count) = (0.0, 0.0);
    for seed in 0..40 {
        let points = limb.points(&camera, arc, EdgeNoise::White { sigma_px: 0.3 }, seed);
        assert!(points.len() == 500 && points[499].arc_px > points[0].arc_px);
        for p in &points {
            square += (p.point.u - p.exact.u).powi(2) + (p.point.v - p.exact.v).powi(2);
            count += 2.0;
        }
        assert_eq!(points, limb.points(&camera, arc, EdgeNoise::White { sigma_px: 0.3 }, seed));
    }
    assert!((square / count / 0.09 - 1.0).abs() < 0.05, "{}", square / count);
}

/// Exact points determine the position by the least squares of Christian and Robinson (book/theory/math.md, 13.3).
#[test]
fn exact_points_give_back_the_position() {
    let radii_m = [256.6e3, 251.4e3, 248.3e3];
    let pose = towards_centre([1.2e6, -2e6, 0.7e6], 0.5);
    let limb = EllipsoidLimb::try_new(radii_m, &pose).unwrap();
    let rotation = pose.fixed_from_camera().unwrap();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for ray in limb.rays(LimbArc { middle_rad: 2.0, length_rad: 2.0, count: 60 }) {
        let body = Vector3::from(rotation.apply(&UnitVec3::try_new(ray).unwrap()).xyz());
        let scaled = body.component_div(&Vector3::from(radii_m)).normalize();
        normal += scaled * scaled.transpose();
        right += scaled;
    }
    let n = normal.try_inverse().unwrap() * right;
    let position_m = n.component_mul(&Vector3::from(radii_m)) / (n.norm_squared() - 1.0).sqrt();
    assert!((position_m + Vector3::from(pose.position_m)).norm() < 1.0, "{position_m:?}");
}

#[test]
fn trials_cover_sizes_and_phases_and_show_limb() {
    let trials = Trials {
        body: Ellipsoid::named("enceladus"),
        camera: Config::ideal(Model::Pinhole, 200, 160, 1500.0),
        detector: Detector { read_noise: 0.01, ..Detector::default() },
        diameter_px: [8.0, 2000.0],
        phase_deg: [0.0, 165.0],
    };
    let (mut small, mut large, mut seen) = (0, 0, 0);
    for seed in 0..200 {
        let scene = trials.scene(seed).unwrap();
        let truth = scene.truth("", 0.0).unwrap();
        let diameter_px = 2.0 * 1500.0 * truth.half_angle_deg.to_radians().tan();
        assert!((7.5..2100.0).contains(&diameter_px), "{seed}: {diameter_px}");
        assert!((0.0..165.0).contains(&truth.phase_deg.unwrap()));
        small += u32::from(diameter_px < 40.0);
        large += u32::from(diameter_px > 200.0);
        seen += u32::from(scene.visible_limb_px().unwrap() > 10.0);
    }
    println!("{small} small, {large} large, {seen} with limb");
    assert!(small > 40 && large > 60 && seen > 190);
    assert_eq!(trials.scene(3), trials.scene(3));
    assert_ne!(trials.scene(3).unwrap().render(), trials.scene(4).unwrap().render());
}

#[test]
fn bodies_that_cannot_be_are_refused_with_their_key() {
    let says = |change: &dyn Fn(&mut Ellipsoid)| {
        let mut body = Ellipsoid::named("saturn");
        change(&mut body);
        let (key, rule) = body.check().unwrap_err();
        format!("{key}: {rule}")
    };
    assert!(says(&|b| b.name = Some("vulcan".into())).contains("name: \"vulcan\" has no radii here"));
    assert!(says(&|b| b.radii_km = Some([1.0; 3])).starts_with("radii_km: is not allowed with name"));
    assert!(says(&|b| b.name = None).starts_with("radii_km: is missing"));
    let radii = |radii_km| says(&|b| (b.name, b.radii_km) = (None, Some(radii_km)));
    assert!(radii([1.0, -1.0, 1.0]).starts_with("radii_km: ") && radii([1.0, f64::NAN, 1.0]).contains("refused"));
    let ring = Ring { inner_km: 2e5, outer_km: 1e5, opacity: 0.5, brightness: 0.5 };
    assert!(says(&|b| b.rings = vec![ring]).starts_with("rings.outer_km: 100000 is refused"));
    assert!(
        says(&|b| b.haze = Some(Haze { scale_height_km: 0.0, ..Haze::default() })).contains("haze.scale_height_km")
    );
    assert!(says(&|b| b.sun = Some([0.0; 3])).starts_with("sun: must be a direction"));
    assert!(says(&|b| b.surface.minnaert = f64::NAN).starts_with("surface.minnaert: NaN is refused"));
    assert_eq!(Ellipsoid::named("saturn").check(), Ok(()));
    // A camera inside the body, or without a Sun.
    let camera = Config::ideal(Model::Pinhole, 64, 64, 100.0);
    let inside = scene(even([100.0; 3]), camera.clone(), towards_centre([9e4, 0.0, 0.0], 0.0));
    assert!(inside.render().is_err() && inside.truth("", 0.0).is_err());
    let dark = Scene { light: Light::Full, ..scene(even([100.0; 3]), camera, towards_centre([9e5, 0.0, 0.0], 0.0)) };
    assert!(dark.render().is_err());
}
