//! Images of surfaces, as PNG files.

use super::image_choice::transmission_share;
use crate::png::{self, ImageData};
use furrow_base::Result;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{RoundTo, ToInt, Vec3};
use furrow_optics::texture::ColorSpace;
use furrow_render::material::swatch::{Dye, Swatch};

/// Colours shared by several surfaces.
pub(super) struct SharedColors<'a> {
    swatch: &'a Swatch<'a>,
    /// Component-wise maximum of the users' factors on reflected colours. The image is multiplied by it so that no
    /// material's factor exceeds one.
    lift: Vec3,
    /// The same for transmitted colours.
    lift_transmitted: Vec3,
    /// Largest reflectance, then largest transmittance.
    most: [Vec3; 2],
}

/// Factors of one surface on the colours that it shares.
pub(crate) struct Factors {
    /// Diffuse transmission factor f: reflected colours are divided by 1 − f, transmitted ones by f.
    pub(crate) share: f32,
    pub(crate) reflected: Vec3,
    pub(crate) transmitted: Vec3,
}

/// Colours of an image, ready to be combined with masks.
pub(super) struct Colors {
    size: (u32, u32),
    reflected: Vec<[u8; 3]>,
    /// Encoded PNG file of transmitted colours, if there are any.
    pub(super) transmitted: Option<Vec<u8>>,
}

impl<'a> SharedColors<'a> {
    /// Collects the images of a swatch, which has no users yet.
    pub(super) fn new(swatch: &'a Swatch<'a>) -> Self {
        Self { swatch, lift: Vec3::ZERO, lift_transmitted: Vec3::ZERO, most: most(swatch) }
    }

    /// Adds a user.
    pub(super) fn add_user(&mut self, dye: Dye) {
        let Factors { reflected, transmitted, .. } = self.unlifted(dye);
        self.lift = self.lift.max(reflected);
        self.lift_transmitted = self.lift_transmitted.max(transmitted);
    }

    /// Returns the factors of a user, at most one, after all users are known.
    pub(super) fn factors(&self, dye: Dye) -> Factors {
        let of = self.unlifted(dye);
        let over = |factor: Vec3, lift: Vec3| factor / lift.max(Vec3::splat(f32::MIN_POSITIVE));
        let limited = |factor: Vec3| factor.clamp(Vec3::ZERO, Vec3::ONE);
        if self.swatch.size.is_none() {
            return Factors { reflected: limited(of.reflected), transmitted: limited(of.transmitted), ..of };
        }
        Factors {
            reflected: limited(over(of.reflected, self.lift)),
            transmitted: limited(over(of.transmitted, self.lift_transmitted)),
            ..of
        }
    }

    /// Returns the factors of a user on the colours of the swatch; of a plain swatch, which has no image, its colours.
    fn unlifted(&self, dye: Dye) -> Factors {
        let [reflected, transmitted] = match self.swatch.size {
            Some(_) => [dye.tint, dye.tint_transmitted],
            None => [dye.mean.reflectance, dye.mean.transmittance].map(|s| s.0.truncate()),
        };
        let most = if self.swatch.size.is_some() { self.most } else { [Vec3::ONE; 2] };
        let share = transmission_share([reflected * most[0], transmitted * most[1]]);
        let transmitted = if share > 0.0 { transmitted / share } else { Vec3::ZERO };
        Factors { share, reflected: reflected / (1.0 - share), transmitted }
    }

    /// Computes the image; `None` for a plain colour.
    pub(super) fn draw(&self) -> Result<Option<Colors>> {
        let Some(size) = self.swatch.size else { return Ok(None) };
        let code = |v: Vec3| v.to_array().map(|c| ColorSpace::Srgb.encode(c));
        let (lift, lift_transmitted) = (self.lift, self.lift_transmitted);
        let colors = places(size).map(|(x, y)| {
            let tone = self.swatch.texel(x, y);
            (code(tone.reflectance.0.truncate() * lift), code(tone.transmittance.0.truncate() * lift_transmitted))
        });
        let (reflected, transmitted): (Vec<_>, Vec<_>) = colors.unzip();
        let encode = || png::encode(size.0, size.1, &ImageData::Rgb(&transmitted), "");
        let transmitted = (self.lift_transmitted != Vec3::ZERO).then(encode).transpose()?;
        Ok(Some(Colors { size, reflected, transmitted }))
    }
}

