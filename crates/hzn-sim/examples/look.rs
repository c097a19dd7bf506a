//! Writes a few pictures of the built-in flights to look at into the folder given, and says how long each took.

use std::path::PathBuf;
use std::time::Instant;

use hzn_sim::flight::{leo_infrared, rocket};

fn main() {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "look".into()));
    std::fs::create_dir_all(&dir).expect("the folder can be made");
    for (kind, flight) in
        [("", rocket(1920, 1080, 6, 1)), ("payload-", rocket(960, 540, 3, 1).with_payload()), ("", leo_infrared(6, 1))]
    {
        for frame in &flight.frames {
            let start = Instant::now();
            let picture = frame.render().expect("the scene is valid");
            let took = start.elapsed();
            let limb_px = frame.scene.visible_limb_px().expect("the scene is valid");
            println!("{kind}{}: {took:.0?}, {limb_px:.0} px of limb", frame.file);
            picture.save(&dir.join(format!("{kind}{}", frame.file))).expect("the picture can be written");
        }
    }
}
