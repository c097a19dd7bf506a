//! What all reports in HTML share.

/// Rules of style.
pub(crate) const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1360px;margin:2rem auto;padding:0 \
                     1rem;color:#222}\
h1{font-size:1.5rem}td{padding:.2rem .8rem;border-bottom:1px solid #eee}\
.plots{display:grid;gap:1rem;grid-template-columns:repeat(auto-fit,minmax(420px,1fr))}.plots \
svg{width:100%;height:auto}";

/// Escapes a text for HTML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
