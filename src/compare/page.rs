//! Figures and pictures on one HTML page that asks for nothing: pairs to be flipped between, their maps of error beside them.

use super::comparison::{Compared, Comparison};
use super::figures::{Band, Region};
use super::shot::{MOST_DELTA_E, Shot};
use super::summary::Summary;
use super::table::{MEASURES, cells, lead, mean_parts};
use super::{flip, table};
use crate::html::{document, escape, inside, keyed, section, whole};
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
/// Pictures narrower than this many pixels show them as squares.
const NARROW: u32 = 480;

/// The page.
pub(super) fn html(of: &Comparison) -> String {
    let body = [
        numbers(of),
        section("Measures", &(means(of) + READING)),
        section("Pictures", &pictures(of)),
        section("Pairs", &pairs(of)),
        section("Not compared", &left_out(of)),
    ];
    let (a, b) = (escape(&of.found.a), escape(&of.found.b));
    let lead = format!("<b>{b}</b> against the reference <b>{a}</b>: {}", escape(&lead(of)));
    let title = format!("{} against {}", of.found.b, of.found.a);
    let body = body.concat() + &format!("<script>\n{SCRIPT}</script>\n");
    let footer = format!("Written by Furrow {}", env!("CARGO_PKG_VERSION"));
    document("Comparison", &title, &lead, STYLE, &body, &footer)
}

/// How to read the table.
const READING: &str = "<p class=\"reading\">On 8-bit sRGB as coded, values from 0 to 1. Pictures that are the same have MSE 0, PSNR ∞, SSIM 1, \
     FLIP 0 and ΔE₀₀ 0. SSIM is of the luma, without the five pixels at the edge; ΔE₀₀ is CIEDE2000, about 1 is just seen. \
     A class has the pixels that the reference's labels give it.</p>";

/// The numbers at the top: the whole picture in colour.
fn numbers(of: &Comparison) -> String {
    let mut out = String::new();
    for s in of.means.iter().filter(|s| (s.band, s.region) == (Band::Rgb, Region::All)) {
        let held = [Some(s.mse), s.psnr_db(), s.ssim, s.flip, s.ciede2000];
        let keys = ["mse", "psnr_db", "ssim", "flip", "ciede2000"];
        for (k, (shown, _)) in mean_parts(s).into_iter().enumerate().skip(1) {
            let held = held[k].map_or_else(|| "null".to_owned(), |m| m.mean.to_string());
            let _ = write!(out, "<div><b>{}</b><span>{}</span></div>", keyed(keys[k], held, &shown), MEASURES[k]);
        }
    }
    let pairs = of.pairs.len() as u64;
    let words = if pairs == 1 { "pair" } else { "pairs" };
    let _ = write!(out, "<div><b>{}</b><span>{words}</span></div>", keyed("pairs", pairs, &whole(pairs)));
    format!("<div class=\"figures\">{out}</div>\n")
}

/// Means of each band and region.
fn means(of: &Comparison) -> String {
    let many = of.pairs.len() > 1;
    let head = row_of(MEASURES);
    let row = |s: &Summary| {
        let parts = row_of(mean_parts(s).into_iter().map(|(mean, bounds)| {
            let bounds = bounds.map_or_else(String::new, |bounds| format!("<small>{bounds}</small>"));
            mean + &bounds
        }));
        let color = match s.region {
            Region::Soil | Region::Crop | Region::Weed => s.region.name(),
            Region::All | Region::Vegetation => "none",
        };
        let pairs = if many { format!("<td>{}</td>", whole(s.pairs)) } else { String::new() };
        let name = escape(&table::label(s.band, s.region));
        format!("<tr><th><i class=\"dot {color}\"></i>{name}</th>{pairs}{parts}</tr>")
    };
    let pairs = if many { "<td>pairs</td>" } else { "" };
    let rows: String = of.means.iter().map(row).collect();
    format!(
        "<div class=\"wide\"><table class=\"numbers\"><thead><tr><th></th>{pairs}{head}</tr></thead><tbody>{rows}</tbody></table></div>\n"
    )
}

