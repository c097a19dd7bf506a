//! Errors of directions in pictures, and flights that draw from them.

use hzn_files::truth::Truth;
use hzn_fuse::input::{Body, Inputs};
use hzn_fuse::simulated::{Errors, Moment};
use hzn_nav::frames::{Cam, Covariance, Rotation, Vector};
use hzn_sim::Scenario;
use nalgebra::{Matrix3, Vector3};

/// Time for which errors come from one flight and camera, s.
const BLOCK_S: f64 = 20.0;
/// Differences of angle and height that count as equally far, degrees and km.
const ALIKE: [f64; 2] = [5.0, 40.0];

/// The error of one direction. Vectors are in the frame of [`frame`].
#[derive(Debug, Clone, Copy)]
struct Residual {
    body: Body,
    /// Angle from the boresight, degrees.
    off_axis_deg: f64,
    altitude_km: f64,
    error: Vector3<f64>,
    covariance: Matrix3<f64>,
    common: Option<Matrix3<f64>>,
    by_limb_height: Vector3<f64>,
}

/// The errors of a flight, for each camera.
pub(super) struct Residuals {
    cameras: Vec<Vec<Residual>>,
}

/// Returns the rotation from the camera frame to that of a direction: z along it, x away from the boresight.
fn frame(axis: &Vector<Cam>) -> Matrix3<f64> {
    let axis = axis.as_inner();
    let away = axis * axis.z - Vector3::z();
    let x = away.try_normalize(1e-9).unwrap_or_else(Vector3::x);
    Matrix3::from_rows(&[x.transpose(), axis.cross(&x).transpose(), axis.transpose()])
}

fn off_axis_deg(axis: &Vector<Cam>) -> f64 {
    let [_, _, z] = axis.xyz();
    z.clamp(-1.0, 1.0).acos().to_degrees()
}

impl Residuals {
    /// Compares the recordings of a flight with the truth.
    pub(super) fn new(scene: &Scenario, inputs: &Inputs) -> anyhow::Result<Self> {
        let mut cameras = Vec::new();
        for (one, recording) in scene.by_camera().iter().zip(&inputs.recordings) {
            let flight = one.flight()?;
            let mut residuals = Vec::new();
            for seen in &recording.seen {
                let Some(row) = recording.rows.get(seen.row) else { continue };
                let Some(frame_of) = flight.frames.get(row.index as usize) else { continue };
                let kinds = one.bodies.iter().filter(|k| super::recordings::is_earth(**k) == (seen.body == Body::Limb));
                let Some(&kind) = kinds.clone().next() else { continue };
                let truth: Truth = frame_of.scene.body_truth(kind, &frame_of.file, frame_of.time_s)?;
                let axis = Vector::new(truth.axis_x, truth.axis_y, truth.axis_z);
                let to_frame = frame(&axis);
                residuals.push(Residual {
                    body: seen.body,
                    off_axis_deg: off_axis_deg(&axis),
                    altitude_km: row.altitude_km.unwrap_or(0.0),
                    error: to_frame * (seen.axis - axis).as_inner(),
                    covariance: to_frame * seen.covariance_rad2.as_inner() * to_frame.transpose(),
                    common: seen.common_rad2.map(|c| to_frame * c.as_inner() * to_frame.transpose()),
                    by_limb_height: to_frame * seen.by_limb_height.as_inner(),
                });
            }
            cameras.push(residuals);
        }
        Ok(Self { cameras })
    }
}

/// All errors, each list from one flight and camera.
pub(super) struct Donors {
    lists: Vec<Vec<Residual>>,
}

impl Donors {
    pub(super) fn new(flights: Vec<Residuals>) -> Self {
        Self { lists: flights.into_iter().flat_map(|f| f.cameras).filter(|list| !list.is_empty()).collect() }
    }

