//! The parameters of a head before the flight.

use hzn_core::Config;
use hzn_flight::{Parameters, parameters, table};

use crate::error::Error;
use crate::flash::Flash;
use crate::tell::Tell;

/// Returns the parameters for a sensor. Every picture is processed from the start (`boot.mode` = 1), because the
/// program starts when it is wanted, unlike a microcontroller.
pub(crate) fn parameters_for(sensor: Config) -> Parameters {
    let mut parameters = Parameters::new(sensor);
    parameters.operations.boot_mode = 1;
    parameters
}

/// Stores the given parameters if there are none, or if they replace them, and returns those that will be used.
/// `origin` names the file of the given ones.
pub(crate) fn prepare_parameters(
    given: Option<&Parameters>,
    (replaces, origin): (bool, &str),
    flash: &Flash,
    tell: &Tell,
) -> Result<Parameters, Error> {
    let has_copies = flash.has_copies();
    let has_none = newest(flash).is_none();
    if let Some(given) = given.filter(|_| has_none || replaces) {
        if has_copies && !replaces {
            // The defaults of the loop are those of another camera, so that every picture would be refused.
            let what = "no copy of the parameters can be used";
            tell(&format!("warning: {}: {what}; those of {origin} are stored again", flash.folder().display()));
        }
        store(given, flash)?;
    }
    if given.is_none() && !has_copies {
        let what = "no parameters are stored yet: give --sensor FILE once";
        return Err(Error::usage(format!("{}: {what}", flash.folder().display())));
    }
    let newest = newest(flash).map_or_else(Parameters::defaults, |(parameters, _)| parameters);
    if let Some(given) = given {
        let is_other = |id: &u16| given.get(*id).map(f64::to_bits) != newest.get(*id).map(f64::to_bits);
        let mut others: Vec<&str> = given.sensor_numbers().filter(is_other).filter_map(parameters::name).collect();
        others.dedup();
        if !others.is_empty() {
            let (names, state) = (others.join(", "), flash.folder().display());
            let what = "the stored parameters are used; --load replaces them";
            tell(&format!("warning: {state} has other values than {origin} for {names}: {what}"));
        }
    }
    let body = &newest.sensor.body;
    if body.altitude_km.is_none() && !body.half_angle_is_free() {
        let what = "a picture has no answer until a telecommand gives the altitude (known or navigate)";
        tell(&format!("warning: body.altitude_km is not set: {what}"));
    }
    Ok(newest)
}

/// Stores another base of the APIDs, and leaves the other parameters as they are.
pub(crate) fn store_base(parameters: &mut Parameters, base: u16, flash: &Flash) -> Result<(), Error> {
    parameters.operations.apid_base = base;
    store(parameters, flash)
}

/// Returns the newest valid copy of the parameters, and its generation.
fn newest(flash: &Flash) -> Option<(Parameters, u32)> {
    let read = |copy| {
        let mut bytes = vec![0; table::MAX_BYTES];
        flash.read_copy(copy, &mut bytes);
        table::read(&bytes).ok()
    };
    [read(1), read(2)].into_iter().flatten().max_by_key(|(_, generation)| *generation)
}

/// Stores parameters in both copies.
fn store(parameters: &Parameters, flash: &Flash) -> Result<(), Error> {
    parameters.check_flyable().map_err(|key| {
        Error::usage(format!("{key} has a value that the flight software does not support; leave it at its default"))
    })?;
    parameters.check().map_err(|e| Error::usage(e.to_string()))?;
    let generation = newest(flash).map_or(0, |(_, generation)| generation);
    let mut bytes = vec![0; table::MAX_BYTES];
    for (copy, generation) in [(1, generation.wrapping_add(1)), (2, generation.wrapping_add(2))] {
        let n = table::write(parameters, generation, &mut bytes).unwrap_or(0);
        let written = flash.write_copy(copy, bytes.get(..n).unwrap_or_default());
        written.map_err(|e| Error::failed(format!("{}: {e}", flash.folder().display())))?;
    }
    Ok(())
}
