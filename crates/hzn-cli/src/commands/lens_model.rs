//! The name of a lens model as an option.

use hzn_core::camera::Model;

/// Reads the name of a lens model.
pub(crate) fn parse(name: &str) -> Result<Model, String> {
    let model = Model::ALL.iter().copied().find(|m| m.name() == name);
    model.ok_or_else(|| {
        let names: Vec<&str> = Model::ALL.iter().map(|m| m.name()).collect();
        format!("the models are {}", names.join(", "))
    })
}
