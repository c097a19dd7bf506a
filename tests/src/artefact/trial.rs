//! A picture with its truth.

use core::f64::consts::PI;

use hzn_core::Prior;
use hzn_core::camera::{self, Camera};
use hzn_core::ellipsoid::LimbCone;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use hzn_files::truth::Truth;
use hzn_sim::detector::{Detector, Plane};
use hzn_sim::error::SceneError;
use hzn_sim::globe::Globe;
use hzn_sim::image_circle::apply_image_circle;
use hzn_sim::picture::Picture;
use hzn_sim::pose::{Look, Pose, position_m};
use hzn_sim::scene::{Disc, Profile, Scene, Sky};
use hzn_sim::texture::Clouds;
use nalgebra::{Matrix3, Vector3};

use super::clear_limb::ClearLimb;
use super::dice::Dice;
use super::kind::Kind;
use super::lens;
use super::lights::Lights;
use super::recipe::{self, Figures};
use super::shape::{Canvas, Shape};

/// Parts of a trial. Each part has independent random numbers.
#[derive(Clone, Copy)]
enum Part {
    Lens = 1,
    Place,
    Detector,
    Attitude,
    /// Figures of the first attempt; later attempts follow.
    Figures = 16,
}

impl Part {
    fn dice(self, kind: Kind, seed: u64) -> Dice {
        self.nth(kind, seed, 0)
    }
    fn nth(self, kind: Kind, seed: u64, index: u64) -> Dice {
        let kind = Kind::ALL.iter().position(|&k| k == kind).unwrap_or_default() as u64;
        Dice::new(seed.wrapping_mul(64).wrapping_add(kind), self as u64 + index)
    }
}

/// Smallest angle between the picture and the limb if no limb may be in view, degrees.
const MIN_MARGIN_DEG: f64 = 3.0;
/// Largest number of attempts to find figures that do not disturb the limb.
const MAX_ATTEMPTS: u64 = 60;
/// One picture of an artefact, with its truth.
pub struct Trial {
    /// The artefact in the picture.
    pub kind: Kind,
    /// Seed of the picture. Equal kinds and seeds give equal pictures on any number of threads.
    pub seed: u64,
    /// Lens, position, body, limb and detector. If [`Trial::limb`] is false, the body is not drawn.
    pub scene: Scene,
    /// True if a limb is in the picture.
    pub limb: bool,
    /// The truth about the picture.
    pub truth: Truth,
    /// Half-angles in radians of the cones that fit the discs of the picture best, for discs with their edge in view.
    pub disc_half_angles_rad: Vec<f64>,
    figures: Figures,
    stars: Option<Lights>,
}

impl core::fmt::Debug for Trial {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "Trial({} {}, limb: {})", self.kind.name(), self.seed, self.limb)
    }
}

impl Trial {
    /// Makes a picture of the artefact alone, from an altitude of 60 to 600 km. The camera looks away from the body, so
    /// its limb stays at least 3° outside the picture. For kinds of ground it looks down onto the body.
    ///
    /// # Errors
    /// Fails if the scene is invalid; this would be an error in the ranges.
    pub fn without_limb(kind: Kind, seed: u64) -> Result<Self, SceneError> {
        let camera = lens::draw(&mut Part::Lens.dice(kind, seed), kind);
        let dice = &mut Part::Place.dice(kind, seed);
        let position = draw_position(dice);
        let half_angle = cone(position, 30.0)?.half_angles_rad();
        let corner_rad = farthest_rad(&camera)?;
        let off_nadir = if kind.is_ground() {
            let max_rad = half_angle.0.min(half_angle.1) - corner_rad - (MIN_MARGIN_DEG + 1.5).to_radians();
            dice.between(0.0, max_rad.max(0.0))
        } else {
            let min_rad = half_angle.0.max(half_angle.1) + corner_rad + MIN_MARGIN_DEG.to_radians();
            dice.between(min_rad.min(PI), PI)
        };
        let (azimuth, roll) = (dice.turn(), dice.turn());
        let mut scene = Scene::new(camera, Pose::looking(position, Look::off_nadir(off_nadir, azimuth, roll)));
        set_detector(&mut scene, kind, seed);
        let canvas = Canvas::from_camera(&scene.camera);
        let dice = &mut Part::Figures.dice(kind, seed);
        let figures = recipe::draw(kind, seed, dice, &canvas, &scene.camera)?;
        let stars = (!kind.is_ground()).then(|| Lights::stars(dice, &canvas));
        Self::with_figures(kind, seed, scene, false, figures, stars)
    }

