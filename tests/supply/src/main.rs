//! Writes the CycloneDX list of parts (SBOM) of the command, the wheel and the firmware into a folder, and the licences
//! of all parts of command and wheel into THIRD-PARTY.txt. PLATFORM is the triple of the system whose parts are listed.
//!
//! `cargo run -p hzn-supply -- FOLDER [PLATFORM]`

use std::path::PathBuf;

use hzn_supply::{PLATFORM, PRODUCTS, notices, sbom};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: sbom FOLDER [PLATFORM]")?);
    let platform = std::env::args().nth(2).unwrap_or_else(|| PLATFORM.to_owned());
    std::fs::create_dir_all(&folder)?;
    for package in PRODUCTS {
        let list = sbom(package, &platform);
        let path = folder.join(format!("{package}.cdx.json"));
        std::fs::write(&path, serde_json::to_string_pretty(&list)? + "\n")?;
        println!("{}: {} parts", path.display(), list["components"].as_array().map_or(0, Vec::len));
    }
    let path = folder.join("THIRD-PARTY.txt");
    let text = notices(&["hzn-cli", "hzn-py"], &platform);
    std::fs::write(&path, &text)?;
    println!("{}: {} lines", path.display(), text.lines().count());
    Ok(())
}
