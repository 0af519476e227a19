//! Points on plants of known class: `train predict --like`.
//!
//! Rationale: a network that was never trained on a crop, in a field without rows, can only guess which plants are crop; a person
//! knows, and points at a few of them. A table that names another image, or a point beside it, would teach the wrong class in silence.
//!
//! Expected: of plants of two colours, whose sizes and places say nothing, those of the colour that points call crop are crop also in an
//! image without points, and the other way round with the classes exchanged; a folder keeps one table; clear errors for everything else.
//! Source: the construction of the images.

use furrow_base::sampling::{Purpose, Stream};
use furrow_output::{ImageData, write_png};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SIZE: (u32, u32) = (320, 240);

/// Discs of the first and of the second kind, by turns: centres in pixels.
fn centres(image: u64) -> Vec<(f32, f32)> {
    let mut stream = Stream::of(5, image, Purpose::Test, 0);
    let place = |k: usize| (32.0 + 64.0 * (k % 5) as f32, 30.0 + 60.0 * (k / 5) as f32);
    (0..20).map(|k| (place(k).0 + stream.range32(-9.0, 9.0), place(k).1 + stream.range32(-9.0, 9.0))).collect()
}

/// Draws a photograph of round plants on soil: dark green and yellow-green ones in no order of places.
fn photograph(folder: &Path, image: u64) {
    let mut noise = Stream::of(6, image, Purpose::Test, 0);
    let discs = centres(image);
    let pixels: Vec<[u8; 3]> = (0..SIZE.0 * SIZE.1)
        .map(|at| {
            let (x, y) = ((at % SIZE.0) as f32, (at / SIZE.0) as f32);
            let grain = noise.range32(-14.0, 14.0);
            let kind = discs.iter().position(|(cx, cy)| (x - cx).hypot(y - cy) < 14.0).map(|k| k % 2);
            let color = [[112.0, 92.0, 74.0], [44.0, 118.0, 40.0], [150.0, 176.0, 58.0]][kind.map_or(0, |k| k + 1)];
            color.map(|v: f32| (v + grain) as u8)
        })
        .collect();
    write_png(&folder.join(format!("{image}.png")), SIZE.0, SIZE.1, &ImageData::Rgb(&pixels), "").unwrap();
}

fn predict(photos: &Path, out: &Path, table: &Path, more: &[&str]) -> Output {
    let mut run = Command::new(env!("CARGO_BIN_EXE_train"));
    run.args(["predict", "any-field"]).arg(photos).args(["--resize", "320", "--quiet", "--threads", "1"]);
    run.arg("--out").arg(out).arg("--like").arg(table).args(more).output().unwrap()
}

/// Fractions of the plants of each kind whose centre is crop in a prediction.
fn crops(out: &Path, image: u64) -> [f32; 2] {
    let (_, _, classes) = furrow_output::read_indexed(&out.join(format!("{image}.png"))).unwrap();
    let mut crop = [0.0; 2];
    for (k, (x, y)) in centres(image).into_iter().enumerate() {
        crop[k % 2] += f32::from(u8::from(classes[(y as u32 * SIZE.0 + x as u32) as usize] == 1)) / 10.0;
    }
    crop
}

#[test]
fn points_in_one_image_name_the_crop_in_all() {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    (0..2).for_each(|image| photograph(&photos, image));
    for crop in 0..2 {
        let rows = centres(0)
            .into_iter()
            .enumerate()
            .map(|(k, (x, y))| format!("0.png,{x},{y},{}\n", if k % 2 == crop { "crop" } else { "weed" }));
        let table = folder.path().join(format!("{crop}.csv"));
        fs::write(&table, format!("image,x,y,class\n{}", rows.collect::<String>())).unwrap();
        let out = folder.path().join(format!("out{crop}"));
        let made = predict(&photos, &out, &table, &[]);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
        for image in 0..2 {
            let found = crops(&out, image);
            assert!(found[crop] - found[1 - crop] >= 0.6, "{crop}, image {image}: {found:?}");
        }
    }
    let other = predict(&photos, &folder.path().join("out0"), &folder.path().join("1.csv"), &[]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("other points"), "{other:?}");
}

#[test]
fn tables_and_steps_that_do_not_fit_are_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    photograph(&photos, 0);
    let (table, out) = (folder.path().join("points.csv"), folder.path().join("out"));
    let cases = [
        ("image,x,y,class\n0.png,4,400,crop\n", &[][..], "outside the image, 320 × 240 pixels"),
        ("image,x,y,class\n9.png,4,4,crop\n", &[], "none of the images to predict"),
        ("image,x,y,class\n0.png,4,4,soil\n", &[], "no class of a plant"),
        ("", &[], "no column `image`"),
        ("image,x,y,class\n0.png,4,4,crop\n", &["--refine", "colour"], "needs the refinement appearance"),
    ];
    for (text, more, what) in cases {
        fs::write(&table, text).unwrap();
        let refused = predict(&photos, &out, &table, more);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && said.contains(what) && said.contains("help"), "{text}: {said}");
        assert!(!out.join("0.png").exists() && !out.join("prediction.json").exists(), "{text}");
    }
}
