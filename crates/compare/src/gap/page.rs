//! Self-contained HTML page with distances, curves and images side by side.

use super::curves::charts;
use super::feature::Feature;
use super::sets::{Distance, Gap, Set};
use super::table::{ORDER, cells, named, verdict};
use super::window::Window;
use crate::Region;
use furrow_base::math::ToInt;
use furrow_report::{Number, Page, chart, count, data_url, legend, list, numbers, section};
use maud::{Markup, html};

const STYLE: &str = include_str!("page.css");

/// Number of whole images per set, in one row of the page.
const WHOLES: usize = 3;

/// Returns the page.
pub(super) fn html(of: &Gap) -> String {
    let body = html! {
        (figures(of))
        (section("Distances", html! { (distances(of)) (reading()) }))
        (section("What to change", turns(of)))
        (section("Side by side", beside(of)))
        (section("Curves", curves(of)))
        (section("Not compared", list(&of.warnings)))
    };
    let (real, synthetic) = (&of.real, &of.synthetic);
    let images = |set: &Set| count(set.photos.len().to_u64(), "image", "images");
    let lead = html! {
        b { (synthetic.name) } ", " (images(synthetic)) ", against the real " b { (real.name) } ", " (images(real)) ". " (verdict(of))
    };
    let title = format!("{} and {}", synthetic.name, real.name);
    Page { kind: "Gap", title: &title, lead, style: STYLE, body, script: "" }.html(env!("CARGO_PKG_VERSION"))
}

/// Explains the table.
fn reading() -> Markup {
    html! {
        p.reading {
            "A distance is the 1-D Wasserstein distance of two distributions: the mean distance that values must move to turn one into \
             the other. For the power spectrum it is an RMS difference. "
            b { "Halves" }
            " is the distance between two random halves of the real set, the median of 32 splits; a "
            b { "ratio" }
            " of 1 means as close as real to real. Real and synthetic are means."
        }
    }
}

fn figures(of: &Gap) -> Markup {
    let compared = of.distances.iter().filter(|distance| distance.ratio().is_some()).count().to_u64();
    let large = of.distances.iter().filter(|distance| distance.is_large()).count().to_u64();
    numbers([
        Number::count("large", large, "distances above 2 × halves"),
        Number::count("compared", compared, "distances with halves"),
        Number::count("real", of.real.photos.len().to_u64(), "real images"),
        Number::count("synthetic", of.synthetic.photos.len().to_u64(), "synthetic images"),
    ])
}

fn dot(distance: &Distance) -> &'static str {
    match distance.feature.region() {
        Some(region @ (Region::Soil | Region::Crop | Region::Weed)) => region.name(),
        _ => "none",
    }
}

fn distances(of: &Gap) -> Markup {
    html! {
        div.wide {
            table.numbers {
                thead {
                    tr { th {} @for head in ["distance", "halves", "ratio", "real", "synthetic"] { td { (head) } } }
                }
                tbody {
                    @for distance in &of.distances {
                        tr.large[distance.is_large()] {
                            th title=(distance.feature.words()) { i.dot.(dot(distance)) {} (named(distance)) }
                            @for cell in cells(of, distance) { td { (cell) } }
                        }
                    }
                }
            }
        }
    }
}

/// Returns the advice on large distances.
fn turns(of: &Gap) -> Markup {
    let advice = of.advice();
    html! {
        @if !advice.is_empty() {
            p.reading { (ORDER) }
            ol.turns {
                @for one in &advice {
                    li { (one.words) @for turn in &one.turns { div { (turn.way.name()) " " code { (turn.field) } } } }
                }
            }
        }
    }
}

fn image(jpeg: &[u8], (width, height): (u32, u32), name: &str) -> Markup {
    html! { img src=(data_url("jpeg", jpeg)) width=(width) height=(height) alt=(name); }
}

/// Shows parts at the same scale, real on the left, then whole images, all downscaled by the same factor.
fn beside(of: &Gap) -> Markup {
    let sets = [(&of.real, "real"), (&of.synthetic, "synthetic")];
    let rows = of.real.windows.len().max(of.synthetic.windows.len());
    let part = |window: Option<&Window>, words: &str| {
        html! {
            figure {
                @if let Some(w) = window {
                    figcaption { b { (words) } " " (w.name) }
                    (image(&w.part, w.size, &w.name))
                }
            }
        }
    };
    html! {
        @if rows > 0 {
            p.reading { "Parts of images at full resolution, where most plants are." }
            @for (set, words) in sets {
                h3 { (words) ", whole images at a quarter of their size" }
                div.wholes { @for w in set.windows.iter().take(WHOLES) { (image(&w.whole, w.whole_size, &w.name)) } }
            }
            div.beside { @for row in 0..rows { @for (set, words) in sets { (part(set.windows.get(row), words)) } } }
        }
    }
}

fn curves(of: &Gap) -> Markup {
    let mut all = Vec::new();
    for distance in &of.distances {
        let pools = (of.real.pools.get(&distance.feature), of.synthetic.pools.get(&distance.feature));
        if let (Some(real), Some(synthetic)) = pools {
            // Channels of colours have their own names, and therefore their own units.
            let title = match distance.feature {
                Feature::Color(_) => distance.feature.name(),
                _ => named(distance),
            };
            all.extend(charts(&title, distance.feature.words(), real, synthetic, of.tile));
        }
    }
    let keys = [(html! { i.key {} }, html! { "real" }), (html! { i.key.made {} }, html! { "synthetic" })];
    html! { (legend(keys)) (chart::grid(all)) }
}
