//! Tests of the whole chain: rendered scenes with truth, photographs, and images in the emulator.

mod accuracy_table;
mod artefacts;
mod authenticated;
mod compiled;
mod discs;
mod faint;
mod firmware;
mod flight_artefacts;
mod free_axis;
mod geostationary;
mod hard;
mod heads;
mod jupiter;
mod line_cost;
mod looks;
mod navigation;
mod panoramic;
mod published;
mod real;
mod recovery;
mod rendered;
mod rig_image;
mod rows;
mod silence;
mod suns;
mod wrong_altitude;
