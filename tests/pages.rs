//! HTML pages written by the programs open anywhere: in wide and narrow windows they load nothing, report no errors, do
//! not overflow the window, and show the important content.
//!
//! Rationale: users judge results by these pages, on desktops and phones. Expected: no request, no error in the
//! console, a document no wider than its window, every image decoded. Source: headless Chromium (Debian's `chromium`),
//! windows 1280 and 400 pixels wide.

use crate::common::browser::browser;
use crate::common::devtools::Page;
use crate::common::program::{scratch, trace};
use furrow_report::chart::{Chart, Curve, Effect};
use furrow_report::{Cell, Table};
use furrow_train::figure::{self, Plot, Thumbnail};
use furrow_train::measure::{Evaluation, Prediction};
use serde_json::{Value, json};
use std::path::Path;

/// State of a page in a window: overflow in pixels, requests, and images that are not decoded.
const SEEN: &str = r#"({
  over: Math.max(0, document.documentElement.scrollWidth - innerWidth),
  requests: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:")),
  broken: [...document.images].filter(i => !(i.complete && i.naturalWidth > 0)).length,
})"#;

/// Opens a page in a wide and in a narrow window; the expression `more` must be true in both.
fn opens(browser: &Path, file: &Path, more: &str) {
    for width in [1280, 400] {
        let folder = tempfile::tempdir().unwrap();
        let address = format!("file://{}", std::path::absolute(file).unwrap().display());
        let mut page = Page::open(browser, folder.path(), &address);
        page.resize(width, 900);
        page.wait(&format!("document.readyState === 'complete' && innerWidth === {width}"));
        let seen = page.ask(SEEN);
        assert_eq!(seen, json!({ "over": 0, "requests": [], "broken": 0 }), "{} at {width}", file.display());
        assert_eq!(page.ask(&format!("Boolean({more})")), true, "{} at {width}: {more}", file.display());
        assert!(page.complaints.is_empty(), "{:?}", page.complaints);
        if let Some(folder) = std::env::var_os("FURROW_SCREENSHOTS") {
            let name = format!("{}-{width}.png", file.file_stem().unwrap().to_string_lossy());
            std::fs::write(Path::new(&folder).join(name), page.screenshot()).unwrap();
        }
    }
}

fn write(folder: &Path, name: &str, page: &figure::Page<'_>) -> std::path::PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    let file = folder.join(name);
    std::fs::write(&file, page.html().unwrap()).unwrap();
    file
}

/// Expected: names are to the left of the zero line and inside the figure; a table wider than the window scrolls by
/// itself.
#[test]
fn the_answer_of_an_ablation_opens() {
    let Some(browser) = browser() else { return };
    let (_kept, folder) = scratch();
    let names = ["no-transmission", "flat-leaves", "no-ambient-occlusion-at-all", "no-sky", "labels-1.4px"];
    let classes = ["crop", "weed", "vegetation"];
    let heads = classes.iter().flat_map(|class| ["", " ±", " beyond"].map(|what| format!("a-real-set {class}{what}")));
    let mut table = Table::new("Change of I/U", ["network", "trained on"].map(str::to_owned).into_iter().chain(heads));
    for (k, name) in names.iter().enumerate() {
        let cells = (0..3).flat_map(|c| {
            let mean = 2.0 * k as f64 - 5.0 + f64::from(c);
            [Cell::number(Some(mean), 1), Cell::number(Some(1.5), 1), Cell::text("yes")]
        });
        table.push([Cell::text("lite-unet"), Cell::text(*name)].into_iter().chain(cells));
    }
    let effects = |shift: f64| -> Vec<Effect> {
        let effect = |(k, name): (usize, &&str)| Effect {
            name: (*name).into(),
            mean: 2.0 * k as f64 - 5.0 + shift,
            spread: Some(1.5),
        };
        names.iter().enumerate().map(effect).collect()
    };
    let plots: Vec<Plot> = classes
        .iter()
        .zip(0..)
        .map(|(class, c)| Plot { title: format!("lite-unet: {class}"), effects: effects(f64::from(c)) })
        .collect();
    let page = figure::Page {
        kind: "Experiment",
        title: "Effects",
        effects: Some(&table),
        plots: &plots,
        ..figure::Page::default()
    };
    let file = write(&folder, "effects.html", &page);
    let inside = "[...document.querySelectorAll('.forest')].length === 3 && [...document.querySelectorAll('.forest')].every(f => { \
                  const zero = f.querySelector('.zero').getBoundingClientRect(), box = f.getBoundingClientRect(); \
                  return [...f.querySelectorAll('text, circle, .bar')].every(t => { const r = t.getBoundingClientRect(); \
                  return r.left >= box.left && r.right <= box.right + 1; }) && zero.left > f.querySelector('.name').getBoundingClientRect().right; })";
    opens(&browser, &file, inside);
}

