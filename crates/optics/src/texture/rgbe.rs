//! Radiance images (.hdr): three mantissas and one exponent per pixel, L = m · 2^(e − 136), divided by the exposure and
//! the colour correction in the header.
//!
//! Source: Ward 1991, "Real Pixels", Graphics Gems II; the Radiance file formats. The header is read here, because the
//! decoder of the crate `image` ignores exposure, colour correction, primaries and encoding, and knows one order of
//! pixels out of eight.

use super::primaries::{Primaries, convert};
use super::texels::{Texels, check};
use furrow_base::math::ToInt;
use image::DynamicImage;
use image::codecs::hdr::HdrDecoder;
use std::io::{BufRead, Cursor, Read};

/// Largest size of a header in bytes.
const MOST_HEADER: u64 = 1 << 20;

/// Header of a file.
struct Header {
    /// Factor that was applied to each band.
    exposure: [f32; 3],
    primaries: Option<Primaries>,
    width: usize,
    height: usize,
    order: PixelOrder,
}

/// Order of the stored pixels. The default is the usual one: rows from the top, each from the left.
#[derive(Clone, Copy, Default)]
struct PixelOrder {
    /// Columns are stored one after the other instead of rows.
    by_column: bool,
    from_right: bool,
    from_below: bool,
}

/// Returns width and height of a file; `None` if it is not a Radiance file.
pub(super) fn size(source: impl BufRead) -> Option<(usize, usize)> {
    let header = Header::read(source).ok()?;
    Some((header.width, header.height))
}

/// Decodes a whole file. The error is a message.
pub(super) fn decode(bytes: &[u8]) -> Result<Texels, String> {
    let mut source = Cursor::new(bytes);
    let header = Header::read(&mut source)?;
    let (width, height) = (header.width, header.height);
    check(width, height)?;
    // The pixels again under a header that the decoder knows.
    let (across, down) = if header.order.by_column { (height, width) } else { (width, height) };
    let usual = format!("#?RADIANCE\n\n-Y {down} +X {across}\n");
    let pixels = &bytes[source.position().to_usize()..];
    let decoder = HdrDecoder::new(usual.as_bytes().chain(pixels)).map_err(|e| e.to_string())?;
    let stored = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?.into_rgb32f();
    let factors = header.exposure.map(|exposure| 1.0 / exposure);
    let pixel = |k: usize| {
        let (x, y) = header.order.place(k % width, k / width, (width, height));
        let stored = stored.get_pixel(x.to_u32(), y.to_u32()).0;
        std::array::from_fn(|band| stored[band] * factors[band])
    };
    let mut rgb: Vec<[f32; 3]> = (0..width * height).map(pixel).collect();
    if let Some(matrix) = header.primaries.map_or(Ok(None), Primaries::to_rec709)? {
        convert(&mut rgb, matrix);
    }
    Ok(Texels { width, height, rgb, nir: None })
}

impl Header {
    /// Reads lines up to the one with the resolution, and nothing after it.
    fn read(source: impl BufRead) -> Result<Self, String> {
        let mut source = source.take(MOST_HEADER);
        let mut line = || {
            let mut bytes = Vec::new();
            source.read_until(b'\n', &mut bytes).map_err(|e| e.to_string())?;
            match bytes.pop() {
                Some(b'\n') => Ok(String::from_utf8_lossy(&bytes).trim_end().to_owned()),
                _ => Err("its header ends too early".to_owned()),
            }
        };
        // Many programs write `#?RGBE` instead of `#?RADIANCE`.
        if !line()?.starts_with("#?") {
            return Err("it has no signature of a Radiance image".into());
        }
        let (mut exposure, mut primaries) = ([1.0; 3], None);
        loop {
            let line = line()?;
            if line.is_empty() {
                break;
            }
            let Some((name, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else { continue };
            match name.trim() {
                "EXPOSURE" => {
                    let [factor] = numbers(value, "exposure")?;
                    exposure = exposure.map(|e| e * factor);
                }
                "COLORCORR" => {
                    let factors = numbers::<3>(value, "colour correction")?;
                    exposure = std::array::from_fn(|k| exposure[k] * factors[k]);
                }
                "PRIMARIES" => {
                    let all = numbers::<8>(value, "primaries")?.map(f64::from);
                    primaries = Some(Primaries(std::array::from_fn(|k| [all[2 * k], all[2 * k + 1]])));
                }
                "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                    let format = value.trim();
                    return Err(format!("its pixels are stored as {format}; convert it to 32-bit_rle_rgbe"));
                }
                _ => {}
            }
        }
        let (order, (width, height)) = resolution(&line()?)?;
        Ok(Self { exposure, primaries, width, height, order })
    }
}

/// Reads a line like `-Y 512 +X 1024`: the axis that changes slowest comes first, +Y is up.
fn resolution(line: &str) -> Result<(PixelOrder, (usize, usize)), String> {
    let wrong = || format!("its resolution `{line}` cannot be read");
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, many, second, few] = words[..] else { return Err(wrong()) };
    let [many, few] = [many, few].map(|n| n.parse::<u32>().map(ToInt::to_usize));
    let (many, few) = (many.map_err(|_| wrong())?, few.map_err(|_| wrong())?);
    let from = |axis: &str| Some((axis == "-X", axis == "+Y")).filter(|_| ["-X", "+X", "-Y", "+Y"].contains(&axis));
    let ((right, below), (right_too, below_too)) = from(first).zip(from(second)).ok_or_else(wrong)?;
    let by_column = first.ends_with('X');
    if by_column == second.ends_with('X') {
        return Err(wrong());
    }
    let order = PixelOrder { by_column, from_right: right || right_too, from_below: below || below_too };
    Ok((order, if by_column { (many, few) } else { (few, many) }))
}