/// Encodes reflected colours as PNG, with `mask` as opacity. A plain colour with a mask is a white image; one without a
/// mask needs no image.
pub(super) fn reflected(colors: Option<&Colors>, mask: Option<&AlphaMask>) -> Result<Option<Vec<u8>>> {
    let white = Colors { size: (1, 1), reflected: vec![[255; 3]], transmitted: None };
    let Some(mask) = mask else {
        let encode = |of: &Colors| png::encode(of.size.0, of.size.1, &ImageData::Rgb(&of.reflected), "");
        return colors.map(encode).transpose();
    };
    let of = colors.unwrap_or(&white);
    // The mask's size is used if it differs from the image's; the image is then sampled by its nearest texels.
    let ((w, h), (cw, ch)) = (mask.size(), of.size);
    let columns: Vec<usize> = (0..w).map(|x| scaled(x, w, cw).to_usize()).collect();
    let mut pixels = Vec::with_capacity((w * h).to_usize());
    for y in 0..h {
        let row = &of.reflected[(scaled(y, h, ch) * cw).to_usize()..];
        let opacity = |x: usize| if mask.texel(x.to_i32(), y.to_i32()) { 255 } else { 0 };
        pixels.extend(columns.iter().enumerate().map(|(x, column)| {
            let [r, g, b] = row[*column];
            [r, g, b, opacity(x)]
        }));
    }
    let data = if ch < h { ImageData::EnlargedRgba(&pixels) } else { ImageData::Rgba(&pixels) };
    png::encode(w, h, &data, "").map(Some)
}

/// Encodes the relief of a swatch as a normal map, with slopes times `strength`; `None` if it has no image.
pub(super) fn relief(swatch: &Swatch<'_>, strength: f32) -> Result<Option<Vec<u8>>> {
    let Some(size) = swatch.size else { return Ok(None) };
    let normal = |(x, y): (u32, u32)| {
        let slope = swatch.slope(x, y) * strength;
        let n = Vec3::new(-slope.x, -slope.y, 1.0).normalize();
        n.to_array().map(|c| ((0.5 * c + 0.5) * 255.0 + 0.5).trunc_to::<u8>())
    };
    png::encode(size.0, size.1, &ImageData::Linear(&places(size).map(normal).collect::<Vec<_>>()), "").map(Some)
}

/// Returns the texels of an image, row by row from the top.
fn places((w, h): (u32, u32)) -> impl Iterator<Item = (u32, u32)> {
    (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
}

/// Returns the largest reflectance and transmittance of a swatch in R, G, B, over every fourth texel in both
/// directions.
fn most(swatch: &Swatch<'_>) -> [Vec3; 2] {
    let (w, h) = swatch.size.unwrap_or((1, 1));
    let some = (0..h).step_by(4).flat_map(|y| (0..w).step_by(4).map(move |x| (x, y)));
    some.map(|(x, y)| swatch.texel(x, y)).fold([Vec3::ZERO; 2], |most, tone| {
        let of = [tone.reflectance, tone.transmittance].map(|s| s.0.truncate());
        [most[0].max(of[0]), most[1].max(of[1])]
    })
}

/// Returns the texel of a row of `to` texels at the position of texel `i` of `from`.
fn scaled(i: u32, from: u32, to: u32) -> u32 {
    if from == to { i } else { ((u64::from(i) * 2 + 1) * u64::from(to) / (u64::from(from) * 2)).to_u32() }
}