    /// Makes a picture of a clean limb with the artefact next to it. The whole limb is lit, and it crosses the picture
    /// over at least half of its width. The artefact is in view, leaves at least 90 % of the limb undisturbed and at
    /// least half of the sky dark. Kinds of ground become the texture inside the limb. Returns `None` if this seed
    /// gives no suitable picture.
    ///
    /// # Errors
    /// Fails like [`Trial::without_limb`].
    pub fn with_limb(kind: Kind, seed: u64) -> Result<Option<Self>, SceneError> {
        let Some((scene, clear_limb)) = draw_limb_scene(kind, seed)? else { return Ok(None) };
        let canvas = Canvas::from_camera(&scene.camera);
        for attempt in 0..MAX_ATTEMPTS {
            let figures = match kind.is_ground() {
                true => Figures::default(),
                false => {
                    let dice = &mut Part::Figures.nth(kind, seed, attempt);
                    recipe::draw(kind, seed, dice, &canvas, &scene.camera)?
                }
            };
            if clear_limb.accepts(kind, &figures) {
                return Self::with_figures(kind, seed, scene, true, figures, None).map(Some);
            }
        }
        Ok(None)
    }

    fn with_figures(
        kind: Kind,
        seed: u64,
        scene: Scene,
        limb: bool,
        figures: Figures,
        stars: Option<Lights>,
    ) -> Result<Self, SceneError> {
        let truth = scene.truth(&format!("{}-{seed}.png", kind.name()), 0.0)?;
        let disc_half_angles_rad = fit_half_angles_rad(&Camera::try_new(&scene.camera)?, &figures.discs);
        Ok(Self { kind, seed, scene, limb, truth, disc_half_angles_rad, figures, stars })
    }

    /// Returns the same trial without the artefact.
    #[must_use]
    pub fn cleaned(self) -> Self {
        Self { figures: Figures::default(), stars: None, disc_half_angles_rad: Vec::new(), ..self }
    }

    /// Renders the picture, 8 bits.
    ///
    /// # Errors
    /// Fails like [`Scene::render`].
    pub fn render(&self) -> Result<Picture, SceneError> {
        let lens = Camera::<f64>::try_new(&self.scene.camera)?;
        let (w, h) = (usize::from(self.scene.camera.width), usize::from(self.scene.camera.height));
        let mut plane = match self.limb {
            true => self.scene.light()?.into_iter().next().unwrap_or(Plane { width: w, data: vec![0.0; w * h] }),
            false => Plane { width: w, data: vec![self.scene.sky.brightness as f32; w * h] },
        };
        if let Some(stars) = &self.stars {
            stars.paint(&mut plane);
        }
        for shape in &self.figures.shapes {
            shape.paint(&mut plane);
        }
        let plane = apply_image_circle(plane.blurred(self.scene.detector.psf_sigma_px), &lens);
        Ok(self.scene.detector.expose(&[plane], self.scene.seed))
    }

    /// Returns the prior that a navigation system would give: the position. With `attitude_sigma_deg` it also has an
    /// attitude with this error (1σ) about each axis.
    pub fn prior(&self, attitude_sigma_deg: Option<f64>) -> Prior<f64> {
        let pose = &self.scene.pose;
        Prior {
            altitude_m: Some(Globe::new(&self.scene.body).altitude_m(pose.position_m)),
            position_m: Some(pose.position_m),
            fixed_from_camera: attitude_sigma_deg.and_then(|deg| self.told_pose(deg).fixed_from_camera()),
            attitude_sigma_rad: attitude_sigma_deg.map(f64::to_radians),
            ..Prior::default()
        }
    }