/// Expected: the worst image is first; a click enlarges it to the width of the window, another click restores it.
#[test]
fn an_evaluation_opens_with_the_worst_first_and_pictures_enlarge() {
    let Some(browser) = browser() else { return };
    let (_kept, folder) = scratch();
    let (mut evaluation, mut thumbnails) = (Evaluation::new(["soil", "crop", "weed"]), Vec::new());
    for (name, right) in [("good", 23), ("bad", 3), ("middling", 12)] {
        let truth: Vec<u8> = (0..24).map(|k| u8::from(k % 2 == 0)).collect();
        let predicted: Vec<u8> = truth.iter().enumerate().map(|(k, t)| if k < right { *t } else { 1 - t }).collect();
        let answer = Prediction {
            name,
            width: 6,
            height: 4,
            truth: &truth,
            predicted: &predicted,
            plants: None,
            separated: None,
            seconds: None,
        };
        evaluation.add(&answer).unwrap();
        thumbnails.push(Thumbnail::new(name, (6, 4), &[[90, 120, 60]; 24], &truth, &[&predicted], 100));
    }
    let report = evaluation.finish();
    let curve = |name: &str| Curve { name: name.into(), points: vec![(0.0, 2.0), (10.0, 0.5)] };
    let charts = [Chart {
        title: "Training loss".into(),
        across: "steps".into(),
        upwards: "loss".into(),
        curves: vec![curve("runs/a/with/a/long/name"), curve("runs/b/with/a/long/name")],
        logarithmic: true,
    }];
    let page = figure::Page {
        kind: "Evaluation",
        title: "run",
        report: Some(&report),
        thumbnails: &thumbnails,
        charts: &charts,
        palette: &[[0; 3], [0, 255, 0], [255, 0, 0]],
        classes: &report.classes,
        ..figure::Page::default()
    };
    let file = write(&folder, "evaluation.html", &page);
    let order =
        "[...document.querySelectorAll('.row figcaption b')].map(b => b.textContent).join() === 'bad,middling,good'";
    let enlarges = "(() => { const i = document.querySelector('.row img'), at = () => i.getBoundingClientRect().width, before = at(); \
                    i.click(); const large = at(); i.click(); return large === innerWidth && before < innerWidth / 2 && at() === before; })()";
    opens(&browser, &file, &format!("{order} && {enlarges}"));
}

/// Expected: every stage has its name as text, and a bar of the stated length.
#[test]
fn the_catalogue_opens() {
    let Some(browser) = browser() else { return };
    let (_kept, out) = scratch();
    let arguments = [
        "catalogue",
        "--species",
        "echinochloa",
        "--size",
        "64",
        "--spp",
        "1",
        "--quiet",
        "--out",
        out.to_str().unwrap(),
    ];
    let output = trace(&arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let message = "[...document.querySelectorAll('.stage')].length > 3 && [...document.querySelectorAll('.stage')].every(s => \
                /^BBCH \\d+$/.test(s.querySelector('figcaption').textContent) && s.querySelectorAll('svg image').length === 2) && \
                [...document.querySelectorAll('.bar')].every(b => Number(b.dataset.mm) > 0 && b.getBoundingClientRect().width > 5)";
    opens(&browser, &out.join("catalogue.html"), message);
}

/// Expected: for two sets, one of which is darker, the page lists fields to change.
#[test]
fn a_comparison_of_sets_opens() {
    let Some(browser) = browser() else { return };
    let (_kept, folder) = scratch();
    for (name, lift) in [("real", 0), ("made", 60)] {
        std::fs::create_dir_all(folder.join(name)).unwrap();
        for k in 0..4_u32 {
            let rgb: Vec<[u8; 3]> = (0..96 * 64).map(|p| [((p * 7 + k * 13) % 90 + 80 - lift) as u8; 3]).collect();
            let picture = furrow_output::ImageData::Rgb(&rgb);
            furrow_output::write_png(&folder.join(format!("{name}/{k}.png")), 96, 64, &picture, "").unwrap();
        }
    }
    let out = folder.join("out");
    let place = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let arguments =
        ["compare", "--real", &place("real"), "--synthetic", &place("made"), "--out", out.to_str().unwrap(), "--quiet"];
    let output = trace(&arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    opens(
        &browser,
        &out.join("gap.html"),
        "document.querySelector('.turns code').textContent === 'sensor.exposure.Auto.level'",
    );
    let json: Value = serde_json::from_slice(&std::fs::read(out.join("gap.json")).unwrap()).unwrap();
    assert_eq!(json["advice"][0]["turns"][0], json!({ "field": "sensor.exposure.Auto.level", "way": "raise" }));
}
