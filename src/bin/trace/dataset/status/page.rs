//! Progress of a dataset as a self-contained HTML page: `trace dataset status --page`.

use super::{failed, shards, slowest, summary};
use furrow_base::math::ToInt;
use furrow_dataset::Set;
use furrow_dataset::make::status::Status;
use furrow_report::{Cell, Number, Page, Table, numbers, section};
use maud::{Markup, html};

/// Returns the page. If it will be rewritten, it reloads itself after `every` seconds.
pub(super) fn html(set: &Set, status: &Status, every: Option<u64>) -> String {
    let name = set.folder.canonicalize().unwrap_or_else(|_| set.folder.clone());
    let hours = Number {
        key: "core_hours",
        value: (status.core_s / 3600.0).to_string(),
        shown: format!("{:.2}", status.core_s / 3600.0),
        words: "core hours in finished runs".into(),
    };
    let body = html! {
        (numbers([
            Number::count("images", status.images, "images ordered"),
            Number::count("done", status.done, "done"),
            Number::count("failed", status.failures.len().to_u64(), "failed"),
            Number::count("working", status.working.to_u64(), "active runs"),
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

/// Table with the first row as headers; empty if there are no other rows.
fn table<const N: usize>(title: &str, rows: &[[String; N]]) -> Markup {
    let Some((heads, rows)) = rows.split_first().filter(|(_, rows)| !rows.is_empty()) else { return html! {} };
    let mut table = Table::new("", heads.iter().map(String::as_str));
    for row in rows {
        table.push(row.iter().map(Cell::text));
    }
    section(title, html! { div.wide { (table.html()) } })
}
