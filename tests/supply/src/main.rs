//! Writes the CycloneDX list of parts (SBOM) of the command, the wheel and the firmware into a folder.
//!
//! `cargo run -p hzn-supply -- FOLDER`

use std::path::PathBuf;

use hzn_supply::{PRODUCTS, sbom};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: sbom FOLDER")?);
    std::fs::create_dir_all(&folder)?;
    for package in PRODUCTS {
        let list = sbom(package);
        let path = folder.join(format!("{package}.cdx.json"));
        std::fs::write(&path, serde_json::to_string_pretty(&list)? + "\n")?;
        println!("{}: {} parts", path.display(), list["components"].as_array().map_or(0, Vec::len));
    }
    Ok(())
}
