//! Figures and pictures on one HTML page that asks for nothing: pairs to be flipped between, their maps of error beside them.

use super::comparison::Comparison;
use super::figures::{Band, Region};
use super::shot::{MOST_DELTA_E, Shot};
use super::summary::Summary;
use super::table::{MEASURES, cells, lead, mean_parts};
use super::{flip, table};
use crate::report::{Number, Page, color, data_url, legend, list, numbers, section, whole};
use maud::{Markup, html};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
/// Pictures narrower than this many pixels show them as squares.
const NARROW: u32 = 480;

/// The page.
pub(super) fn html(of: &Comparison) -> String {
    let body = html! {
        (figures(of))
        (section("Measures", html! { (means(of)) p.reading { (READING) } }))
        (section("Pictures", pictures(of)))
        (section("Pairs", pairs(of)))
        (section("Not compared", list(&of.found.warnings())))
    };
    let (a, b) = (&of.found.a, &of.found.b);
    let lead = html! { b { (b) } " against the reference " b { (a) } ": " (lead(of)) };
    let title = format!("{b} against {a}");
    Page { kind: "Comparison", title: &title, lead, style: STYLE, body, script: SCRIPT }.html(env!("CARGO_PKG_VERSION"))
}

/// How to read the table.
const READING: &str = "On 8-bit sRGB as coded, values from 0 to 1. Pictures that are the same have MSE 0, PSNR ∞, SSIM 1, FLIP 0 and \
                       ΔE₀₀ 0. SSIM is of the luma, without the five pixels at the edge; ΔE₀₀ is CIEDE2000, about 1 is just seen. A class \
                       has the pixels that the reference's labels give it.";

/// The numbers at the top: the whole picture in colour.
fn figures(of: &Comparison) -> Markup {
    let mut all = Vec::new();
    for s in of.means.iter().filter(|s| (s.band, s.region) == (Band::Rgb, Region::All)) {
        let held = [Some(s.mse), s.psnr_db(), s.ssim, s.flip, s.ciede2000];
        let keys = ["mse", "psnr_db", "ssim", "flip", "ciede2000"];
        for (k, (shown, _)) in mean_parts(s).into_iter().enumerate().skip(1) {
            let value = held[k].map_or_else(|| "null".to_owned(), |m| m.mean.to_string());
            all.push(Number { key: keys[k], value, shown, words: MEASURES[k].into() });
        }
    }
    let pairs = of.pairs.len() as u64;
    all.push(Number::count("pairs", pairs, if pairs == 1 { "pair" } else { "pairs" }));
    numbers(all)
}

/// Means of each band and region.
fn means(of: &Comparison) -> Markup {
    let many = of.pairs.len() > 1;
    let class = |s: &Summary| match s.region {
        Region::Soil | Region::Crop | Region::Weed => s.region.name(),
        Region::All | Region::Vegetation => "none",
    };
    html! {
        div.wide {
            table.numbers {
                thead { tr { th {} @if many { td { "pairs" } } @for measure in MEASURES { td { (measure) } } } }
                tbody {
                    @for s in &of.means {
                        tr {
                            th { i.dot.(class(s)) {} (table::label(s.band, s.region)) }
                            @if many { td { (whole(s.pairs)) } }
                            @for (mean, bounds) in mean_parts(s) { td { (mean) @if let Some(bounds) = bounds { small { (bounds) } } } }
                        }
                    }
                }
            }
        }
    }
}

/// The pairs to look at.
fn pictures(of: &Comparison) -> Markup {
    if of.shots.is_empty() {
        return html! {};
    }
    let stops: Vec<String> = flip::magma().iter().step_by(17).map(|rgb| color(*rgb)).collect();
    let scale = |name: &str, most: &str| {
        let gradient = format!("background:linear-gradient(90deg,{})", stops.join(","));
        (html! {}, html! { (name) " 0" i.scale style=(gradient) {} (most) })
    };
    html! {
        p.reading {
            @if of.shots.len() < of.pairs.len() { "The " (of.shots.len()) " pairs of the largest FLIP. " }
            "Click a picture to flip between reference and test, a map to see it large. For all at once: "
            kbd { "F" } " flips, " kbd { "1" } " reference, " kbd { "2" } " test, " kbd { "3" } " " kbd { "4" } " " kbd { "5" } " maps."
        }
        (legend([scale("FLIP", "1"), scale("1 − SSIM", "1"), scale("ΔE₀₀", &MOST_DELTA_E.to_string())]))
        @for shot in &of.shots { (picture(of, shot)) }
    }
}

fn picture(of: &Comparison, shot: &Shot) -> Markup {
    let (w, h) = (shot.width, shot.height);
    let image = |class: Option<&str>, words: &str, jpeg: &[u8]| {
        html! { img class=[class] src=(data_url("jpeg", jpeg)) width=(w) height=(h) alt={ (words) " of " (shot.name) }; }
    };
    let maps = [("flip", "FLIP"), ("ssim", "1 − SSIM"), ("delta", "ΔE₀₀")].into_iter().zip(&shot.maps);
    let pair = of.pairs.iter().find(|pair| pair.name == shot.name);
    let values = pair.map(|pair| cells(pair.figures.all())).unwrap_or_default();
    html! {
        figure.pair.squares[w < NARROW] data-show="a" style={ "--ratio:" (f64::from(w) / f64::from(h)) } {
            figcaption {
                b { (shot.name) }
                @for (measure, value) in MEASURES.iter().zip(values).skip(1) {
                    @let (name, unit) = measure.split_once(", ").unwrap_or((measure, ""));
                    span { (name) " " (value) " " (unit) }
                }
            }
            div.look {
                button.stage type="button" aria-label={ "flip " (shot.name) } {
                    (image(Some("a"), "reference", &shot.a))
                    (image(Some("b"), "test", &shot.b))
                    span.badge {}
                }
                div.maps {
                    @for ((key, words), jpeg) in maps {
                        button type="button" data-map=(key) { (image(None, words, jpeg)) span.badge { (words) } }
                    }
                }
            }
        }
    }
}

/// Every pair in numbers, where there are more.
fn pairs(of: &Comparison) -> Markup {
    html! { @if of.pairs.len() > 1 { div.wide { (table::each(of).html()) } } }
}
