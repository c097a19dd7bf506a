//! Writes the rays of pixels and their projections: `cargo run -p hzn-calib --example rays -- sensor.toml`.
//!
//! The columns are a pixel's centre (px), its unit ray in the camera frame, and the projection of that ray (px). The
//! grid has one pixel in 16 along both axes; pixels outside the image circle are left out.

use std::path::Path;

use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: rays sensor.toml")?;
    let config = hzn_files::sensor::load(Path::new(&path))?.config.camera;
    let camera = Camera::<f64>::try_new(&config)?;
    println!("u,v,x,y,z,u_again,v_again");
    for v in (0..config.height).step_by(16).map(f64::from) {
        for u in (0..config.width).step_by(16).map(f64::from) {
            let Some(ray) = camera.unproject(ImagePoint { u, v }) else { continue };
            let again = camera.project(&ray).ok_or("a ray of the picture is outside it")?;
            let [x, y, z] = ray.xyz();
            println!("{u},{v},{x:e},{y:e},{z:e},{:e},{:e}", again.u, again.v);
        }
    }
    Ok(())
}
