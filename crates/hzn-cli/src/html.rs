//! What all reports in HTML share.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::refusals::quoted;

/// Rules of style.
pub(crate) const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1360px;margin:2rem auto;padding:0 \
                     1rem;color:#222}\
h1{font-size:1.5rem}td{padding:.2rem .8rem;border-bottom:1px solid #eee}\
.plots{display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(420px,1fr))}.plots \
svg{width:100%;height:auto}";

/// Escapes a text for HTML, also within an attribute.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns the last line of a report: the version of the program, the time, and the command that wrote the report.
pub(crate) fn provenance() -> String {
    let now_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    // The program may lie anywhere.
    let words = std::env::args_os().skip(1).map(|word| quoted(Path::new(&word)));
    let command = std::iter::once("hzn".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    let (version, date) = (env!("CARGO_PKG_VERSION"), hzn_files::utc::iso8601(now_s as f64));
    let line = format!("hzn {version}, {date}, <code>{}</code>", escape(&command));
    format!("<p style=\"color:#666;font-size:13px;margin-top:2rem\">{line}</p>")
}
