//! Tests of the navigation filter and of the positions of bodies.

mod common;
mod delayed;
mod golden;
mod limb_latitude;
mod monte_carlo;
mod planets;
mod printed;
mod sizes;
