//! Self-contained HTML page with all species at all growth stages.

use furrow_base::math::ToInt;
use furrow_field::PlantRecord;
use furrow_field::desc::{Role, SpeciesDesc};
use furrow_report::{Cell, Page, Table, data_url, number, section};
use maud::{Markup, html};

/// CSS rules in addition to the shared ones.
const STYLE: &str = include_str!("page.css");
/// Maximum length of a scale bar as a fraction of the image width.
pub(super) const LONGEST: f32 = 0.38;
/// Width and height of an image in SVG units.
const SIDE: f32 = 200.0;

/// A species.
pub(super) struct Entry {
    /// Content of its species file.
    pub(super) desc: SpeciesDesc,
    /// Stages, youngest first.
    pub(super) stages: Vec<Stage>,
}

/// A growth stage.
pub(super) struct Stage {
    /// The plant shown.
    pub(super) plant: PlantRecord,
    /// Its images: from above, then from the side.
    pub(super) plant_views: Vec<PlantView>,
}

/// A square image.
pub(super) struct PlantView {
    /// The image as JPEG.
    pub(super) jpeg: Vec<u8>,
    /// Width of the image at the plant, millimetres.
    pub(super) width_mm: f32,
}

/// Returns the page.
pub(super) fn html(entries: &[Entry]) -> String {
    let body = html! {
        @for entry in entries {
            @let SpeciesDesc { name, eppo, role, .. } = &entry.desc;
            @let role = if *role == Role::Crop { "crop" } else { "weed" };
            (section(&format!("{name} · {eppo} · {role}"), html! {
                div.stages { @for stage in &entry.stages { (figure(name, stage)) } }
                div.wide { (table(&entry.stages).html()) }
            }))
        }
    };
    let lead = html! {
        "Every species at every growth stage: above from straight overhead, below from about 30° above the \
         ground. Images of a stage show the same plant; scale bars apply at the plant. Rendered by "
        code { "trace catalogue" } "."
    };
    Page { kind: "Catalogue", title: "Species", lead, style: STYLE, body, script: "" }.html(env!("CARGO_PKG_VERSION"))
}

/// Images of a stage, each with its scale bar.
fn figure(name: &str, stage: &Stage) -> Markup {
    let code = stage.plant.bbch;
    html! {
        figure.stage {
            figcaption { "BBCH " (code) }
            @for (look, from) in stage.plant_views.iter().zip(["above", "the side"]) {
                @let mm = round_length(LONGEST * look.width_mm);
                @let long = SIDE * mm / look.width_mm;
                svg viewBox={ "0 0 " (SIDE) " " (SIDE) } role="img" aria-label={ (name) ", BBCH " (code) ", from " (from) } {
                    image href=(data_url("jpeg", &look.jpeg)) width=(SIDE) height=(SIDE) {}
                    rect.shade x="6" y=(SIDE - 32.0) width=(long.max(44.0) + 12.0) height="26" rx="4" {}
                    text x="12" y=(SIDE - 18.0) { (number(f64::from(mm))) " mm" }
                    rect.bar x="12" y=(SIDE - 13.0) width=(long) height="3" data-mm=(mm) {}
                }
            }
        }
    }
}

/// Largest of 1, 2, 5, 10, 20, … that is not above `most`.
pub(super) fn round_length(most: f32) -> f32 {
    let ten = 10.0_f32.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|k| k * ten).find(|length| *length <= most).unwrap_or(ten)
}

fn table(stages: &[Stage]) -> Table {
    let mut table = Table::new("", ["stage", "days", "leaves", "longest blade, mm", "height, mm", "span, mm"]);
    for Stage { plant, .. } in stages {
        let mm = |metres: f32| Cell::Shown(number(f64::from((metres * 1e3).round())));
        let longest = plant.leaf_axes.iter().map(|a| a.base.distance(a.tip)).fold(0.0, f32::max);
        table.push([
            Cell::text(format!("BBCH {}", plant.bbch)),
            Cell::Shown(number(f64::from(plant.age_days))),
            Cell::Count(plant.leaf_axes.len().to_u64()),
            mm(longest),
            mm(plant.height),
            mm(2.0 * plant.radius),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_lengths() {
        for (most, length) in [(1.2, 1.0), (9.9, 5.0), (47.0, 20.0), (50.0, 50.0), (130.0, 100.0)] {
            assert_eq!(round_length(most), length);
        }
    }
}
