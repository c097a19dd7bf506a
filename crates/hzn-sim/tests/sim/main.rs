//! Tests of the simulator through its public interface.

mod ellipsoid;
mod encounter;
mod limb;
mod picture;
mod sensitivity;
mod shutter;
mod unchanged;
