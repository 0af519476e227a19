//! Radiance images (.hdr): three mantissas and one exponent per pixel, L = m · 2^(e − 136), divided by the exposure in
//! the header.
//!
//! Source: Ward 1991, "Real Pixels", Graphics Gems II. The decoder of the crate `image` ignores the exposure, so it is
//! checked and applied here.

use super::texels::{Texels, check};
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};

/// Decodes a whole file. The error is a message.
pub(super) fn decode(bytes: &[u8]) -> Result<Texels, String> {
    // Not strict, because many programs write the signature `#?RGBE`.
    let decoder = HdrDecoder::new_nonstrict(bytes).map_err(|e| e.to_string())?;
    let exposure = exposure(&decoder.metadata().custom_attributes)?;
    let (width, height) = decoder.dimensions();
    check(width as usize, height as usize)?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    let rgb = image.into_rgb32f().pixels().map(|pixel| pixel.0.map(|value| value * (1.0 / exposure))).collect();
    Ok(Texels { width: width as usize, height: height as usize, rgb, nir: None })
}

/// Returns the product of all exposures in a file's header; 1 if there is none.
fn exposure(attributes: &[(String, String)]) -> Result<f32, String> {
    let mut product = 1.0;
    for (_, value) in attributes.iter().filter(|(name, _)| name == "EXPOSURE") {
        let factor: f32 = value.trim().parse().map_err(|_| "its exposure is not a number")?;
        if !(factor > 0.0 && factor.is_finite()) {
            return Err("its exposure is not above zero".into());
        }
        product *= factor;
    }
    Ok(product)
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
        for broken in [&coded[..coded.len() - 1], &plain[..20], b"#?RADIANCE\n\n+Y 2 +X 4\n"] {
            assert!(decode(broken).is_err());
        }
    }
}
