//! The report of a dataset: its figures are correct, it is self-contained, and a browser shows it.
//!
//! Rationale: users judge a dataset by this page, so it must be correct and open anywhere. Expected: its figures equal
//! sums over the records computed here; the page makes no request; every image is decoded; nothing overflows a narrow
//! window. Source: the records on disk; headless Chromium (Debian's `chromium`).

use crate::common::browser::{browser, probe};
use crate::common::devtools::Page;
use crate::common::program::{SMALL, scratch, trace};
use serde_json::Value;
use std::path::Path;

/// Number of images in the small dataset.
const COUNT: u64 = 6;

/// Generates a small dataset and returns the text of its report.
fn dataset(out: &Path) -> String {
    let arguments = ["dataset", "--scene", SMALL, "--spp", "2", "--width", "96", "--height", "72", "--split", "4,1,1"];
    let mut command = trace(&arguments);
    command.args(["--count", &COUNT.to_string(), "--quiet", "--out", out.to_str().unwrap()]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(out.join("report.html")).unwrap()
}

fn records(out: &Path) -> Vec<Value> {
    let read = |k| std::fs::read(out.join(format!("images/{k:06}/record.json"))).unwrap();
    (0..COUNT).map(|k| serde_json::from_slice(&read(k)).unwrap()).collect()
}

/// Returns an attribute of the element with this `data-key`.
fn attribute<'a>(page: &'a str, key: &str, name: &str) -> &'a str {
    let of = |text: &'a str, before: &str| -> &'a str {
        let at = text.find(before).unwrap_or_else(|| panic!("no {before} of {key}")) + before.len();
        text[at..].split('"').next().unwrap()
    };
    let at = page.find(&format!("data-key=\"{key}\"")).unwrap_or_else(|| panic!("nothing has the key {key}"));
    of(page[at..].split('>').next().unwrap(), &format!("{name}=\""))
}

fn number(page: &str, key: &str, name: &str) -> f64 {
    attribute(page, key, name).parse().unwrap()
}

