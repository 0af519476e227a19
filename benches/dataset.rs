//! Images per hour, from the start of the program to the files on disk, and the share of time outside rendering.
//!
//!     cargo bench --bench dataset
//!
//! Renders `synthetic-d` with the formats PhenoBench and COCO. Time outside rendering (scene construction, labels, files) is reported as a
//! share of the summed times of the images: images in progress at the same time have separate threads, so their times add up. Rows with
//! denoising need `OIDN_DIR`.

#![expect(clippy::cast_precision_loss, reason = "the numbers of a benchmark are small")]

use furrow_dataset::make::timing_log::{ImageTiming, rows};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Width, height, samples per pixel, denoising, number of images.
const ROWS: [(u32, u32, u32, bool, u64); 3] =
    [(480, 360, 32, false, 20), (480, 360, 16, true, 20), (1296, 966, 64, false, 6)];

#[expect(clippy::print_stdout, reason = "the table is the result")]
fn main() {
    println!("| size | samples | denoised | images | images an hour | not rendering: scene / labels / files |");
    println!("|---|---|---|---|---|---|");
    for (width, height, spp, denoise, count) in ROWS {
        if denoise && std::env::var_os("OIDN_DIR").is_none() {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("data");
        let seconds = make(&out, [width, height, spp], count, denoise);
        let images = rows(&out).expect("a timing log");
        let sum = |of: fn(&ImageTiming) -> f64| images.iter().map(of).sum::<f64>();
        let [all, grow, draw, label] = [sum(|r| r.seconds), sum(|r| r.grow_s), sum(|r| r.draw_s), sum(|r| r.label_s)];
        let share = |of: f64| 100.0 * of / all;
        println!(
            "| {width} × {height} | {spp} | {} | {count} | {:.0} | {:.1} / {:.1} / {:.1} % |",
            if denoise { "yes" } else { "no" },
            3600.0 * count as f64 / seconds,
            share(grow),
            share(label),
            share(all - grow - draw - label),
        );
    }
}

/// Makes a dataset; returns the wall time of the program in seconds.
fn make(out: &Path, [width, height, spp]: [u32; 3], count: u64, denoise: bool) -> f64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trace"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(["dataset", "--scene", "scenes/synthetic-d.ron", "--quiet", "--format", "phenobench,coco"]);
    for (flag, value) in
        [("--width", width.into()), ("--height", height.into()), ("--spp", spp.into()), ("--count", count)]
    {
        command.args([flag, &value.to_string()]);
    }
    if denoise {
        command.arg("--denoise");
    }
    let begin = Instant::now();
    let output = command.arg("--out").arg(out).output().expect("the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    begin.elapsed().as_secs_f64()
}
