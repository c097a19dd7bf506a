//! Pictures that show something other than a limb: effects of lenses, windows, vehicles and the sky on a dark picture.
//!
//! A [`Trial`] is one picture with its truth, drawn by kind and seed. A flare is a figure on the detector: its rings,
//! discs and polygons are circles and polygons there for every lens. A limb is a circle on the sphere of directions.
//! Through many lenses both look alike to the eye, so a sensor must measure which one it sees.
//!
//! | file | content |
//! |---|---|
//! | `kind` | the list of artefacts |
//! | `lens` | the cameras of the trials |
//! | `shape` | light and cover of a figure at a point of the picture |
//! | `solid` | objects in space as a lens shows them: panels and windows |
//! | `circle`, `polygon`, `streak`, `glare`, `panel`, `window`, `moon`, `clouds` and more | one figure each |
//! | `recipe` | the figures of a kind |
//! | `clear_limb` | the check that figures leave a limb clear |
//! | `trial` | a picture with its truth: without a limb, or with one and the artefact next to it |
//! | `outcome` | a sensor's result for a trial, and whether it is false |
//! | `dice` | random numbers in sequence |
//!
//! Lengths of figures are drawn in units of the picture's diagonal, edges and widths in pixels, light in fractions of
//! full scale. Each figure's `draw` documents its ranges.

mod circle;
mod clear_limb;
mod clouds;
mod dice;
mod glare;
mod kind;
mod lens;
mod lights;
mod moon;
mod outcome;
mod panel;
mod polygon;
mod recipe;
mod shape;
mod solid;
mod streak;
mod trial;
mod vignetted;
mod window;

#[cfg(test)]
mod tests;

pub use kind::Kind;
pub use outcome::{Detection, FALSE_SIGMAS, GROSS_DEG, Outcome, PriorKnowledge, process_trial};
pub use trial::Trial;
