//! Writes the JSON schema of scene.toml, for `hzn schema` and for the book. `cargo xtask keys` calls it with the root
//! of the repository.

use std::path::Path;
use std::{env, fs};

use hzn_sim::scenario::schema;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = env::args().nth(1).ok_or("give the root of the repository")?;
    let text = serde_json::to_string_pretty(&schema::json())? + "\n";
    for path in ["crates/hzn-sim/src/scenario/scene.schema.json", "book/reference/scene.schema.json"] {
        fs::write(Path::new(&root).join(path), &text)?;
    }
    Ok(())
}
