//! The page of a study: one file that needs nothing else.

use std::fmt::Write;
use std::path::Path;

use kerfem_mesh::io::write_atomically;

use super::results::{Row, columns, fields};
use super::spec::Study;
use crate::EngineError;

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:76rem;padding:0 1rem;color:#222}\
    table{border-collapse:collapse;font-size:13px;display:block;overflow-x:auto}td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;\
    text-align:right;white-space:nowrap}th{cursor:pointer;background:#f4f4f4;position:sticky;top:0}td:last-child{white-space:normal;\
    text-align:left;min-width:8rem}tr.failed{color:#a33}pre{background:#f4f4f4;padding:1rem;overflow-x:auto;font-size:12px}";

/// Sorts the table by a column: numbers by size, texts by letters.
const SCRIPT: &str = "document.querySelectorAll('th').forEach((h,k)=>h.onclick=()=>{const b=document.querySelector('tbody');\
    const up=h.dataset.up=h.dataset.up==='1'?'0':'1';const key=r=>{const t=r.cells[k].textContent;return t===''||isNaN(t)?t:+t};\
    [...b.rows].sort((x,y)=>{const a=key(x),c=key(y);const d=typeof a===typeof c?(a<c?-1:a>c?1:0):typeof a==='number'?-1:1;\
    return up==='1'?d:-d}).forEach(r=>b.append(r))})";

/// Writes `index.html`; the chart is that of `chart.svg` beside it.
pub(super) fn write(study: &Study, rows: &[Row], folder: &Path) -> Result<(), EngineError> {
    let svg = std::fs::read_to_string(folder.join("chart.svg")).unwrap_or_default();
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style></head><body>\n\
         <h1>{0}</h1>\n<p>{1}</p>\n<p>{2} runs, {3} of which failed; {4} repeats each, made in turns; kerfem {5}, {6} threads. A click on the \
         head of a column sorts the table.</p>\n{svg}\n<table><thead><tr>",
        escaped(&study.name),
        escaped(&study.about),
        rows.len(),
        rows.iter().filter(|r| r.failed.is_some()).count(),
        study.repeats(),
        env!("CARGO_PKG_VERSION"),
        rayon::current_num_threads(),
    );
    for column in columns(study) {
        let _ = write!(page, "<th>{}</th>", escaped(&column));
    }
    page += "</tr></thead><tbody>\n";
    for row in rows {
        page += if row.failed.is_some() {
            "<tr class=\"failed\">"
        } else {
            "<tr>"
        };
        for field in fields(row) {
            let _ = write!(page, "<td>{}</td>", escaped(&rounded(&field)));
        }
        page += "</tr>\n";
    }
    let _ = write!(
        page,
        "</tbody></table>\n<h2>The study</h2>\n<pre>{}</pre>\n<h2>Its scene</h2>\n<pre>{}</pre>\n<script>{SCRIPT}</script></body></html>\n",
        escaped(&study.source.text),
        escaped(&study.scene_text)
    );
    write_atomically(folder.join("index.html"), |out| out.write_all(page.as_bytes())).map_err(EngineError::Write)
}

/// A number to five digits; the table on disk has them all.
pub(super) fn rounded(field: &str) -> String {
    match field.parse::<f64>() {
        Ok(value) if field.contains(['.', 'e']) && value.is_finite() => match value.abs() {
            v if v == 0.0 || (1e-3..1e5).contains(&v) => {
                let text = format!("{value:.5}");
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
            _ => format!("{value:.4e}"),
        },
        _ => field.to_owned(),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
