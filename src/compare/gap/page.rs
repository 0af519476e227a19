//! Distances, curves and pictures side by side on one HTML page that asks for nothing.

use super::chart::charts;
use super::feature::Feature;
use super::sets::{Distance, Gap, Set};
use super::table::{cells, named, verdict};
use super::window::Window;
use crate::compare::Region;
use crate::html::{count, document, escape, inside, keyed, section, whole};
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");

/// Whole pictures of each set: a row of a page.
const WHOLES: usize = 3;

/// How to read the table.
const READING: &str = "<p class=\"reading\">A distance is the 1-D Wasserstein distance of two distributions: by how much values move on \
     average to make one of the other; of the power spectrum it is an RMS difference. <b>Halves</b> is the same between two random \
     halves of the real set, the median of 32 cuts; a <b>ratio</b> of 1 is as near as real is to real. Real and synthetic are means.</p>";

/// The page.
pub(super) fn html(of: &Gap) -> String {
    let body = [
        numbers(of),
        section("Distances", &(distances(of) + READING)),
        section("Side by side", &beside(of)),
        section("Curves", &curves(of)),
        section("Left out", &left_out(of)),
    ];
    let (real, synthetic) = (&of.real, &of.synthetic);
    let images = |set: &Set| count(set.photos.len() as u64, "picture", "pictures");
    let lead = format!(
        "<b>{}</b>, {}, against the real <b>{}</b>, {}. {}",
        escape(&synthetic.name),
        images(synthetic),
        escape(&real.name),
        images(real),
        escape(&verdict(of))
    );
    let title = format!("{} and {}", synthetic.name, real.name);
    let footer = format!("Written by Furrow {}", env!("CARGO_PKG_VERSION"));
    document("Gap", &title, &lead, STYLE, &body.concat(), &footer)
}

fn numbers(of: &Gap) -> String {
    let judged = of.distances.iter().filter(|distance| distance.ratio().is_some()).count();
    let large = of.distances.iter().filter(|distance| distance.is_large()).count();
    let figure = |key: &str, n: usize, words: &str| {
        format!("<div><b>{}</b><span>{words}</span></div>", keyed(key, n, &whole(n as u64)))
    };
    format!(
        "<div class=\"figures\">{}{}{}{}</div>\n",
        figure("large", large, "distances above 2 × halves"),
        figure("judged", judged, "distances with halves"),
        figure("real", of.real.photos.len(), "real pictures"),
        figure("synthetic", of.synthetic.photos.len(), "synthetic pictures")
    )
}

fn dot(distance: &Distance) -> &'static str {
    match distance.feature.region() {
        Some(region @ (Region::Soil | Region::Crop | Region::Weed)) => region.name(),
        _ => "none",
    }
}

fn distances(of: &Gap) -> String {
    let row = |distance: &Distance| {
        let cells: String = cells(of, distance).iter().fold(String::new(), |row, cell| row + "<td>" + cell + "</td>");
        let class = if distance.is_large() { " class=\"large\"" } else { "" };
        let (name, words) = (escape(&named(distance)), escape(distance.feature.words()));
        format!("<tr{class}><th title=\"{words}\"><i class=\"dot {}\"></i>{name}</th>{cells}</tr>\n", dot(distance))
    };
    let rows: String = of.distances.iter().map(row).collect();
    format!(
        "<div class=\"wide\"><table class=\"numbers\"><thead><tr><th></th><td>distance</td><td>halves</td><td>ratio</td><td>real</td>\
         <td>synthetic</td></tr></thead><tbody>{rows}</tbody></table></div>\n"
    )
}

fn image(jpeg: &[u8], (width, height): (u32, u32), name: &str) -> String {
    let source = inside("jpeg", jpeg);
    format!("<img src=\"{source}\" width=\"{width}\" height=\"{height}\" alt=\"{}\">", escape(name))
}

/// Parts at one scale, real on the left; then whole pictures, all made smaller by the same factor.
fn beside(of: &Gap) -> String {
    let sets = [(&of.real, "real"), (&of.synthetic, "synthetic")];
    let mut out = String::new();
    for row in 0..of.real.windows.len().max(of.synthetic.windows.len()) {
        for (set, words) in sets {
            let part = |w: &Window| {
                let picture = image(&w.part, w.size, &w.name);
                format!("<figure><figcaption><b>{words}</b> {}</figcaption>{picture}</figure>\n", escape(&w.name))
            };
            out += &set.windows.get(row).map_or_else(|| "<figure></figure>\n".to_owned(), part);
        }
    }
    if out.is_empty() {
        return out;
    }
    let mut wholes = String::new();
    for (set, words) in sets {
        let pictures: String =
            set.windows.iter().take(WHOLES).map(|w| image(&w.whole, w.whole_size, &w.name)).collect();
        let _ = writeln!(wholes, "<h3>{words}, whole pictures at a quarter</h3><div class=\"wholes\">{pictures}</div>");
    }
    format!(
        "<p class=\"reading\">Parts of pictures pixel by pixel, where most plants are.</p>\n{wholes}<div class=\"beside\">{out}</div>\n"
    )
}

fn curves(of: &Gap) -> String {
    let mut out = String::new();
    for distance in &of.distances {
        let pools = (of.real.pools.get(&distance.feature), of.synthetic.pools.get(&distance.feature));
        if let (Some(real), Some(synthetic)) = pools {
            // Channels of colours have letters of their own, and units with these.
            let title = match distance.feature {
                Feature::Color(_) => distance.feature.name(),
                _ => named(distance),
            };
            let (title, small) = (escape(&title), escape(distance.feature.words()));
            out += &charts(&title, &small, real, synthetic, of.tile);
        }
    }
    let legend = "<p class=\"legend\"><span><i class=\"key\"></i>real</span><span><i class=\"key made\"></i>synthetic</span></p>\n";
    format!("{legend}<div class=\"charts\">{out}</div>\n")
}

fn left_out(of: &Gap) -> String {
    let item = |warning: &String| format!("<li>{}</li>", escape(warning));
    let items: String = of.warnings.iter().map(item).collect();
    if items.is_empty() { items } else { format!("<ul>{items}</ul>") }
}