    /// Returns the attitude with this error (1σ) about each axis, as a navigation system would give it: a quaternion,
    /// scalar first, from the camera to ECEF.
    pub fn attitude_wxyz(&self, sigma_deg: f64) -> [f64; 4] {
        self.told_pose(sigma_deg).q_fixed_from_camera_wxyz
    }

    fn told_pose(&self, sigma_deg: f64) -> Pose {
        let dice = &mut Part::Attitude.dice(self.kind, self.seed);
        self.scene.pose.disturbed([0; 3].map(|_| sigma_deg.to_radians() * dice.normal()))
    }
}

/// Draws a scene with a clean limb through a point well inside the picture. Kinds of ground become the texture inside
/// the limb. Returns `None` if this seed gives no suitable limb.
fn draw_limb_scene(kind: Kind, seed: u64) -> Result<Option<(Scene, ClearLimb)>, SceneError> {
    let camera = lens::draw(&mut Part::Lens.dice(kind, seed), kind);
    let dice = &mut Part::Place.dice(kind, seed);
    let position = draw_position(dice);
    let limb_height_km = dice.between(12.0, 22.0);
    let cone = cone(position, limb_height_km)?;
    let half_angle_rad = cone.mean_half_angle_rad();
    let lens = Camera::<f64>::try_new(&camera)?;
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    // The limb passes through this point in any direction.
    let (u, v) = (dice.between(0.25, 0.75) * w, dice.between(0.25, 0.75) * h);
    let Some(ray) = lens.unproject(ImagePoint { u, v }) else { return Ok(None) };
    let axis = offset_direction(Vector3::from(ray.xyz()), half_angle_rad, dice.turn());
    let pose = point_axis(position, axis, Vector3::from(cone.axis.xyz()), dice.turn());
    let mut scene = Scene::new(camera, pose);
    scene.body.limb_height_km = limb_height_km;
    scene.profile = Profile::Exponential { scale_km: dice.between(4.0, 8.0) };
    scene.disc = Disc { surface: dice.between(0.35, 0.85), clouds: None, band: None };
    set_detector(&mut scene, kind, seed);
    if kind.is_ground() {
        let clouds = Clouds { cover: 0.5, largest_km: 600.0, seed, ..Clouds::default() };
        scene.disc.clouds = Some(clouds);
    }
    let clear_limb = ClearLimb::try_new(&scene, axis, half_angle_rad)?;
    Ok(clear_limb.map(|clear_limb| (scene, clear_limb)))
}

/// Returns a position anywhere over the Earth, in ECEF metres, at 60 to 600 km. The altitude is uniform in its
/// logarithm.
fn draw_position(dice: &mut Dice) -> [f64; 3] {
    let lat_deg = libm::asin(dice.between(-1.0, 1.0)).to_degrees();
    position_m(lat_deg, dice.between(-180.0, 180.0), dice.between_log(60.0, 600.0))
}

/// Returns the limb's cone for a limb height in kilometres.
fn cone(position_m: [f64; 3], limb_height_km: f64) -> Result<LimbCone<f64>, SceneError> {
    let globe = Globe::new(&hzn_core::body::Config::default()).raised(limb_height_km * 1e3);
    LimbCone::try_new(position_m, globe.a_m, globe.b_m).ok_or(SceneError::Pose)
}

/// Returns the largest angle off the axis in a picture, radians.
fn farthest_rad(camera: &camera::Config) -> Result<f64, SceneError> {
    let lens = Camera::<f64>::try_new(camera)?;
    let (w, h) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
    let corner = |(u, v)| lens.unproject(ImagePoint { u, v }).map(|s| libm::acos(s.xyz()[2].clamp(-1.0, 1.0)));
    let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|c| corner(c).unwrap_or(lens.theta_max_rad()));
    Ok(corners.into_iter().fold(0.0, f64::max))
}

