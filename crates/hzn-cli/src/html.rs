//! What all reports in HTML share.

use std::time::{SystemTime, UNIX_EPOCH};

use hzn_run::provenance;

/// Rules of style.
pub(crate) const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1360px;margin:2rem auto;padding:0 \
                     1rem;color:#222}\
h1{font-size:1.5rem}td{padding:.2rem .8rem;border-bottom:1px solid #eee}\
.plots{display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(420px,1fr))}.plots \
svg{width:100%;height:auto}";

/// Rules of style for a reader whose system is dark, after all others. Drawings have their own.
pub(crate) const DARK: &str = "@media(prefers-color-scheme:dark){:root{color-scheme:dark}\
body{background:#15171b;color:#dde1e6}td,th,h2{border-color:#33383f}.sub,figcaption{color:#9aa3ad}\
.warning{background:#3d3216}.plots svg{border-color:#33383f}}";

/// Escapes a text for HTML, also within an attribute.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns the last line of a report: the version of the program, the time, the hashes of the sensors that the report
/// is about, and the command that wrote the report.
pub(crate) fn provenance(sensors: &[String]) -> String {
    let now_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    let command = provenance::command("hzn");
    let (version, date) = (env!("CARGO_PKG_VERSION"), hzn_files::utc::iso8601(now_s as f64));
    let sensors: String = sensors.iter().map(|hash| format!("sensor {}, ", escape(hash))).collect();
    let line = format!("hzn {version}, {date}, {sensors}<code>{}</code>", escape(&command));
    format!("<p style=\"color:#777;font-size:13px;margin-top:2rem\">{line}</p>")
}
