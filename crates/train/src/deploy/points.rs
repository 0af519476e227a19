//! Points on plants of known class, from a table: examples of the crop and of weeds in the images that are predicted.

use super::input_images::InputImage;
use crate::refine::Point;
use furrow_base::error::{Error, Result};
use furrow_base::input::read_text;
use furrow_base::math::{ToFloat, ToInt, vec2};
use furrow_dataset::read::checksum::Checksum;
use std::path::Path;

/// Longest table, bytes.
const MOST_BYTES: u64 = 16 << 20;
/// Help of the errors about the table.
const HELP: &str =
    "the table has the columns image (file name), x and y (pixels from the left and the top) and class (crop or weed)";

/// Points of images, and the table that they come from.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// Points of each image; empty without a table.
    pub of: Vec<Vec<Point>>,
    /// SHA-256 of the table.
    pub table_sha256: Option<String>,
}

/// Columns of the table; others are ignored.
const COLUMNS: [&str; 4] = ["image", "x", "y", "class"];
/// Longest text of a cell in an error, characters.
const SHOWN: usize = 60;

/// Reads a table of points; those of each image are in the order of `pictures`. Columns are separated by commas, semicolons or tabs.
///
/// Images are named by their file name, or by the name of their prediction. Fails if a row names no image or several, has another class or a
/// position outside the image, or if an image with points cannot be read.
pub fn read(table: &Path, pictures: &[InputImage]) -> Result<Points> {
    let refuse = |line: u64, what: String| Error::input(format!("line {line}: {what}")).help(HELP).in_file(table);
    let text = read_text(table, MOST_BYTES)?;
    let names = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let delimiter = [b',', b';', b'\t'].into_iter().find(|sign| names.as_bytes().contains(sign)).unwrap_or(b',');
    let mut rows = csv::ReaderBuilder::new().delimiter(delimiter).flexible(true).from_reader(text.as_bytes());
    let line_of = |place: Option<&csv::Position>| line_at(&text, place.map_or(0, csv::Position::byte));
    let failed = |e: csv::Error| refuse(line_of(e.position()), e.to_string());
    let names = rows.headers().map_err(failed)?.clone();
    let column = |name: &&str| {
        let place = names.iter().position(|found| found.trim().eq_ignore_ascii_case(name));
        place.ok_or_else(|| refuse(line_of(names.position()), format!("there is no column `{name}`")))
    };
    let columns = COLUMNS.iter().map(column).collect::<Result<Vec<usize>>>()?;
    let mut of = vec![Vec::new(); pictures.len()];
    let mut sizes: Vec<Option<(u32, u32)>> = vec![None; pictures.len()];
    let mut record = csv::StringRecord::new();
    while rows.read_record(&mut record).map_err(failed)? {
        let line = line_of(record.position());
        let cell = |k: usize| record.get(columns[k]).unwrap_or_default();
        let shown = |k: usize| cell(k).trim().chars().take(SHOWN).collect::<String>();
        let number = |k: usize| {
            let found = cell(k).trim().parse::<f64>();
            found.map_err(|_| refuse(line, format!("{} is `{}`, not a number", COLUMNS[k], shown(k))))
        };
        let (x, y) = (number(1)?, number(2)?);
        let is_crop = match cell(3).trim() {
            "crop" => true,
            "weed" => false,
            _ => return Err(refuse(line, format!("`{}` is no class of a plant", shown(3)))),
        };
        let named = |name: &str| -> Vec<usize> {
            let is_named = |picture: &InputImage| {
                picture.name == name || picture.photo.file_name().is_some_and(|file| file == name)
            };
            (0..pictures.len()).filter(|place| is_named(&pictures[*place])).collect()
        };
        let places = Some(named(cell(0))).filter(|found| !found.is_empty()).unwrap_or_else(|| named(cell(0).trim()));
        let place = match places.as_slice() {
            [place] => *place,
            [] => return Err(refuse(line, format!("`{}` is none of the images to predict", shown(0)))),
            [one, other, ..] => {
                let (one, other) = (&pictures[*one].name, &pictures[*other].name);
                let what =
                    format!("`{}` names several images: write the name of the prediction, {one} or {other}", shown(0));
                return Err(refuse(line, what));
            }
        };
        let (width, height) = match sizes[place] {
            Some(size) => size,
            None => match pictures[place].read() {
                Ok(found) => (found.width, found.height),
                Err(fault) => return Err(refuse(line, format!("the image of this point cannot be read: {fault}"))),
            },
        };
        sizes[place] = Some((width, height));
        let at = (x / f64::from(width), y / f64::from(height));
        if !((0.0..=1.0).contains(&at.0) && (0.0..=1.0).contains(&at.1)) {
            return Err(refuse(line, format!("({x}, {y}) is outside the image, {width} × {height} pixels")));
        }
        of[place].push(Point { at: vec2(at.0.to_f32(), at.1.to_f32()), is_crop });
    }
    if of.iter().all(Vec::is_empty) {
        return Err(Error::input("there are no points in it").help(HELP).in_file(table));
    }
    Ok(Points { of, table_sha256: Some(Checksum::of(text.as_bytes()).sha256) })
}

/// Returns the number of the line of the first text at or after a byte. The reader's own count is wrong after CRLF and empty lines.
fn line_at(text: &str, byte: u64) -> u64 {
    let at = byte.to_usize().min(text.len());
    let ends = |c: &char| c.is_ascii_whitespace();
    let skipped = text.get(at..).map_or(0, |rest| rest.chars().take_while(ends).count());
    text.get(..at + skipped).unwrap_or_default().matches('\n').count().to_u64() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: points are found by file name and by prediction name, further columns and empty lines are skipped; each mistake is an error
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
        let found = of("Image,x,y,class,note\nb.png, 3, 1.5, crop,\n\na,0,4,weed,pale\n").unwrap();
        assert_eq!(found[0], [Point { at: vec2(0.0, 1.0), is_crop: false }]);
        assert_eq!(found[1], [Point { at: vec2(0.375, 0.375), is_crop: true }]);
        for (text, what) in [
            ("image,x,y,class\nc.png,1,1,crop\n", "line 2: `c.png` is none of the images"),
            ("image,x,y,class\na,1,1,soil\n", "line 2: `soil` is no class"),
            ("image,x,y,class\na,1,NaN,crop\n", "line 2: (1, NaN) is outside the image, 8 × 4 pixels"),
            ("image,x,y,class\na,9,1,crop\n", "line 2: (9, 1) is outside"),
            ("image,x,y,class\r\n\r\na,1,one,crop\r\n", "line 3: y is `one`, not a number"),
            ("image;x;y;class\na;1;1;crops\n", "line 2: `crops` is no class"),
            ("image,x,class\na,1,crop\n", "line 1: there is no column `y`"),
            ("\n\nimage,x\n", "line 3: there is no column `y`"),
            ("a,1,1,crop\n", "line 1: there is no column `image`"),
            ("image,x,y,class\na,1\n", "line 2: y is ``, not a number"),
            ("image,x,y,class\n", "there are no points"),
            ("", "line 1: there is no column `image`"),
        ] {
            let error = of(text).unwrap_err().to_string();
            assert!(error.contains(what), "{text}: {error}");
        }
    }
}
