//! Images an hour, from the program's start to the files on the disk, and what is spent beside drawing.
//!
//!     cargo bench --bench dataset
//!
//! Synthetic D, its formats PhenoBench and COCO. Two runs of each row: one as users run it, for images an hour; one with a single image
//! under way, in which nothing overlaps, for the share of the time that is not drawing (growing, labels, files, the program's start and end).
//! Rows that denoise need `OIDN_DIR`.

use furrow::dataset::ledger::{Row, rows};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Width, height, samples a pixel, denoised, images.
const ROWS: [(u32, u32, u32, bool, u64); 3] =
    [(480, 360, 32, false, 20), (480, 360, 16, true, 20), (1296, 966, 64, false, 4)];

#[expect(clippy::print_stdout, reason = "a table is what a bench is for")]
fn main() {
    println!(
        "| size | samples | denoised | images | images an hour | s an image: grow / draw / label / rest | not drawing |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (width, height, spp, denoise, count) in ROWS {
        if denoise && std::env::var_os("OIDN_DIR").is_none() {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let run = |name: &str, more: &[&str]| -> (f64, Vec<Row>) {
            let out = folder.path().join(name);
            let seconds = make(&out, [width, height, spp], count, denoise, more);
            (seconds, rows(&out).expect("a ledger"))
        };
        let (together, _) = run("together", &[]);
        let (alone, images) = run("alone", &["--at-once", "1"]);
        let sum = |of: fn(&Row) -> f64| images.iter().map(of).sum::<f64>();
        let [grow, draw, label] = [sum(|r| r.grow_s), sum(|r| r.draw_s), sum(|r| r.label_s)];
        let each = |seconds: f64| seconds / count as f64;
        println!(
            "| {width} × {height} | {spp} | {} | {count} | {:.0} | {:.2} / {:.2} / {:.2} / {:.2} | {:.1} % |",
            if denoise { "yes" } else { "no" },
            3600.0 * count as f64 / together,
            each(grow),
            each(draw),
            each(label),
            each(alone - grow - draw - label),
            100.0 * (1.0 - draw / alone)
        );
    }
}

/// Makes a dataset; returns the seconds that the program took.
fn make(out: &Path, [width, height, spp]: [u32; 3], count: u64, denoise: bool, more: &[&str]) -> f64 {
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
    let output = command.arg("--out").arg(out).args(more).output().expect("the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    begin.elapsed().as_secs_f64()
}
