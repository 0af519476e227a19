//! Measured reflectance spectra: CSV files with wavelength and reflectance.

use super::bands;
use furrow_base::math::Spectrum;
use furrow_base::{Error, Result};

/// Wavelength range in nm that a file must cover: where the bands are sensitive. Outside the file's range the spectrum
/// is constant.
const NEEDED_NM: (f64, f64) = (420.0, 900.0);
/// Help text of every error, which describes the file format.
const FORM: &str = "two columns, wavelength in nm and reflectance from 0 to 1, such as 450,0.08; at least from 420 to 900 nm, rising; \
                    lines that start with # are comments";

/// Returns the band means of a spectrum, given the text of its file.
pub fn reflectance(text: &str) -> Result<Spectrum> {
    let points = points(text)?;
    Ok(bands::weigh(|nm| at(&points, f64::from(nm))))
}

/// Parses the wavelength and reflectance of each line.
fn points(text: &str) -> Result<Vec<(f64, f64)>> {
    let wrong = |what: String| Error::input(what).help(FORM);
    let has = |sign: char| text.lines().any(|line| !line.starts_with('#') && line.contains(sign));
    let delimiter =
        [(';', b';'), ('\t', b'\t')].into_iter().find(|(sign, _)| has(*sign)).map_or(b',', |(_, byte)| byte);
    let decimal = |likely: bool| if likely { "; are its commas decimal commas?" } else { "" };
    let mut table = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .delimiter(delimiter)
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (line, row) in (1..).zip(table.records()) {
        let row = row.map_err(|e| wrong(format!("it is not a table: {e}")))?;
        // Of decimal commas between cells, `400,0,25`, the share would be read as 0.
        if row.len() > 2 {
            return Err(wrong(format!("row {line} has {} cells, not two{}", row.len(), decimal(delimiter == b','))));
        }
        let number = |column: usize| row.get(column).and_then(|cell| cell.parse::<f64>().ok());
        match (number(0), number(1)) {
            (Some(nm), Some(share)) => points.push((nm, share)),
            // A first row that begins with a letter is a header.
            _ if line == 1 && row.get(0).is_some_and(|cell| cell.starts_with(char::is_alphabetic)) => {}
            _ => {
                let has_comma = row.iter().any(|cell| cell.contains(','));
                return Err(wrong(format!("row {line} is not two numbers{}", decimal(has_comma))));
            }
        }
    }
    if let Some(pair) = points.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
        return Err(wrong(format!("wavelengths must rise, and {} follows {}", pair[1].0, pair[0].0)));
    }
    if let Some((nm, _)) = points.iter().find(|(nm, _)| !(*nm > 0.0 && nm.is_finite())) {
        return Err(wrong(format!("a wavelength of {nm} nm is not positive and finite")));
    }
    if let Some((nm, share)) = points.iter().find(|(_, share)| !(0.0..=1.0).contains(share)) {
        let percent = if *share > 1.0 { "; is it in percent?" } else { "" };
        return Err(wrong(format!("a reflectance of {share} at {nm} nm is not between 0 and 1{percent}")));
    }
    match (points.first(), points.last()) {
        (Some(first), Some(last)) if first.0 <= NEEDED_NM.0 && last.0 >= NEEDED_NM.1 => Ok(points),
        (Some(first), Some(last)) => {
            let unit = if last.0 < 10.0 { "; is it in micrometres?" } else { "" };
            Err(wrong(format!("the spectrum goes from {} to {} nm{unit}", first.0, last.0)))
        }
        _ => Err(wrong("there is no line with numbers".into())),
    }
}

/// Interpolates linearly between the points; constant outside them.
fn at(points: &[(f64, f64)], nm: f64) -> f64 {
    let next = points.partition_point(|(at, _)| *at < nm);
    match (next.checked_sub(1).and_then(|k| points.get(k)), points.get(next)) {
        (Some((x0, y0)), Some((x1, y1))) => y0 + (y1 - y0) * (nm - x0) / (x1 - x0),
        (Some((_, y)), None) | (None, Some((_, y))) => *y,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a measured spectrum must give the same bands as the built-in spectra. Expected: a grey is grey; a
    /// step at 600 nm is red; a line through two points has its value at the band's mean wavelength; all spellings of
    /// the same table agree. Source: closed forms.
    #[test]
    fn bands_are_those_of_the_spectrum() {
        let grey = reflectance("# a card\nnm;share\n400;0.2\n1000;0.2\n").unwrap().to_array();
        assert!(grey.iter().all(|band| (band - 0.2).abs() < 1e-6), "{grey:?}");
        let red = reflectance("400, 0\n599, 0\n600, 0.5\n1000, 0.5").unwrap().to_array();
        assert!(red[0] > 0.4 && red[1] < 0.15 && red[2] < 0.05 && (red[3] - 0.5).abs() < 1e-6, "{red:?}");
        let slope = |text: &str| reflectance(text).unwrap();
        let line = slope("400\t0.1\n1000\t0.4\n");
        assert_eq!(line, slope("# a; b\n400,0.1\n1000,0.4\n"));
        assert_eq!(line, slope("wavelength,reflectance\n400,0.1\n700,0.25\n1000,0.4\n"));
        assert_eq!(line, bands::weigh(|nm| 0.1 + 0.3 * (f64::from(nm) - 400.0) / 600.0));
    }

    #[test]
    fn invalid_spectra_are_reported() {
        for (text, words) in [
            ("", "no line with numbers"),
            ("400,0.1\n700,x\n", "row 2 is not two numbers"),
            ("400,0,1\n1000,0,4\n", "row 1 has 3 cells, not two; are its commas decimal commas?"),
            ("400;0,1\n1000;0,4\n", "row 1 is not two numbers; are its commas decimal commas?"),
            ("400;0.1;0.01\n1000;0.4;0.01\n", "row 1 has 3 cells, not two"),
            ("400,10\n1000,40\n", "in percent?"),
            ("0.4,0.1\n1.0,0.4\n", "in micrometres?"),
            ("400,0.1\n700,0.2\n", "goes from 400 to 700 nm"),
            ("1000,0.4\n400,0.1\n", "wavelengths must rise"),
            ("400,NaN\n1000,0.4\n", "not between 0 and 1"),
            ("-400,0.1\n1000,0.4\n", "a wavelength of -400 nm is not positive"),
            ("0,0.1\n1000,0.4\n", "a wavelength of 0 nm is not positive"),
            ("400,0.1\ninf,0.4\n", "a wavelength of inf nm is not positive and finite"),
        ] {
            let error = reflectance(text).unwrap_err();
            assert!(error.to_string().contains(words), "{text:?}: {error}");
        }
    }
}