/// Returns the plants of a class that are visible in an image.
fn seen<'a>(record: &'a Value, class: &'a str) -> impl Iterator<Item = &'a Value> {
    let plants = record["plants"].as_array().unwrap().iter();
    plants.filter(move |p| p["class"] == class && p["seen"]["pixels"].as_u64() > Some(0))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn numbers_of_the_report_are_those_of_the_records() {
    let (_kept, out) = scratch();
    let page = dataset(&out);
    let records = records(&out);
    assert_eq!(number(&page, "images", "data-value"), COUNT as f64);
    let splits = ["train", "val", "test"].map(|s| records.iter().filter(|r| r["split"] == s).count() as f64);
    assert_eq!(["train", "val", "test"].map(|s| number(&page, &format!("split.{s}"), "data-value")), splits);
    for (k, class) in ["soil", "crop", "weed"].into_iter().enumerate() {
        let pixels: f64 = records.iter().map(|r| r["classes"][k]["pixels"].as_f64().unwrap()).sum();
        assert_eq!(number(&page, &format!("pixels.{class}"), "data-value"), pixels, "{class}");
    }
    let mut leaves = 0;
    for class in ["crop", "weed"] {
        let plants: Vec<&Value> = records.iter().flat_map(|r| seen(r, class)).collect();
        assert!(!plants.is_empty(), "no {class} in the dataset");
        assert_eq!(number(&page, &format!("plants.{class}"), "data-value"), plants.len() as f64);
        leaves += plants
            .iter()
            .flat_map(|p| p["leaves"].as_array().unwrap())
            .filter(|l| l["seen"]["pixels"].as_u64() > Some(0))
            .count();
        let of = |path: &str| -> Vec<f64> { plants.iter().filter_map(|p| p.pointer(path)?.as_f64()).collect() };
        for (key, path) in [("plant_pixels", "/seen/pixels"), ("bbch", "/grown/bbch"), ("age_days", "/grown/age_days")]
        {
            let (key, values) = (format!("{key}.{class}"), of(path));
            assert_eq!(number(&page, &key, "data-n"), values.len() as f64, "{key}");
            // Records contain the shortest decimal form of single-precision numbers.
            assert!((number(&page, &key, "data-mean") - mean(&values)).abs() <= 1e-6 * mean(&values), "{key}");
            let bars = attribute(&page, &key, "data-counts").split(' ').map(|n| n.parse::<usize>().unwrap());
            assert_eq!(bars.sum::<usize>(), values.len(), "bars of {key}");
        }
    }
    assert_eq!(number(&page, "leaves", "data-value"), leaves as f64);
    let hidden =
        records.iter().flat_map(|r| r["plants"].as_array().unwrap()).filter(|p| p["seen"]["pixels"] == 0).count();
    assert_eq!(number(&page, "plants.hidden", "data-value"), hidden as f64);
    let heights: Vec<f64> =
        records.iter().map(|r| r["conditions"]["camera"]["position_m"][2].as_f64().unwrap()).collect();
    assert!((number(&page, "camera_height_m", "data-mean") - mean(&heights)).abs() < 1e-9);
    // Each species is in the table with the number of its visible plants.
    let recipe: Value = serde_json::from_slice(&std::fs::read(out.join("dataset.json")).unwrap()).unwrap();
    for (k, species) in recipe["species"].as_array().unwrap().iter().enumerate() {
        assert!(page.contains(species["name"].as_str().unwrap()));
        let plants = records.iter().flat_map(|r| r["plants"].as_array().unwrap());
        let n = plants.filter(|p| p["kind"] == k as u64 + 1 && p["seen"]["pixels"].as_u64() > Some(0)).count();
        assert_eq!(number(&page, &format!("species.{}.plants", k + 1), "data-value"), n as f64);
    }
}

#[test]
fn equal_datasets_have_equal_reports_that_ask_for_nothing() {
    let (_kept, out) = scratch();
    let page = dataset(&out.join("a"));
    assert_eq!(page, dataset(&out.join("b")), "the same dataset in another folder");
    for word in ["http:", "https:", "url(", "@import", "<script src", "<iframe", "fetch(", "XMLHttpRequest"] {
        assert!(!page.contains(word), "the page has {word}");
    }
    let outside = page.match_indices("src=\"").filter(|(at, m)| !page[at + m.len()..].starts_with("data:image/"));
    assert_eq!(outside.count(), 0, "images outside the page");
    assert_eq!(page.matches("<figure class=\"shot\"").count() as u64, COUNT);
    let manifest: Value = serde_json::from_slice(&std::fs::read(out.join("a/manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["files"]["report.html"]["bytes"], page.len());
}

/// Script that reads the page's state in the browser and stores it in the document; not part of the shipped page.
const PROBE: &str = r#"<script>addEventListener("load", () => {
  const opacity = () => getComputedStyle(document.querySelector(".frame .labels")).opacity;
  document.querySelectorAll(".labels").forEach(i => i.style.transition = "none");
  const before = opacity();
  document.querySelector("label.switch").click();
  document.body.dataset.probe = JSON.stringify({
    images: document.images.length,
    decoded: [...document.images].filter(i => i.complete && i.naturalWidth > 0).length,
    over: document.documentElement.scrollWidth - innerWidth,
    width: innerWidth,
    before: +before, after: +opacity(),
    requests: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:")),
  });
});</script></body>"#;

#[test]
fn a_browser_shows_the_report_in_wide_and_narrow_windows() {
    let Some(browser) = browser() else { return };
    let (_kept, out) = scratch();
    let page = dataset(&out).replace("</body>", PROBE);
    let file = out.join("probed.html");
    std::fs::write(&file, page).unwrap();
    for width in [1280, 500] {
        let seen = probe(&browser, &out, &file, width);
        assert_eq!(seen["images"], 2 * COUNT, "{seen}");
        assert_eq!(seen["decoded"], seen["images"], "{seen}");
        assert_eq!((seen["width"].as_i64(), seen["over"].as_i64()), (Some(width), Some(0)), "{seen}");
        assert_eq!(
            (seen["before"].as_f64(), seen["after"].as_f64()),
            (Some(0.0), Some(1.0)),
            "labels by click: {seen}"
        );
        assert_eq!(seen["requests"], serde_json::json!([]), "{seen}");
    }
}

/// Rationale: users search reports of many images for unusual ones. Expected: filters, search and sorting agree with
/// the records; enlarging an image shows the dataset's own file. Source: the records on disk.
#[test]
fn images_are_filtered_sorted_searched_and_enlarged() {
    let Some(browser) = browser() else { return };
    let (_kept, out) = scratch();
    dataset(&out);
    let folder = tempfile::tempdir().unwrap();
    let address = format!("file://{}/report.html", std::path::absolute(&out).unwrap().display());
    let mut page = Page::open(&browser, folder.path(), &address);
    page.wait("document.querySelector('.tools') && !document.querySelector('.tools').hidden");
    let set = |page: &mut Page, id: &str, value: &str| {
        let change = format!(
            "(() => {{ const e = document.getElementById('{id}'); e.value = '{value}'; e.dispatchEvent(new Event('input')); }})()"
        );
        page.ask(&change);
        page.ask("[...document.querySelectorAll('.shot')].filter(s => !s.hidden).map(s => s.dataset.name).join()")
    };
    let all = records(&out);
    let with = |class: &str| -> Vec<&str> {
        let shown = all.iter().filter(|r| {
            r["classes"].as_array().unwrap().iter().any(|c| c["class"] == class && c["pixels"].as_u64() > Some(0))
        });
        shown.map(|r| r["name"].as_str().unwrap()).collect()
    };
    let names = |of: &Value| {
        let mut names: Vec<String> =
            of.as_str().unwrap().split(',').filter(|n| !n.is_empty()).map(str::to_owned).collect();
        names.sort();
        names
    };
    assert_eq!(names(&set(&mut page, "show", "crop")), with("crop"));
    assert_eq!(names(&set(&mut page, "show", "weed")), with("weed"));
    assert_eq!(names(&set(&mut page, "show", "all")).len() as u64, COUNT);
    assert_eq!(set(&mut page, "find", "000003"), "000003");
    set(&mut page, "find", "");
    let sorted = set(&mut page, "sort", "cover");
    let cover = |name: &str| {
        let record = all.iter().find(|r| r["name"] == name).unwrap();
        let of = |class: &str| {
            record["classes"]
                .as_array()
                .unwrap()
                .iter()
                .find(|c| c["class"] == class)
                .map_or(0, |c| c["pixels"].as_u64().unwrap())
        };
        of("crop") + of("weed")
    };
    let covers: Vec<u64> = sorted.as_str().unwrap().split(',').map(cover).collect();
    assert!(covers.windows(2).all(|pair| pair[0] + 2 >= pair[1]), "{covers:?}");
    assert_eq!(set(&mut page, "sort", "sun").as_str().unwrap().split(',').count() as u64, COUNT);
    assert_eq!(names(&set(&mut page, "show", "light:daylight")).len() as u64, COUNT);
    page.ask("document.querySelector('a.enlarge').click()");
    page.wait("document.getElementById('large').open && document.querySelector('#large img').naturalWidth === 96");
    // The command of another image, run in the dataset's folder, renders the pixels of the dataset.
    set(&mut page, "again", "4");
    let command = page.ask("document.getElementById('command').textContent");
    let words: Vec<&str> = command.as_str().unwrap().split(' ').collect();
    let mut again = std::process::Command::new(env!("CARGO_BIN_EXE_trace"));
    let done = again.current_dir(&out).args(&words[1..]).args(["--quiet"]).output().unwrap();
    assert!(done.status.success(), "{command}: {}", String::from_utf8_lossy(&done.stderr));
    let pixels = |path: &str| furrow_output::read_photo(&out.join(path)).unwrap();
    assert_eq!(pixels("out/4/rgb.png"), pixels("images/000004/rgb.png"), "{command}");
    assert!(page.complaints.is_empty(), "{:?}", page.complaints);
}

/// Rationale: datasets outlive the program version that made them. Expected: images of an earlier version pass
/// `verify`, and finishing them again gives the same lists and a report with the same figures under the same keys; no
/// field of the conditions is lost. Source: `tests/data/dataset`, two images of version 0.1.0, which still read
/// conditions through JSON pointers.
#[test]
fn a_dataset_of_an_earlier_version_is_read_to_the_same_report() {
    let (_kept, out) = scratch();
    for (name, bytes) in crate::common::dataset::tree(Path::new("tests/data/dataset")) {
        let path = out.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    let run = |verb: &str| {
        let message = crate::common::dataset::succeed(crate::common::dataset::verb(verb, &out, &[])).stderr;
        String::from_utf8_lossy(&message).into_owned()
    };
    let message = run("verify");
    assert!(message.contains("2 of 2 images checked") && message.contains("; 0 faults"), "{message}");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    for name in ["000000", "000001"] {
        let record = furrow_dataset::read::native::read_record(&out, name).unwrap();
        let text = serde_json::to_string(&record).unwrap() + "\n";
        assert_eq!(text, read(&format!("images/{name}/record.json")), "{name}");
    }
    let before = (read("report.html"), read("imagefolder/train/metadata.jsonl"));
    std::fs::remove_file(out.join("report.html")).unwrap();
    std::fs::remove_file(out.join("imagefolder/train/metadata.jsonl")).unwrap();
    run("finish");
    assert_eq!(read("imagefolder/train/metadata.jsonl"), before.1);
    let page = read("report.html");
    let keys: Vec<&str> = before.0.split("data-key=\"").skip(1).map(|t| t.split('"').next().unwrap()).collect();
    for key in ["sun_elevation_deg", "irradiance", "cloud", "turbidity", "moisture", "roughness_mm", "clods", "straw"] {
        assert!(keys.contains(&key), "{key}");
    }
    for key in ["camera_height_m", "tilt_deg", "pixel_mm"] {
        assert!(keys.contains(&key), "{key}");
    }
    for key in keys {
        let of = |page: &str| {
            let at = page.find(&format!("data-key=\"{key}\"")).unwrap_or_else(|| panic!("nothing has the key {key}"));
            let tag = page[at..].split('>').next().unwrap();
            let name = if tag.contains("data-mean") { "data-mean" } else { "data-value" };
            tag.contains(name).then(|| attribute(page, key, name).to_owned())
        };
        assert_eq!(of(&page), of(&before.0), "{key}");
    }
    assert!(run("verify").contains("; 0 faults"));
}
