//! Figures and HTML pages about training results: they show the right values, are well-formed, and load nothing.
//!
//! Rationale: most readers judge results by their figures. Expected: each image of a sheet is at its position, pixel by
//! pixel; curves are valid XML, end at the ends of the axis and keep every peak; pages contain the report's numbers,
//! and open without a network connection in wide and narrow windows. Source: the values computed here; Python's XML
//! parser; headless Chromium (Debian's `chromium`).

use crate::common::browser::{browser, probe};
use crate::common::program::scratch;
use crate::common::python::python;
use furrow_report::chart::{Chart, Curve};
use furrow_train::data::{Band, Example};
use furrow_train::figure::{Page, Thumbnail, Thumbnails, compose, spread};
use furrow_train::measure::{Evaluation, Prediction, Report};
use std::process::Command;

const PALETTE: [[u8; 3]; 3] = [[0, 0, 0], [0, 255, 0], [255, 0, 0]];

/// 6 × 4 pixels: a crop plant that is half missed, a weed classified as crop, crop predicted on soil, and an unlabelled
/// pixel.
fn thumbnail(name: &str) -> Thumbnail {
    let map = |rows: [&str; 4]| -> Vec<u8> {
        rows.concat().bytes().map(|c| if c == b'x' { 255 } else { c - b'0' }).collect()
    };
    let truth = map(["011000", "011000", "000002", "x00000"]);
    let answer = map(["010000", "010000", "000001", "010000"]);
    let rgb: Vec<[u8; 3]> = (0..24).map(|k| [4 * k, 100, 50]).collect();
    Thumbnail::new(name, (6, 4), &rgb, &truth, &[&answer], 100)
}

#[test]
fn a_sheet_holds_each_picture_in_its_place() {
    let first = thumbnail("a");
    let second = Thumbnail { width: 4, height: 6, truth: Vec::new(), ..thumbnail("b") };
    let picture = compose(&[first.clone(), second.clone()], &PALETTE, false);
    // Three columns as wide as the widest image, four pixels apart; two rows.
    assert_eq!((picture.width, picture.height, picture.rgb.len()), (6 * 3 + 2 * 4, 4 + 4 + 6, 26 * 14));
    let at = |x: usize, y: usize| picture.rgb[y * 26 + x];
    for (x, y) in (0..4).flat_map(|y| (0..6).map(move |x| (x, y))) {
        assert_eq!(at(x, y), first.rgb[y * 6 + x]);
        let class = usize::from(first.truth[y * 6 + x]);
        assert_eq!(at(10 + x, y), PALETTE.get(class).copied().unwrap_or([128; 3]));
        assert_eq!(at(20 + x, y), PALETTE[usize::from(first.predictions[0][y * 6 + x])]);
    }
    assert_eq!((at(6, 0), at(0, 5), at(12, 9), at(5, 9)), ([255; 3], [255; 3], [255; 3], [255; 3]));
    assert_eq!(at(3, 13), second.rgb[23]);
    let empty = compose(&[], &PALETTE, true);
    assert_eq!((empty.width, empty.height), (0, 0));
}

#[test]
fn errors_have_their_colours() {
    let errors = thumbnail("a").errors(0);
    let at = |x: usize, y: usize| errors[y * 6 + x];
    // Missed, correct; the weed classified as crop; crop predicted on soil; no label; correct soil.
    assert_eq!((at(2, 0), at(5, 2), at(1, 3), at(0, 3)), ([40, 120, 255], [230, 0, 200], [255, 190, 0], [128; 3]));
    let [plant, soil] = [at(1, 0), at(0, 0)];
    assert!(plant[0] == plant[1] && plant[0] > soil[0] && soil[0] == soil[2], "{plant:?} {soil:?}");
    assert_eq!(compose(&[thumbnail("a")], &PALETTE, true).width, 4 * 6 + 3 * 4);
}

