//! How far a dataset is, as an HTML page in one file: `trace dataset status --page`.

use super::{failed, shards, slowest, summary};
use furrow::dataset::Set;
use furrow::dataset::status::Status;
use furrow::report::{Cell, Number, Page, Table, numbers, section};
use maud::{Markup, html};

/// The page; one that will be written again asks for itself again after `every` seconds.
pub(super) fn html(set: &Set, status: &Status, every: Option<u64>) -> String {
    let name = set.folder.canonicalize().unwrap_or_else(|_| set.folder.clone());
    let hours = Number {
        key: "core_hours",
        value: (status.core_s / 3600.0).to_string(),
        shown: format!("{:.2}", status.core_s / 3600.0),
        words: "core hours in runs that have ended".into(),
    };
    let body = html! {
        (numbers([
            Number::count("images", status.images, "images ordered"),
            Number::count("done", status.done, "there"),
            Number::count("failed", status.failures.len() as u64, "failed"),
            Number::count("working", status.working as u64, "runs at work"),
            hours,
        ]))
        progress max=(status.images) value=(status.done) style="width:100%" {}
        (table("Shards", &shards(status)))
        (table("Slowest images", &slowest(status)))
        (table("Failed images", &failed(status)))
    };
    let script = every.map(|seconds| format!("setTimeout(() => location.reload(), {})", 1000 * seconds));
    Page {
        kind: "Progress",
        title: &name.display().to_string(),
        lead: html! { (summary(status)) "." },
        style: "",
        body,
        script: script.as_deref().unwrap_or_default(),
    }
    .html(env!("CARGO_PKG_VERSION"))
}

/// Rows below their heads, the first of them; nothing where there are no others.
fn table<const N: usize>(title: &str, rows: &[[String; N]]) -> Markup {
    let Some((heads, rows)) = rows.split_first().filter(|(_, rows)| !rows.is_empty()) else { return html! {} };
    let mut table = Table::new("", heads.iter().map(String::as_str));
    for row in rows {
        table.push(row.iter().map(Cell::text));
    }
    section(title, html! { div.wide { (table.html()) } })
}
