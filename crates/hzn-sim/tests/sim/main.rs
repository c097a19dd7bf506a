//! Tests of the simulator through its public interface.

mod ellipsoid;
mod encounter;
mod in_view;
mod limb;
mod picture;
mod sensitivity;
mod shutter;
mod unchanged;
mod vehicle;
