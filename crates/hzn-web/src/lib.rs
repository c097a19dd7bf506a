//! The horizon sensor for one picture in a browser.
//!
//! [`answer`] takes a request with the contents of a picture file and returns JSON. The request is a line of JSON, and
//! the contents follow it. The picture goes through the code of `hzn run`, so its row is the same to the last bit; only
//! the times are missing, because a browser has no clock for them.
//!
//! For WebAssembly, the module `exports` has the functions that the page calls. They need no generated JavaScript.

#[cfg(target_family = "wasm")]
mod exports;
mod process;
mod request;
mod start;

use serde_json::{Value, json};

use request::Request;

/// Answers a request: a line of JSON, and behind it the contents of a picture file. The answer is JSON; with the key
/// `error`, it says what is wrong.
pub fn answer(request: &[u8]) -> Vec<u8> {
    let answer = try_answer(request).unwrap_or_else(|why| json!({ "error": why }));
    answer.to_string().into_bytes()
}

fn try_answer(request: &[u8]) -> Result<Value, String> {
    let line = request.iter().position(|byte| *byte == b'\n').ok_or("a request is a line of JSON and a picture")?;
    let (line, picture) = request.split_at(line);
    let picture = picture.get(1..).filter(|bytes| !bytes.is_empty()).ok_or("the file is empty")?;
    match serde_json::from_slice(line).map_err(|e| format!("the request: {e}"))? {
        Request::Start(known) => start::write_sensor_toml(&known, picture),
        Request::Process(settings) => process::process(&settings, picture),
    }
}
