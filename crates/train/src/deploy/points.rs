//! Points on plants of known class, from a table: examples of the crop and of weeds in the images that are predicted.

use super::input_images::InputImage;
use crate::refine::Point;
use furrow_base::error::{Error, Result};
use furrow_base::input::read_text;
use furrow_base::math::{ToFloat, vec2};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Longest table, bytes.
const MOST_BYTES: u64 = 16 << 20;
/// Columns of the table.
const HELP: &str =
    "the table has the columns image (file name), x and y (pixels from the left and the top) and class (crop or weed)";

/// Columns of the table; others are ignored.
#[derive(Deserialize)]
struct Row {
    image: String,
    x: f64,
    y: f64,
    class: String,
}

/// Points of images, and the table that they come from.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// Points of each image; empty without a table.
    pub of: Vec<Vec<Point>>,
    /// SHA-256 of the table.
    pub table_sha256: Option<String>,
}

/// Reads a table of points; those of each image are in the order of `pictures`.
///
/// Images are named by their file name, or by the name of their prediction. Fails if a row has another image, another class or a position
/// outside the image, or if an image with points cannot be read.
pub fn read(table: &Path, pictures: &[InputImage]) -> Result<Points> {
    let refuse = |line: u64, what: String| Error::input(format!("line {line}: {what}")).help(HELP).in_file(table);
    let text = read_text(table, MOST_BYTES)?;
    let mut of = vec![Vec::new(); pictures.len()];
    let mut sizes: Vec<Option<(u32, u32)>> = vec![None; pictures.len()];
    let mut rows = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let names = rows.headers().map_err(|e| refuse(1, e.to_string()))?.clone();
    let mut record = csv::StringRecord::new();
    while rows.read_record(&mut record).map_err(|e| refuse(line_of(&e), e.to_string()))? {
        let line = record.position().map_or(0, csv::Position::line);
        let row: Row = record.deserialize(Some(&names)).map_err(|e| refuse(line, e.to_string()))?;
        let is_crop = match row.class.as_str() {
            "crop" => true,
            "weed" => false,
            other => return Err(refuse(line, format!("`{other}` is no class of a plant"))),
        };
        let is_named = |picture: &InputImage| {
            picture.name == row.image || picture.photo.file_name().is_some_and(|name| name == row.image.as_str())
        };
        let place = pictures.iter().position(is_named);
        let place = place.ok_or_else(|| refuse(line, format!("`{}` is none of the images to predict", row.image)))?;
        let (width, height) = match sizes[place] {
            Some(size) => size,
            None => pictures[place].read().map(|found| (found.width, found.height))?,
        };
        sizes[place] = Some((width, height));
        let at = (row.x / f64::from(width), row.y / f64::from(height));
        if !((0.0..=1.0).contains(&at.0) && (0.0..=1.0).contains(&at.1)) {
            let what = format!("({}, {}) is outside the image, {width} × {height} pixels", row.x, row.y);
            return Err(refuse(line, what));
        }
        of[place].push(Point { at: vec2(at.0.to_f32(), at.1.to_f32()), is_crop });
    }
    if of.iter().all(Vec::is_empty) {
        return Err(Error::input("there are no points in it").help(HELP).in_file(table));
    }
    Ok(Points { of, table_sha256: Some(hex::encode(Sha256::digest(text))) })
}

fn line_of(error: &csv::Error) -> u64 {
    error.position().map_or(0, csv::Position::line)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: points are found by file name and by prediction name, further columns and comments are skipped; each mistake is an error
    /// with its line.
    #[test]
    fn tables_of_points_are_read_and_mistakes_named() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "b.png"] {
            std::fs::write(
                folder.path().join(name),
                furrow_output::encode_png(8, 4, &furrow_output::ImageData::Rgb(&[[9; 3]; 32]), "").unwrap(),
            )
            .unwrap();
        }
        let shape = crate::data::Shape { width: 8, height: 4, bands: crate::data::Band::RGB.to_vec() };
        let pictures = super::super::input_images::find(&[folder.path().to_owned()], &shape, &[]).unwrap();
        let table = folder.path().join("points.csv");
        let of = |text: &str| {
            std::fs::write(&table, text).unwrap();
            read(&table, &pictures).map(|points| points.of)
        };
        let found = of("image,x,y,class,note\n# clicked\nb.png, 3, 1.5, crop,\na,0,4,weed,pale\n").unwrap();
        assert_eq!(found[0], [Point { at: vec2(0.0, 1.0), is_crop: false }]);
        assert_eq!(found[1], [Point { at: vec2(0.375, 0.375), is_crop: true }]);
        for (text, what) in [
            ("image,x,y,class\nc.png,1,1,crop\n", "line 2: `c.png` is none of the images"),
            ("image,x,y,class\na,1,1,soil\n", "line 2: `soil` is no class"),
            ("image,x,y,class\na,1,NaN,crop\n", "line 2: (1, NaN) is outside the image, 8 × 4 pixels"),
            ("image,x,y,class\na,9,1,crop\n", "line 2: (9, 1) is outside"),
            ("image,x,y,class\na,1,one,crop\n", "line 2"),
            ("image,x,class\na,1,crop\n", "line 2"),
            ("image,x,y,class\na,1\n", "line 2"),
            ("image,x,y,class\n", "there are no points"),
            ("", "there are no points"),
        ] {
            let error = of(text).unwrap_err().to_string();
            assert!(error.contains(what), "{text}: {error}");
        }
    }
}
