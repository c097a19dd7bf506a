//! Pictures that show something else than a limb: what lenses, windows, vehicles and the sky do to a dark picture.
//!
//! A [`Trial`] is one picture with its truth, drawn by kind and seed. A flare is a figure of the picture: its rings,
//! discs and polygons are circles and polygons on the detector, whatever the lens. A limb is a circle on the sphere of
//! directions. Through many lenses the two look alike to the eye, so a sensor must measure which it sees.
//!
//! | file | idea |
//! |---|---|
//! | `kind` | which artefacts there are |
//! | `lens` | the cameras that are drawn |
//! | `shape` | light and cover of a figure at a place of the picture |
//! | `solid` | things in space as a lens shows them: panels and windows |
//! | `circle`, `polygon`, `streak`, `glare`, `panel`, `window`, `moon`, `clouds` and more | one figure each |
//! | `recipe` | the figures of a kind |
//! | `trial` | a picture with its truth: without a limb, or with one and the artefact next to it |
//! | `outcome` | what a sensor says of a trial, and whether that is false |
//! | `dice` | random numbers in sequence |
//!
//! Lengths of figures are drawn in units of the picture's diagonal, edges and widths in pixels, light in fractions of
//! full scale. Each figure's `draw` documents its ranges.

mod circle;
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
pub use outcome::{Detection, FALSE_SIGMAS, GROSS_DEG, Outcome, PriorKnowledge, look};
pub use trial::Trial;
