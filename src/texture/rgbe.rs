//! Radiance pictures (.hdr): three mantissas and one exponent a pixel, L = m · 2^(e − 136).
//!
//! Source: Ward 1991, "Real Pixels", Graphics Gems II; the run lengths are those of Radiance's `ray/src/common/color.c`.

use super::panorama::Texels;

/// Reads a whole file; in words what is wrong with it.
pub(super) fn decode(bytes: &[u8]) -> Result<Texels, String> {
    let mut rest = bytes;
    let mut line = || -> Result<String, String> {
        let end = rest.iter().position(|b| *b == b'\n').ok_or("its head has no end")?;
        let line = String::from_utf8_lossy(&rest[..end]).trim().to_owned();
        rest = &rest[end + 1..];
        Ok(line)
    };
    let mut exposure = 1.0_f32;
    loop {
        let line = line()?;
        if line.is_empty() {
            break;
        }
        if line.strip_prefix("FORMAT=").is_some_and(|format| format != "32-bit_rle_rgbe") {
            return Err("its pixels are not RGBE".into());
        }
        if let Some(factor) = line.strip_prefix("EXPOSURE=") {
            let factor: f32 = factor.trim().parse().map_err(|_| "its exposure is no number")?;
            if !(factor > 0.0 && factor.is_finite()) {
                return Err("its exposure is not above zero".into());
            }
            exposure *= factor;
        }
    }
    let size = line()?;
    let ["-Y", height, "+X", width] = size.split_whitespace().collect::<Vec<_>>()[..] else {
        return Err(format!("its rows do not run from the top left (`{size}`)"));
    };
    let number = |text: &str| text.parse::<usize>().map_err(|_| format!("`{text}` is no size"));
    let (width, height) = (number(width)?, number(height)?);
    super::panorama::check(width, height)?;
    let mut rgba = Vec::with_capacity(width * height);
    let mut row = vec![[0_u8; 4]; width];
    for _ in 0..height {
        read_row(&mut rest, &mut row).ok_or("it ends too early or its runs are broken")?;
        rgba.extend(row.iter().map(|[r, g, b, e]| {
            let unit = if *e == 0 { 0.0 } else { 2.0_f32.powi(i32::from(*e) - 136) / exposure };
            [*r, *g, *b].map(|m| f32::from(m) * unit)
        }));
    }
    Ok(Texels { width, height, rgb: rgba, nir: None })
}

/// One row; `None` where the bytes do not suffice.
fn read_row(rest: &mut &[u8], row: &mut [[u8; 4]]) -> Option<()> {
    let width = row.len();
    let coded =
        rest.len() >= 4 && rest[0] == 2 && rest[1] == 2 && usize::from(rest[2]) << 8 | usize::from(rest[3]) == width;
    if !coded || !(8..0x8000).contains(&width) {
        for pixel in row {
            *pixel = take(rest, 4)?.try_into().ok()?;
        }
        return Some(());
    }
    take(rest, 4)?;
    for channel in 0..4 {
        let mut at = 0;
        while at < width {
            let count = usize::from(take(rest, 1)?[0]);
            let (run, count) = if count > 128 { (true, count - 128) } else { (false, count) };
            let values = take(rest, if run { 1 } else { count })?;
            for k in 0..count {
                row.get_mut(at + k)?[channel] = values[if run { 0 } else { k }];
            }
            at += count.max(1);
        }
    }
    Some(())
}

fn take<'a>(rest: &mut &'a [u8], n: usize) -> Option<&'a [u8]> {
    let (taken, left) = rest.split_at_checked(n)?;
    *rest = left;
    Some(taken)
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
        for broken in [&coded[..coded.len() - 1], &plain[..20], b"#?RADIANCE\n\n+Y 2 +X 4\n"] {
            assert!(decode(broken).is_err());
        }
    }
}