/// The pairs to look at.
fn pictures(of: &Comparison) -> String {
    if of.shots.is_empty() {
        return String::new();
    }
    let stops: Vec<String> =
        flip::magma().iter().step_by(17).map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}")).collect();
    let scale = |name: &str, most: &str| {
        format!(
            "<span>{name} 0<i class=\"scale\" style=\"background:linear-gradient(90deg,{})\"></i>{most}</span>",
            stops.join(",")
        )
    };
    let some = if of.shots.len() < of.pairs.len() {
        format!("The {} pairs of the largest FLIP. ", of.shots.len())
    } else {
        String::new()
    };
    let mut out = format!(
        "<p class=\"reading\">{some}Click a picture to flip between reference and test, a map to see it large. For all at once: \
         <kbd>F</kbd> flips, <kbd>1</kbd> reference, <kbd>2</kbd> test, <kbd>3</kbd> <kbd>4</kbd> <kbd>5</kbd> maps.</p>\n\
         <p class=\"legend\">{}{}{}</p>\n",
        scale("FLIP", "1"),
        scale("1 − SSIM", "1"),
        scale("ΔE₀₀", &MOST_DELTA_E.to_string())
    );
    for shot in &of.shots {
        out.push_str(&picture(of, shot));
    }
    out
}

fn picture(of: &Comparison, shot: &Shot) -> String {
    let name = escape(&shot.name);
    let (w, h) = (shot.width, shot.height);
    let image = |class: &str, words: &str, jpeg: &[u8]| {
        let source = inside("jpeg", jpeg);
        format!("<img class=\"{class}\" src=\"{source}\" width=\"{w}\" height=\"{h}\" alt=\"{words} of {name}\">")
    };
    let maps = [("flip", "FLIP"), ("ssim", "1 − SSIM"), ("delta", "ΔE₀₀")].into_iter().zip(&shot.maps);
    let maps = maps.map(|((key, words), jpeg)| {
        let image = image("", words, jpeg);
        format!("<button type=\"button\" data-map=\"{key}\">{image}<span class=\"badge\">{words}</span></button>")
    });
    let pair = of.pairs.iter().find(|pair| pair.name == shot.name);
    let words = pair.map_or_else(String::new, |pair| {
        let shown = MEASURES.iter().zip(cells(pair.figures.all())).skip(1);
        shown.fold(String::new(), |words, (measure, value)| {
            let (name, unit) = measure.split_once(", ").unwrap_or((measure, ""));
            words + "<span>" + name + " " + &value + " " + unit + "</span>"
        })
    });
    let squares = if w < NARROW { " squares" } else { "" };
    format!(
        "<figure class=\"pair{squares}\" data-show=\"a\" style=\"--ratio:{}\"><figcaption><b>{name}</b>{words}</figcaption>\n\
         <div class=\"look\"><button type=\"button\" class=\"stage\" aria-label=\"flip {name}\">{}{}<span class=\"badge\"></span></button>\n\
         <div class=\"maps\">{}</div></div></figure>\n",
        f64::from(w) / f64::from(h),
        image("a", "reference", &shot.a),
        image("b", "test", &shot.b),
        maps.collect::<String>()
    )
}

/// Cells of a table's row.
fn row_of(cells: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    cells.into_iter().fold(String::new(), |row, cell| row + "<td>" + cell.as_ref() + "</td>")
}

/// Every pair in numbers, where there are more.
fn pairs(of: &Comparison) -> String {
    if of.pairs.len() < 2 {
        return String::new();
    }
    let head = row_of(MEASURES);
    let row = |pair: &Compared| {
        let cells = row_of(cells(pair.figures.all()));
        format!("<tr><th>{}</th>{cells}</tr>\n", escape(&pair.name))
    };
    let rows: String = of.pairs.iter().map(row).collect();
    format!(
        "<div class=\"wide\"><table class=\"numbers\"><thead><tr><th></th>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

fn left_out(of: &Comparison) -> String {
    let warnings = of.found.warnings();
    let item = |warning: &String| format!("<li>{}</li>", escape(warning));
    let items: String = warnings.iter().map(item).collect();
    if items.is_empty() { items } else { format!("<ul>{items}</ul>") }
}