#[test]
fn shots_are_made_small_and_spread_over_the_set() {
    let truth: Vec<u8> = (0..80 * 40).map(|at| u8::from(at % 80 >= 40)).collect();
    let thumbnail = Thumbnail::new("a", (80, 40), &vec![[9, 8, 7]; 3200], &truth, &[&truth, &truth], 20);
    assert_eq!((thumbnail.width, thumbnail.height, thumbnail.rgb.len(), thumbnail.predictions.len()), (20, 10, 200, 2));
    assert!(thumbnail.truth.iter().enumerate().all(|(at, class)| *class == u8::from(at % 20 >= 10)));
    assert_eq!(thumbnail.truth, thumbnail.predictions[1]);
    assert_eq!((spread(100, 4), spread(3, 8), spread(0, 4)), (vec![12, 37, 62, 87], vec![0, 1, 2], vec![]));
}

/// Rationale: readers of an evaluation look for its errors. Expected: from images in any order, those with the lowest
/// mean IoU, worst first, then evenly spaced ones that are not among them; without the option for worst images, only
/// the evenly spaced ones.
#[test]
fn the_worst_images_are_kept_and_some_spread_over_the_set() {
    let wrong = [3, 40, 7, 0, 90, 12, 55, 1, 30, 8];
    let seen = |mut thumbnails: Thumbnails| {
        for (k, wrong) in wrong.iter().enumerate() {
            let labels = vec![0; 50].into_iter().chain(vec![1; 50]).collect::<Vec<u8>>();
            let predicted: Vec<u8> =
                labels.iter().enumerate().map(|(at, class)| if at < *wrong { 1 - class } else { *class }).collect();
            let planes = vec![vec![9; 100]];
            let example = Example { name: k.to_string(), planes, labels, plants: Vec::new(), species: Vec::new() };
            thumbnails.see(&example, (10, 10), &predicted).unwrap();
        }
        thumbnails.kept().into_iter().map(|thumbnail| thumbnail.name).collect::<Vec<_>>()
    };
    let spread_alone = Thumbnails::new(10, 3, 50, &[Band::Red]);
    assert_eq!(seen(spread_alone), ["1", "5", "8"]);
    let thumbnails = Thumbnails::new(10, 3, 50, &[Band::Red]).and_worst(4, 2);
    // Of 10 × 10 pixels, the worst four have 90, 55, 40 and 30 wrong; 5 is the only evenly spaced image that is not
    // among them.
    assert_eq!(seen(thumbnails), ["4", "6", "1", "8", "5"]);
}

/// Rationale: a loss falling from 1.6 to 1.2 had an axis without labels. Expected: at least three numbers on a
/// logarithmic axis of any range.
#[test]
fn a_short_logarithmic_axis_has_numbers() {
    for (from, to) in [(1.2, 1.6), (0.63, 1.82), (0.0301, 0.0309), (1.0, 900.0)] {
        let curves = vec![Curve { name: "a".into(), points: vec![(0.0, to), (1.0, from)] }];
        let short = Chart { curves, ..chart(true) };
        let numbers = short.svg().matches("text-anchor=\"end\"").count();
        assert!(numbers >= 3, "{from} to {to}: {numbers}");
    }
}

fn chart(logarithmic: bool) -> Chart {
    let mut points: Vec<(f64, f64)> = (0..5000).map(|k| (f64::from(k), 1.0 / (1.0 + f64::from(k) / 50.0))).collect();
    points[1234].1 = 3.5;
    points[4000].1 = f64::NAN;
    Chart {
        title: "Loss < 4 & falling".into(),
        across: "step".into(),
        upwards: "cross-entropy".into(),
        curves: vec![
            Curve { name: "training \"a\"".into(), points },
            Curve { name: "validation".into(), points: vec![(0.0, 0.0), (2500.0, 0.5), (4999.0, 0.4)] },
            Curve { name: "alone".into(), points: vec![(100.0, 2.0)] },
        ],
        logarithmic,
    }
}

