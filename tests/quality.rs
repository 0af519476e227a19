//! `--quality`: named presets that take less time than the full integrator.
//!
//! Rationale: images of a preset are biased, so that nobody may mistake them for those of the full integrator; labels
//! do not depend on light. Expected: recipe, record and metadata of a dataset name the preset and its bias; an explicit
//! number of samples wins; images are darker than those of the same number of samples, labels are the same. Source: the
//! dataset without the preset.

use crate::common::dataset::{fail, path, succeed, tree};
use crate::common::program::{SMALL, scratch, trace};
use furrow_dataset::Set;
use furrow_dataset::read::native;
use furrow_render::settings::Preset;
use std::path::Path;
use std::process::Command;

fn make(folder: &Path, more: &[&str]) -> Command {
    let mut command = trace(&["dataset", "--scene", SMALL, "--quiet", "--width", "48", "--count", "1"]);
    command.args(["--format", "imagefolder", "--out", path(folder)]).args(more);
    command
}

#[test]
fn images_of_a_preset_name_it_and_keep_the_labels() {
    let (_keep, base) = scratch();
    let orders: [&[&str]; 3] = [&["--spp", "4"], &["--quality", "dataset"], &["--quality", "dataset", "--spp", "2"]];
    let folders = ["full", "preset", "fewer"].map(|name| base.join(name));
    for (folder, order) in folders.iter().zip(orders) {
        succeed(make(folder, order));
    }
    let sets = folders.each_ref().map(|folder| Set::open(folder).unwrap());
    let limits = sets.each_ref().map(|set| {
        let made = set.recipe.rendering().unwrap();
        (made.spp, made.max_depth, made.quality)
    });
    let preset = Some(Preset::Dataset);
    assert_eq!(limits, [(4, None, None), (4, Some(2), preset), (2, Some(2), preset)]);
    let [full, made, fewer] = folders.each_ref().map(|folder| native::read(folder, &Set::name(0)).unwrap());
    assert_eq!([&full, &made, &fewer].map(|image| image.record.quality), [None, preset, preset]);
    let samples = [&full, &made, &fewer].map(|image| image.record.sampling.as_ref().map(|sampling| sampling.spp));
    assert_eq!(samples, [4.0, 4.0, 2.0].map(Some));
    assert_eq!(full.record.plants, made.record.plants);
    // The sensor's exposure would hide missing light: less radiance is a larger gain.
    let gain = |image: &furrow_dataset::Sample| image.record.exposure.unwrap().gain;
    assert!(full.rgb != made.rgb && gain(&made) >= gain(&full), "{} {}", gain(&made), gain(&full));
    let maps = |folder: &Path| {
        let label = |name: &str| {
            name.starts_with("imagefolder/") && ["/images/", "/nir/"].iter().all(|kind| !name.contains(kind))
        };
        tree(folder).into_iter().filter(|(name, _)| label(name) && name.ends_with("png")).collect::<Vec<_>>()
    };
    let [expected, found, _] = folders.each_ref().map(|folder| maps(folder));
    assert!(!expected.is_empty() && expected == found, "{:?}", tree(&folders[0]).keys());
    let comment = |folder: &Path| {
        let file = std::fs::File::open(folder.join(native::folder(&Set::name(0))).join("semantics.png")).unwrap();
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
        reader.info().uncompressed_latin1_text.iter().map(|chunk| chunk.text.clone()).collect::<String>()
    };
    assert!(!comment(&folders[0]).contains("quality"), "{}", comment(&folders[0]));
    assert!(comment(&folders[1]).contains("\nquality: dataset (biased: "), "{}", comment(&folders[1]));
    let page = std::fs::read_to_string(folders[1].join("report.html")).unwrap();
    assert!(page.contains("--spp 4 --quality dataset --out"), "the command of an image leaves out the preset");
    // A dataset keeps the quality it was started with.
    assert!(fail(make(&folders[1], &["--spp", "4", "--max-depth", "2"]), 2).contains("quality"));
}

#[test]
fn contradicting_options_are_refused() {
    let image: &[&str] = &["--scene", SMALL, "--quality", "dataset"];
    let refused = |more: &[&str]| fail(trace(&[image, more].concat()), 2);
    for more in [&["--max-depth", "3"][..], &["--target-error", "0.1"], &["--time", "5s"]] {
        assert!(refused(more).contains("cannot be used with"), "{more:?}");
    }
    assert!(refused(&["--engine", "raster"]).contains("--quality dataset has no effect with --engine raster"));
    assert!(refused(&["--integrator", "albedo"]).contains("--quality"));
    assert!(fail(trace(&["--scene", SMALL, "--quality", "best"]), 2).contains("dataset"));
}
