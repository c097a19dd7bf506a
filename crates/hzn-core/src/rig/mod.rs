//! Several cameras (heads) that see one body at one epoch: one direction, and a check of each head by the others.
//!
//! The error of one head is mostly the height of its limb, which no filter averages away. Two heads that look at
//! opposite parts of the limb see the same height error with opposite signs. Therefore the cosine of the half-angle is
//! estimated together with the axis, and no altitude is needed.
//!
//! # Equations
//!
//! Head k gives the freely fitted cone (e_k, c_k) with its covariance C_k on (δ₁, δ₂, δc), turned into the axes of the
//! vehicle. C_k also has the error of the mount and the part of the limb height that is the head's own. The unknowns
//! are the common axis e and the common cosine c. With the tangent bases B of e and B_k of e_k, the residual r_k and
//! the derivative J_k of what head k sees are
//!
//! ```text
//! r_k = (−B_kᵀ e, c_k − c),   J_k = [[B_kᵀ B, 0], [0, 1]],   A = Σ J_kᵀ C_k⁻¹ J_k,   δ = A⁻¹ Σ J_kᵀ C_k⁻¹ r_k
//! ```
//!
//! Heads of different bands see limbs of different heights. Each such limb group has a cosine c of its own. From the
//! equations of a head, the cosines of the other groups are eliminated (Schur complement), so that A stays 3×3.
//!
//! The next epoch shares a part of the error of each head: mount, lens, common shift and tilt of its edge, weather of
//! the limb. With the covariance K_k of this part, the joint answer shares Σ G_k K_k G_kᵀ with the next one, where
//! G_k = A⁻¹ J_kᵀ C_k⁻¹. A wrong limb height of all heads is in the common cosine, and not in the axis.
//!
//! The check compares each head with the solution of the others: q_k = νᵀ (C_k + J_k A₋ₖ⁻¹ J_kᵀ)⁻¹ ν has the χ²
//! distribution with three degrees of freedom, or with two for a head that is alone in its limb group. This is solution
//! separation, as in the integrity monitoring of navigation receivers (RAIM). A head is excluded only if exactly one
//! exclusion leaves heads that agree; otherwise nothing says which head is wrong, and there is no answer. Two heads can
//! notice a fault and cannot name it.
//!
//! The check does not see what all heads share: a wrong scale of all lenses, a clock, a tilt of the limb. It does not
//! see a turn of one mount about the direction to the body, either, but this turn does not move the axis.
//!
//! # Example
//!
//! ```
//! use hzn_core::frames::{Cam, Cov3, Rotation, UnitVec3};
//! use hzn_core::report::Free;
//! use hzn_core::rig::{Config, Head, Rig};
//!
//! // Two cameras that look along the vehicle's axes z and −x, and a body between them.
//! let mounts = [[1.0, 0.0, 0.0, 0.0], [0.5f64.sqrt(), 0.0, -(0.5f64.sqrt()), 0.0]];
//! let mounts = mounts.map(|q| Rotation::assume_from_quaternion(q).expect("a rotation"));
//! let body = UnitVec3::try_new([-1.0, 0.1, 1.0]).expect("not of length zero");
//! let heads = mounts.map(|vehicle_from_camera| {
//!     let axis = vehicle_from_camera.inverse().apply(&body);
//!     let [x, y, z] = axis.xyz();
//!     // A sigma of 1 mrad in both directions across the axis.
//!     let upper = [1.0 - x * x, -x * y, -x * z, 1.0 - y * y, -y * z, 1.0 - z * z].map(|p| p * 1e-6);
//!     let free = Free {
//!         axis,
//!         covariance: Cov3::<Cam, f64>::from_upper(upper),
//!         cos: 0.4,
//!         var_cos: 1e-6,
//!         axis_with_cos: Some([0.0; 3]),
//!         cos_per_px: 1e-3,
//!         common: None,
//!     };
//!     Head::new(&free, &vehicle_from_camera, &[0.0; 6], 0.0)
//! });
//! let joint = Rig::new(&Config::default())?.join(&heads, 0.0)?;
//! assert!(joint.axis.angle_rad(&body) < 1e-9);
//! assert_eq!(joint.heads_used, 0b11);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod check;
mod coarse;
mod epoch;
mod glimpse;
mod head;
mod joint;
mod mount;
mod unanswered;
mod weather;

pub use check::{Config, Rig};
pub use coarse::{Coarse, GlimpsedHead, Light, coarse};
pub use epoch::{Answered, Common, Epoch, EpochAnswer};
pub use glimpse::Glimpse;
pub use head::{Head, MOST_HEADS};
pub use joint::{Joint, NoJoint};
pub use mount::Mount;
pub use unanswered::Unanswered;
pub use weather::Limb;
