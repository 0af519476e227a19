//! The HTML page that shows all sheets, in one file.

use furrow::report::{Cell, Page, Table, data_url, number, section};
use furrow::scene::PlantRecord;
use furrow::scene::desc::{Role, SpeciesDesc};
use maud::html;

/// Style rules beyond those of every page.
const STYLE: &str = ".sheet-wide { width: 100%; height: auto; border-radius: 6px; margin-bottom: .8rem; }\n";

/// One species.
pub(super) struct Entry {
    /// Its species file.
    pub(super) desc: SpeciesDesc,
    /// The plant that the sheet shows, at each stage.
    pub(super) stages: Vec<PlantRecord>,
    /// The sheet, a JPEG.
    pub(super) picture: Vec<u8>,
}

/// The page.
pub(super) fn html(entries: &[Entry]) -> String {
    let body = html! {
        @for entry in entries {
            @let SpeciesDesc { name, eppo, role, .. } = &entry.desc;
            @let role = if *role == Role::Crop { "crop" } else { "weed" };
            (section(&format!("{name} · {eppo} · {role}"), html! {
                img.sheet-wide src=(data_url("jpeg", &entry.picture)) alt=(name);
                div.wide { (table(&entry.stages).html()) }
            }))
        }
    };
    let lead = html! {
        "Every species at every growth stage: above as a camera sees it that looks straight down, below from about 30° above the \
         ground. It is one plant in all of its pictures; bars are to scale where it stands. Grown and rendered by "
        code { "trace catalogue" } "."
    };
    Page { kind: "Catalogue", title: "Species", lead, style: STYLE, body, script: "" }.html(env!("CARGO_PKG_VERSION"))
}

fn table(stages: &[PlantRecord]) -> Table {
    let mut table = Table::new("", ["stage", "days", "leaves", "longest blade, mm", "height, mm", "span, mm"]);
    for plant in stages {
        let mm = |metres: f32| Cell::Shown(number(f64::from((metres * 1e3).round())));
        let longest = plant.leaf_axes.iter().map(|a| a.base.distance(a.tip)).fold(0.0, f32::max);
        table.push([
            Cell::text(format!("BBCH {}", plant.bbch)),
            Cell::Shown(number(f64::from(plant.age_days))),
            Cell::Count(plant.leaf_axes.len() as u64),
            mm(longest),
            mm(plant.height),
            mm(2.0 * plant.radius),
        ]);
    }
    table
}