/// Sets detector, sky and noise: blur 0.5 to 1.4 px, noise 0.2 to 2.5 % of full scale, sky brightness up to 6 %.
fn set_detector(scene: &mut Scene, kind: Kind, seed: u64) {
    let dice = &mut Part::Detector.dice(kind, seed);
    let full_well = dice.chance(0.5).then(|| dice.between_log(1e3, 3e4));
    scene.detector = Detector {
        psf_sigma_px: dice.between(0.5, 1.4),
        read_noise: dice.between_log(0.002, 0.025),
        full_well_electrons: full_well,
        ..Detector::default()
    };
    scene.sky = Sky { brightness: dice.between(0.0, 0.06), ..Sky::default() };
    scene.seed = seed.wrapping_mul(977).wrapping_add(kind as u64);
}

/// Returns a unit vector at an angle from another one, in a direction about it.
fn offset_direction(from: Vector3<f64>, angle_rad: f64, turn_rad: f64) -> Vector3<f64> {
    let [a, b] = perpendicular(from);
    let (sin, cos) = libm::sincos(turn_rad);
    from * libm::cos(angle_rad) + (a * cos + b * sin) * libm::sin(angle_rad)
}

/// Returns two unit vectors perpendicular to a third one, right-handed with it.
fn perpendicular(e: Vector3<f64>) -> [Vector3<f64>; 2] {
    let a = e.cross(&Vector3::ith(e.iamin(), 1.0)).normalize();
    [a, e.cross(&a)]
}

/// Returns a camera whose `axis` (camera frame) points along `to` (ECEF), turned about it.
fn point_axis(position_m: [f64; 3], axis: Vector3<f64>, to: Vector3<f64>, turn_rad: f64) -> Pose {
    let frame = |e: Vector3<f64>, turn: f64| {
        let [a, b] = perpendicular(e);
        let (sin, cos) = libm::sincos(turn);
        Matrix3::from_columns(&[e, a * cos + b * sin, b * cos - a * sin])
    };
    let fixed_from_camera = frame(to, turn_rad) * frame(axis, 0.0).transpose();
    Pose::from_axes(position_m, [0, 1, 2].map(|i| fixed_from_camera.column(i).into_owned().into()))
}

/// Returns the half-angles of the cones that fit discs of the picture (middle and radius in pixels).
fn fit_half_angles_rad(lens: &Camera<f64>, discs: &[([f64; 2], f64)]) -> Vec<f64> {
    let (w, h) = (f64::from(lens.width()), f64::from(lens.height()));
    let half_angle = |&(middle, radius): &([f64; 2], f64)| {
        let steps = 6_000;
        let rays: Vec<Vector3<f64>> = (0..steps)
            .filter_map(|i| {
                let (sin, cos) = libm::sincos(2.0 * PI * f64::from(i) / f64::from(steps));
                let (u, v) = (middle[0] + radius * cos, middle[1] + radius * sin);
                let inside = u >= 0.0 && v >= 0.0 && u <= w - 1.0 && v <= h - 1.0;
                inside.then(|| lens.unproject(ImagePoint { u, v })).flatten().map(|s| Vector3::from(s.xyz()))
            })
            .collect();
        if rays.len() < 12 {
            return None;
        }
        // The plane through the ends of the rays has a normal with the least spread.
        let mean = rays.iter().sum::<Vector3<f64>>() / rays.len() as f64;
        let spread: Matrix3<f64> = rays.iter().map(|r| (r - mean) * (r - mean).transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        // The axis is on the side of the lit disc.
        let towards = |r: &Vector3<f64>| {
            let p = lens.project(&UnitVec3::try_new((r + normal * 0.01).into())?)?;
            let distance = |p: ImagePoint<f64>| libm::hypot(p.u - middle[0], p.v - middle[1]);
            let own = lens.project(&UnitVec3::try_new((*r).into())?)?;
            Some(distance(p) < distance(own))
        };
        let middle_ray = rays.get(rays.len() / 2)?;
        let sign = if towards(middle_ray)? { 1.0 } else { -1.0 };
        Some(libm::acos((sign * normal.dot(&mean)).clamp(-1.0, 1.0)))
    };
    discs.iter().filter_map(half_angle).collect()
}
