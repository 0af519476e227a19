//! The page that shows all sheets, in one file.

use furrow::html::{document, escape, inside, number, section};
use furrow::scene::PlantRecord;
use furrow::scene::desc::{Role, SpeciesDesc};
use std::fmt::Write;

/// Rules beyond those of every page.
const STYLE: &str = ".sheet-wide { width: 100%; height: auto; border-radius: 6px; margin-bottom: .8rem; }\n\
                     .wide td, .wide th { text-align: right; } .wide th:first-child { text-align: left; }\n";

/// One species.
pub(super) struct Entry {
    /// Its page.
    pub(super) desc: SpeciesDesc,
    /// The plant that the sheet shows, at each stage.
    pub(super) stages: Vec<PlantRecord>,
    /// The sheet, a JPEG.
    pub(super) picture: Vec<u8>,
}

/// The page.
pub(super) fn html(entries: &[Entry]) -> String {
    let mut body = String::new();
    for entry in entries {
        let SpeciesDesc { name, eppo, role, .. } = &entry.desc;
        let role = if *role == Role::Crop { "crop" } else { "weed" };
        let picture = inside("jpeg", &entry.picture);
        let shown = format!("<img class=\"sheet-wide\" src=\"{picture}\" alt=\"{}\">", escape(name));
        body += &section(&format!("{name} · {eppo} · {role}"), &(shown + &table(&entry.stages)));
    }
    let lead = "Every species page at every growth stage: above as a camera sees it that looks straight down, below from about 30° \
                above the ground. It is one plant in all of its pictures; bars are to scale where it stands.";
    document("Catalogue", "Species", lead, STYLE, &body, "Grown and traced by <code>trace catalogue</code>.")
}

fn table(stages: &[PlantRecord]) -> String {
    let mut rows = String::new();
    for plant in stages {
        let mm = |metres: f32| number(f64::from((metres * 1e3).round()));
        let longest = plant.leaf_axes.iter().map(|a| a.base.distance(a.tip)).fold(0.0, f32::max);
        let _ = write!(
            rows,
            "<tr><th>BBCH {}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            plant.bbch,
            number(f64::from(plant.age_days)),
            plant.leaf_axes.len(),
            mm(longest),
            mm(plant.height),
            mm(2.0 * plant.radius),
        );
    }
    format!(
        "<div class=\"wide\"><table><thead><tr><th>stage</th><th>days</th><th>leaves</th><th>longest blade, mm</th>\
         <th>height, mm</th><th>span, mm</th></tr></thead><tbody>{rows}</tbody></table></div>\n"
    )
}