/// Parses the points of a curve's path attribute `d`.
fn path(svg: &str, name: &str) -> Vec<Vec<(f64, f64)>> {
    let group = svg.split(&format!("data-curve=\"{name}\"")).nth(1).unwrap().split("</g>").next().unwrap();
    let Some(d) = group.split(" d=\"").nth(1) else { return Vec::new() };
    let d = d.split('"').next().unwrap();
    let point = |text: &str| {
        let (x, y) = text.split_once(' ').unwrap();
        (x.parse().unwrap(), y.parse().unwrap())
    };
    d.split('M').skip(1).map(|run| run.split('L').map(point).collect()).collect()
}

#[test]
fn curves_keep_their_peaks_break_where_they_must_and_stay_in_the_plot() {
    let svg = chart(false).svg();
    let runs = path(&svg, "training &quot;a&quot;");
    assert_eq!(runs.len(), 2, "values that are not numbers must break the line");
    let all: Vec<(f64, f64)> = runs.concat();
    assert!(all.len() < 1300, "{} points are too many", all.len());
    assert!(all.windows(2).all(|w| w[0].0 <= w[1].0));
    let top = all.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    assert!(all.iter().filter(|p| p.1 < top + 50.0).count() == 1, "the peak must be kept, once");
    assert!(all.iter().all(|(x, y)| (62.0..=624.0).contains(x) && (0.0..=316.0).contains(y)));
    assert_eq!((all[0].0, all[all.len() - 1].0), (62.0, 624.0));
    assert!(svg.contains("<circle") && path(&svg, "alone").is_empty());
    // The axis starts at zero, so this value is at 0.5 / 3.5 of the peak's height.
    let half = path(&svg, "validation")[0][1].1;
    assert!(((316.0 - half) / (316.0 - top) - 0.5 / 3.5).abs() < 2e-3);
    // A logarithmic axis omits zero; equal ratios have equal heights.
    let svg = chart(true).svg();
    assert_eq!(path(&svg, "validation")[0].len(), 2);
    let nothing = Chart { curves: Vec::new(), ..chart(false) }.svg();
    assert!(nothing.contains("nothing to show yet"));
    let flat =
        Chart { curves: vec![Curve { name: "flat".into(), points: vec![(1.0, 0.0), (2.0, 0.0)] }], ..chart(false) };
    assert!(!flat.svg().contains("NaN"));
}