impl PixelOrder {
    /// Returns where the pixel of column `x` and row `y` is stored, as column and row of the stored image.
    fn place(self, x: usize, y: usize, (width, height): (usize, usize)) -> (usize, usize) {
        let x = if self.from_right { width - 1 - x } else { x };
        let y = if self.from_below { height - 1 - y } else { y };
        if self.by_column { (y, x) } else { (x, y) }
    }
}

/// Reads N finite numbers; those of an exposure or a colour correction must be above zero.
fn numbers<const N: usize>(text: &str, what: &str) -> Result<[f32; N], String> {
    let all: Result<Vec<f32>, _> = text.split_whitespace().map(str::parse).collect();
    let all = all.ok().and_then(|all| <[f32; N]>::try_from(all).ok());
    let all = all.filter(|all| all.iter().all(|v| v.is_finite())).ok_or_else(|| match N {
        1 => format!("its {what} is not a number"),
        n => format!("its {what} are not {n} numbers"),
    })?;
    if N < 8 && all.iter().any(|v| *v <= 0.0) {
        return Err(format!("its {what} is not above zero"));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_plain_pixels_are_the_same() {
        let head = |size: &str| format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n{size}\n").into_bytes();
        let mut plain = head("-Y 2 +X 4");
        plain.extend([[128, 64, 32, 129]; 8].concat());
        let texels = decode(&plain).unwrap();
        assert_eq!((texels.width, texels.height, texels.rgb[7]), (4, 2, [0.5, 0.25, 0.125]));

        let mut coded = head("-Y 4 +X 8");
        for _ in 0..4 {
            coded.extend([2, 2, 0, 8, 136, 128, 3, 64, 64, 64, 133, 64, 136, 32, 136, 129]);
        }
        let texels = decode(&coded).unwrap();
        assert!(texels.rgb.iter().all(|c| *c == [0.5, 0.25, 0.125]) && texels.rgb.len() == 32);
        // The exposure is not a power of two: its inverse and the product are rounded once each.
        let at = plain.windows(10).position(|w| w == b"EXPOSURE=2").unwrap() + 9;
        let mut thirds = plain.clone();
        thirds[at] = b'3';
        assert_eq!(decode(&thirds).unwrap().rgb[0], [128.0, 64.0, 32.0].map(|m: f32| m * (2.0_f32.powi(-7) / 3.0)));
        thirds[at] = b'0';
        assert!(decode(&thirds).is_err_and(|what| what.contains("exposure")));
        for broken in [&coded[..coded.len() - 1], &plain[..20], b"#?RADIANCE\n\n+Y 2 +Y 4\n"] {
            assert!(decode(broken).is_err());
        }
    }

    /// Expected: an image of four by two pixels, red 1 to 8 from the top left, is the same in all eight orders.
    #[test]
    fn all_orders_of_pixels_give_the_same_picture() {
        for (line, stored) in [
            ("-Y 2 +X 4", [1, 2, 3, 4, 5, 6, 7, 8]),
            ("-Y 2 -X 4", [4, 3, 2, 1, 8, 7, 6, 5]),
            ("+Y 2 +X 4", [5, 6, 7, 8, 1, 2, 3, 4]),
            ("+Y 2 -X 4", [8, 7, 6, 5, 4, 3, 2, 1]),
            ("+X 4 -Y 2", [1, 5, 2, 6, 3, 7, 4, 8]),
            ("-X 4 -Y 2", [4, 8, 3, 7, 2, 6, 1, 5]),
            ("+X 4 +Y 2", [5, 1, 6, 2, 7, 3, 8, 4]),
            ("-X 4 +Y 2", [8, 4, 7, 3, 6, 2, 5, 1]),
        ] {
            let mut bytes = format!("#?RGBE\n\n{line}\n").into_bytes();
            bytes.extend(stored.iter().flat_map(|red| [16 * red, 0, 0, 132]));
            let texels = decode(&bytes).unwrap();
            let red: Vec<f32> = texels.rgb.iter().map(|c| c[0]).collect();
            assert_eq!((texels.width, texels.height), (4, 2), "{line}");
            assert_eq!(red, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], "{line}");
            assert_eq!(size(&bytes[..]), Some((4, 2)));
        }
    }

    #[test]
    fn colour_corrections_are_undone_and_other_encodings_refused() {
        let with = |line: &str| {
            let mut bytes = format!("#?RADIANCE\n{line}\n\n-Y 1 +X 2\n").into_bytes();
            bytes.extend([[128, 128, 128, 129]; 2].concat());
            decode(&bytes).map(|texels| texels.rgb[0])
        };
        assert_eq!(with("COLORCORR= 1 2 4"), Ok([1.0, 0.5, 0.25]));
        assert_eq!(with("PRIMARIES= 0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329"), Ok([1.0; 3]));
        // Radiance's own primaries: white stays white.
        let white = with("PRIMARIES= 0.64 0.33 0.29 0.6 0.15 0.06 0.333 0.333").unwrap();
        assert!(white.iter().all(|c| (c - 1.0).abs() < 1e-5), "{white:?}");
        for (line, words) in [
            ("FORMAT=32-bit_rle_xyze", "stored as 32-bit_rle_xyze"),
            ("COLORCORR=1 2", "not 3 numbers"),
            ("COLORCORR=1 2 0", "not above zero"),
            ("EXPOSURE=bright", "exposure is not a number"),
        ] {
            assert!(with(line).is_err_and(|what| what.contains(words)), "{line}");
        }
    }
}