    /// Describes the errors.
    pub(super) fn describe(&self) -> String {
        let of = |body: Body| self.lists.iter().flatten().filter(move |r| r.body == body);
        let rms = |body: Body| {
            let n = of(body).count().max(1) as f64;
            (of(body).map(|r| r.error.norm_squared()).sum::<f64>() / n).sqrt().to_degrees()
        };
        let worst = |body: Body| of(body).map(|r| r.error.norm().to_degrees()).fold(0.0, f64::max);
        format!(
            "The directions of these pictures: {} limbs, {:.3}° RMS, largest {:.2}°; {} Suns, {:.3}° RMS, largest \
             {:.2}°.",
            of(Body::Limb).count(),
            rms(Body::Limb),
            worst(Body::Limb),
            of(Body::Sun).count(),
            rms(Body::Sun),
            worst(Body::Sun)
        )
    }

    /// Returns a source of errors.
    pub(super) fn draw(&self, seed: u64) -> Drawn<'_> {
        Drawn { donors: self, seed }
    }
}

/// Errors for one flight.
pub(super) struct Drawn<'a> {
    donors: &'a Donors,
    seed: u64,
}

impl Drawn<'_> {
    /// Returns the error of the donor's direction that is most alike.
    fn find(&self, at: &Moment, axis: &Vector<Cam>) -> Option<Residual> {
        let block = (at.time_s / BLOCK_S).floor() as u64;
        let lists: Vec<&Vec<Residual>> =
            self.donors.lists.iter().filter(|list| list.iter().any(|r| r.body == at.body)).collect();
        let key = [self.seed, at.camera as u64, at.body as u64, block];
        let place = (key.iter().fold(0, |hash, part| mix(hash ^ part)) % lists.len().max(1) as u64) as usize;
        let off_deg = off_axis_deg(axis);
        let far = |r: &Residual| {
            ((r.off_axis_deg - off_deg) / ALIKE[0]).powi(2) + ((r.altitude_km - at.altitude_km) / ALIKE[1]).powi(2)
        };
        let list = lists.get(place)?.iter().filter(|r| r.body == at.body);
        list.min_by(|a, b| far(a).total_cmp(&far(b))).copied()
    }
}

impl Errors for Drawn<'_> {
    fn draw(&mut self, at: &Moment, axis: &Vector<Cam>) -> (Vector<Cam>, Covariance<Cam>) {
        let to_camera = frame(axis).transpose();
        match self.find(at, axis) {
            Some(r) => ((to_camera * r.error).into(), (to_camera * r.covariance * to_camera.transpose()).into()),
            None => (Vector::zeros(), Covariance::isotropic(1.0)),
        }
    }

    fn common(&mut self, at: &Moment, axis: &Vector<Cam>) -> Option<Covariance<Cam>> {
        let to_camera = frame(axis).transpose();
        Some((to_camera * self.find(at, axis)?.common? * to_camera.transpose()).into())
    }

    fn by_limb_height(&mut self, at: &Moment, axis: &Vector<Cam>) -> Vector<Cam> {
        self.find(at, axis).map_or_else(Vector::zeros, |r| (frame(axis).transpose() * r.by_limb_height).into())
    }
}

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Makes one limb in fifty 52° wrong, with a sigma of 0.2°.
pub(super) fn replace_one_in_fifty(inputs: &mut Inputs) {
    let sigma = 0.2f64.to_radians();
    for (camera, recording) in inputs.recordings.iter_mut().enumerate() {
        let limbs = recording.seen.iter_mut().filter(|s| s.body == Body::Limb);
        for (k, seen) in limbs.enumerate().filter(|(k, _)| mix((*k as u64) << 8 | camera as u64).is_multiple_of(50)) {
            let across = frame(&seen.axis).transpose() * Vector3::new((k as f64).cos(), (k as f64).sin(), 0.0);
            seen.axis = Rotation::from_scaled_axis((across * 52f64.to_radians()).into()) * seen.axis;
            seen.covariance_rad2 = Covariance::across(&seen.axis, sigma.powi(2));
            seen.common_rad2 = None;
        }
    }
}
