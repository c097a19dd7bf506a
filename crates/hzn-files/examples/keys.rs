//! Writes the files that are derived from the keys of sensor.toml: the tables of the documentation, the commented
//! template, the types of the Python package, and the JSON schemas of sensor.toml and frames.csv. `cargo xtask keys`
//! calls it with the root of the repository.

use std::path::Path;
use std::{env, fs};

use hzn_files::keys::{python, schema, table, template};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = env::args().nth(1).ok_or("give the root of the repository")?;
    let root = Path::new(&root);
    let page = root.join("book/reference/sensor-toml.md");
    let text = fs::read_to_string(&page)?;
    fs::write(&page, table::insert_table(&text).ok_or("the page has no marks for the table")?)?;
    fs::write(root.join("crates/hzn-files/src/template.toml"), template::text())?;
    fs::write(root.join("crates/hzn-py/python/hzn/keys.py"), python::module())?;
    let schemas = [("sensor.schema.json", schema::json()), ("frames.schema.json", hzn_files::frames::schema())];
    for (name, schema) in schemas {
        fs::write(root.join("book/reference").join(name), serde_json::to_string_pretty(&schema)? + "\n")?;
    }
    Ok(())
}
