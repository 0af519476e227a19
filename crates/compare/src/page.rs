//! Self-contained HTML page with measures and pairs of images to alternate between, next to their error maps.

use super::comparison::Comparison;
use super::display_pair::{DisplayPair, MOST_DELTA_E};
use super::figures::{Band, Region};
use super::summary::Summary;
use super::table::{MEASURES, cells, lead, mean_parts};
use super::{flip, table};
use furrow_base::math::ToInt;
use furrow_report::{Number, Page, color, data_url, legend, list, numbers, section, whole};
use maud::{Markup, html};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
/// Width in pixels below which images are shown enlarged, with visible pixels.
const NARROW: u32 = 480;

/// Returns the page.
pub(super) fn html(of: &Comparison) -> String {
    let body = html! {
        (figures(of))
        (section("Measures", html! { (means(of)) p.reading { (READING) } }))
        (section("Images", pictures(of)))
        (section("Pairs", pairs(of)))
        (section("Not compared", list(&of.found.warnings())))
    };
    let (a, b) = (&of.found.a, &of.found.b);
    let lead = html! { b { (b) } " against the reference " b { (a) } ": " (lead(of)) };
    let title = format!("{b} against {a}");
    Page { kind: "Comparison", title: &title, lead, style: STYLE, body, script: SCRIPT }.html(env!("CARGO_PKG_VERSION"))
}

/// Explanation of the table.
const READING: &str = "Computed on 8-bit sRGB codes, as values from 0 to 1. Equal images have MSE 0, PSNR ∞, SSIM 1, FLIP 0 and \
                       ΔE₀₀ 0. SSIM uses the luma, without the five pixels at the edge; ΔE₀₀ is CIEDE2000, about 1 is just noticeable. \
                       Classes are defined by the reference's labels.";

/// Returns the numbers at the top: measures of the whole image in colour.
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
    let pairs = of.pairs.len().to_u64();
    all.push(Number::count("pairs", pairs, if pairs == 1 { "pair" } else { "pairs" }));
    numbers(all)
}

/// Returns the means of each band and region.
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

/// Returns the pairs for display.
fn pictures(of: &Comparison) -> Markup {
    if of.display_pairs.is_empty() {
        return html! {};
    }
    let stops: Vec<String> = flip::magma().iter().step_by(17).map(|rgb| color(*rgb)).collect();
    let scale = |name: &str, most: &str| {
        let gradient = format!("background:linear-gradient(90deg,{})", stops.join(","));
        (html! {}, html! { (name) " 0" i.scale style=(gradient) {} (most) })
    };
    html! {
        p.reading {
            @if of.display_pairs.len() < of.pairs.len() { "The " (of.display_pairs.len()) " pairs with the largest FLIP. " }
            "Click an image to alternate between reference and test, or a map to enlarge it. For all images: "
            kbd { "F" } " alternates, " kbd { "1" } " reference, " kbd { "2" } " test, " kbd { "3" } " " kbd { "4" } " " kbd { "5" } " maps."
        }
        (legend([scale("FLIP", "1"), scale("1 − SSIM", "1"), scale("ΔE₀₀", &MOST_DELTA_E.to_string())]))
        @for display_pair in &of.display_pairs { (picture(of, display_pair)) }
    }
}

fn picture(of: &Comparison, display_pair: &DisplayPair) -> Markup {
    let (w, h) = (display_pair.width, display_pair.height);
    let image = |class: Option<&str>, words: &str, jpeg: &[u8]| {
        html! { img class=[class] src=(data_url("jpeg", jpeg)) width=(w) height=(h) alt={ (words) " of " (display_pair.name) }; }
    };
    let maps = [("flip", "FLIP"), ("ssim", "1 − SSIM"), ("delta", "ΔE₀₀")].into_iter().zip(&display_pair.maps);
    let pair = of.pairs.iter().find(|pair| pair.name == display_pair.name);
    let values = pair.map(|pair| cells(pair.figures.all())).unwrap_or_default();
    html! {
        figure.pair.squares[w < NARROW] data-show="a" style={ "--ratio:" (f64::from(w) / f64::from(h)) } {
            figcaption {
                b { (display_pair.name) }
                @for (measure, value) in MEASURES.iter().zip(values).skip(1) {
                    @let (name, unit) = measure.split_once(", ").unwrap_or((measure, ""));
                    span { (name) " " (value) " " (unit) }
                }
            }
            div.look {
                button.stage type="button" aria-label={ "flip " (display_pair.name) } {
                    (image(Some("a"), "reference", &display_pair.a))
                    (image(Some("b"), "test", &display_pair.b))
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

/// Returns the table of all pairs, if there are several.
fn pairs(of: &Comparison) -> Markup {
    html! { @if of.pairs.len() > 1 { div.wide { (table::each(of).html()) } } }
}