#[test]
fn curves_are_well_formed() {
    let Some(python) = python("import xml.etree.ElementTree") else { return };
    let (_kept, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    for logarithmic in [false, true] {
        let file = folder.join(format!("curve-{logarithmic}.svg"));
        std::fs::write(&file, chart(logarithmic).svg()).unwrap();
        let program = "import sys, xml.etree.ElementTree as e; r = e.parse(sys.argv[1]).getroot(); \
                       print(r.tag, *(t.text for t in r.iter('{http://www.w3.org/2000/svg}text')), sep='|')";
        let output = Command::new(&python).args(["-c", program]).arg(&file).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let message = String::from_utf8_lossy(&output.stdout);
        assert!(
            message.starts_with("{http://www.w3.org/2000/svg}svg|Loss < 4 & falling|training \"a\"|validation|"),
            "{message}"
        );
    }
}

/// Evaluates two images.
fn report() -> Report {
    let mut evaluation = Evaluation::new(["soil", "crop", "weed"]);
    for name in ["a", "b"] {
        let s = thumbnail(name);
        let answer = Prediction {
            name,
            width: s.width,
            height: s.height,
            truth: &s.truth,
            predicted: &s.predictions[0],
            plants: None,
            separated: None,
            seconds: Some(0.25),
        };
        evaluation.add(&answer).unwrap();
    }
    evaluation.finish()
}

fn page(report: &Report, thumbnails: &[Thumbnail]) -> String {
    let names: Vec<String> = ["soil", "crop", "weed"].map(Into::into).to_vec();
    let page = Page {
        kind: "Evaluation",
        title: "run <1>",
        lead: "Two images & a curve.",
        facts: &[("weights".into(), "a<b".into())],
        effects: None,
        plots: &[],
        report: Some(report),
        charts: &[chart(true), chart(false)],
        thumbnails,
        predictors: &[],
        palette: &PALETTE,
        classes: &names,
        tables: &[report.summary()],
    };
    page.html().unwrap()
}

/// Returns the value of the element with this `data-key`.
fn number(page: &str, key: &str) -> f64 {
    let rest = page.split(&format!("data-key=\"{key}\" data-value=\"")).nth(1).unwrap_or_else(|| panic!("no {key}"));
    rest.split('"').next().unwrap().parse().unwrap()
}

#[test]
fn numbers_of_a_page_are_those_of_the_report_and_it_asks_for_nothing() {
    let (report, thumbnails) = (report(), [thumbnail("a"), thumbnail("b")]);
    let html = page(&report, &thumbnails);
    assert_eq!(html, page(&report, &thumbnails), "the page must be reproducible");
    assert_eq!(number(&html, "mean_iou"), report.scores.mean_iou.unwrap());
    assert_eq!((number(&html, "images"), number(&html, "seconds")), (2.0, 0.25));
    for (truth, predicted) in (0..3).flat_map(|t| (0..3).map(move |p| (t, p))) {
        let n = number(&html, &format!("confusion.{truth}.{predicted}"));
        assert_eq!(n, report.confusion.at(truth, predicted) as f64);
    }
    for word in ["http:", "https:", "url(", "@import", "<script", "<iframe", "NaN", "run <1>"] {
        assert!(!html.contains(word), "the page has {word}");
    }
    assert_eq!(html.matches("<img src=\"data:image/").count(), html.matches("<img").count());
    assert_eq!(html.matches("<img").count(), 8, "image, truth, prediction and errors of two images");
    // An empty evaluation shows no images, and unknown scores are not shown as numbers.
    let empty = Evaluation::new(["soil", "crop", "weed"]).finish();
    let html = page(&empty, &[]);
    assert!(!html.contains("NaN") && !html.contains("<img") && html.contains("–"));
    let bare = Page { kind: "Training", title: "x", ..Page::default() }.html().unwrap();
    assert_eq!(bare.matches("<section>").count(), 0);
}

/// Script that reads the page's state in the browser and stores it in the document; not part of the shipped page.
const PROBE: &str = r#"<script>addEventListener("load", () => {
  const inside = e => { const r = e.getBoundingClientRect(); return r.width > 0 && r.height > 0; };
  document.body.dataset.probe = JSON.stringify({
    images: document.images.length,
    decoded: [...document.images].filter(i => i.complete && i.naturalWidth > 0 && inside(i)).length,
    curves: [...document.querySelectorAll(".plot [data-curve]")].filter(inside).length,
    ink: getComputedStyle(document.querySelector(".plot text")).fill,
    over: document.documentElement.scrollWidth - innerWidth,
    width: innerWidth,
    requests: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:")),
  });
});</script></body>"#;

#[test]
fn a_browser_shows_the_page_in_wide_and_narrow_windows() {
    let Some(browser) = browser() else { return };
    let (_kept, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("page.html");
    std::fs::write(&file, page(&report(), &[thumbnail("a"), thumbnail("b")]).replace("</body>", PROBE)).unwrap();
    for width in [1280, 500] {
        let seen = probe(&browser, &folder, &file, width);
        assert_eq!((seen["images"].as_i64(), seen["decoded"].as_i64()), (Some(8), Some(8)), "{seen}");
        assert_eq!(seen["curves"], 6, "{seen}");
        assert_eq!((seen["width"].as_i64(), seen["over"].as_i64()), (Some(width), Some(0)), "{seen}");
        assert_eq!(seen["ink"], "rgb(34, 38, 31)", "the page's own style must apply: {seen}");
        assert_eq!(seen["requests"], serde_json::json!([]), "{seen}");
    }
}
