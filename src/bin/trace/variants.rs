//! Experiment file that trains a network on each of several datasets and compares them with the first one; written by
//! `trace ablate`.

use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_dataset::Set;
use furrow_dataset::model::split::Split;
use std::fmt::Write;

/// Seeds: fewer give no meaningful spread.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Training steps.
const STEPS: u64 = 600;
/// Batch size.
const BATCH: u64 = 4;
/// Size of the training crops.
const CROP: (u32, u32) = (240, 180);
/// Fraction of the crops centred on rare-class pixels: few other crops contain seedlings of a few pixels.
const RARE_CROPS: f64 = 0.25;
/// Training rate on two cores of 2 GHz in bf16, in crops of that size per second (`cargo bench --bench learn`).
const RATE: f64 = 17.0;
/// Minimum side of a network's input.
const LEAST: u32 = 32;

/// Returns the experiment file for datasets in folders next to it, each with its description. `reals` are the names of
/// the sets of real images that it refers to.
pub(crate) fn variants(sets: &[(Set, &str)], reals: &[String]) -> Result<String> {
    let Some((full, _)) = sets.first() else {
        return Err(Error::misuse("there is no dataset to train on").help("make one first"));
    };
    let rendering = full.recipe.rendering()?;
    let size = (rendering.width.max(LEAST), rendering.height.max(LEAST));
    let crop = (size.0 > CROP.0 && size.1 > CROP.1).then_some(CROP);
    let seen = crop.unwrap_or(size);
    let trainings = (sets.len() * SEEDS.len()).to_u64();
    let pixels = f64::from(seen.0) * f64::from(seen.1) / (f64::from(CROP.0) * f64::from(CROP.1));
    let hours = (trainings * STEPS * BATCH).to_f64() * pixels / RATE / 3600.0;
    let name = |set: &Set| set.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let base = name(full);
    let mut text = format!(
        "// How much does each rendering feature matter to a network? Written by `trace ablate` and overwritten each time: copy it to change
// it. After a stop, the same command continues; with --row k/N each machine of a cluster computes some rows.
//
//   train table ablation.ron --out answer{}
//
// DIR contains images/ and labels/ (0 soil, 1 crop, 2 weed, 255 none); `--without NAME` leaves a real set out.
// {trainings} trainings take about {hours:.1} hours on two cores with bf16 arithmetic.
Experiment(
    networks: [\"unet\"],
    baselines: [],
    seeds: {SEEDS:?},
    hyperparameters: (size: {size:?}, {}class_weights: \"annealed\", steps: {STEPS}, batch: {BATCH}),
    sets: {{
",
        reals.iter().fold(String::new(), |words, real| words + " --real " + real + "=DIR"),
        crop.map(|crop| format!("crop_size: {crop:?}, rare_crops: {RARE_CROPS:?}, ")).unwrap_or_default(),
    );
    for (set, about) in sets {
        let _ = writeln!(text, "        // {about}\n        {0:?}: Dataset(path: {0:?}),", name(set));
    }
    for real in reals {
        let _ = writeln!(text, "        {real:?}: Real(about: \"labelled photographs\"),");
    }
    text.push_str("    },\n    train: [\n");
    for (set, _) in sets {
        let _ = writeln!(text, "        (name: {0:?}, from: [(set: {0:?})]),", name(set));
    }
    text.push_str("    ],\n    test: [\n");
    if !full.names(Split::Test).is_empty() {
        let _ = writeln!(text, "        (name: \"Rendered\", set: {base:?}, images: \"test\"),");
    }
    for real in reals {
        let _ = writeln!(text, "        (name: {real:?}, set: {real:?}),");
    }
    let _ = write!(
        text,
        "    ],
    against: {base:?},
    scales: {{
        \"glance\": (seeds: [1, 2], hyperparameters: (steps: 20)),
        \"long\": (seeds: [1, 2, 3, 4, 5], hyperparameters: (steps: 5000)),
    }},
)
"
    );
    Ok(text)
}
