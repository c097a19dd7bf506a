//! `[fit]` of sensor.toml: the fit of the cone.

use crate::base::keys::{choices, section};

choices! {
    /// Which half-angle the fitted cone has.
    pub enum HalfAngle {
        /// The half-angle is fitted freely, then fused with the expected one by their covariances; the result is never
        /// worse than the better of the two.
        // It is the default because it is never worse than the others. From 80 km, with errors of 1 px over 300 px, the
        // RMS is 0.54° (known), 0.18° (free) and 0.18° (fused) if the limb height is known to 8 km; it is 0.05°, 0.18°
        // and 0.05° if it is known to 50 m.
        @0 Fused = "fused";
        /// The half-angle is the expected one, exactly.
        @1 Known = "known";
        /// The half-angle is fitted; the expected one is only a start.
        @2 Free = "free";
    }
}

choices! {
    /// How the cone is fitted.
    pub enum Method {
        /// Gauss-Newton on the sphere, with Tukey's weights and the expected half-angle.
        @- Sphere = "sphere";
        /// Linear least squares on the plane z = 1, half-angle free (Braun & Barf 2022, (24)).
        @- Direct = "direct" needs "dlr";
        /// The axis of the ellipse or hyperbola through the points (Braun & Barf 2022, (17), (18) corrected).
        @- Conic = "conic" needs "dlr";
        /// An elliptic cone by total least squares (Wang et al. 2022, (10) to (17)).
        @- Tls = "tls" needs "zju";
        /// An elliptic cone by total least squares, in which every point is weighted by the effect of an error of one
        /// pixel (Wang et al. 2022, (18) to (21)).
        @- Wtls = "wtls" needs "zju";
        /// Linear least squares in scaled space (Christian & Robinson 2016), for comparison: biased on short arcs.
        @- LeastSquares = "least-squares" needs "position";
        /// Generalised total least squares in scaled space, in closed form and without bias (math.md, 13.9).
        @- GeneralisedTls = "generalised-tls" needs "position";
        /// The centre of a circle gives the direction and its radius the half-angle; this is right only for a camera
        /// that points at the body (Barf 2014, 2.2.4).
        @- Circle = "circle" needs "horace";
    }
}

section! {
    /// `[fit]` of sensor.toml: the fit of the cone.
    "fit" pub struct Config: Copy {
        /// How the cone is fitted.
        @- method: Method = Method::Sphere, [choice];
        /// Which half-angle the fitted cone has.
        @90 half_angle: HalfAngle = HalfAngle::Fused, [choice];
        /// Whether the fit gives the position of the body's centre: the whole vector with its covariance. An ellipsoid
        /// then needs its orientation in each prior: an attitude, or for a body of revolution its pole.
        ///
        /// The position and the axis of one picture hold the same information. A filter must use only one of them.
        @- position: Option<bool> = None, ["true or false"]
            { needs: "position", unset: "true for `ellipsoid` and the planets with a name", example: "true" };
        /// Largest 1σ at which the rotation about the line to the body is reported, degrees; 0 never reports it. The
        /// rotation needs `fit.position` and a body that is not a sphere.
        ///
        /// A rotation with a 1σ of 1 degree is as accurate as that of a magnetometer. The 1σ follows mostly from the
        /// second harmonic of the limb height: see `body.limb_height_harmonic_sigma_km`.
        @- yaw_limit_deg: f64 = 1.0, [0.0 to 180.0] { needs: "position" };
        /// For `wtls`: points are weighted where the axis is farther from the optical axis than this, degrees; 0 always
        /// weights them.
        @- weigh_above_deg: f64 = 0.0, [0.0 to 180.0] { needs: "zju" };
    }
}
