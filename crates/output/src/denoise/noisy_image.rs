//! Input of one denoising step: an image and its guides.

use furrow_base::math::ToInt;

/// Red, green and blue, or the three components of a normal.
pub(super) type Rgb = [f32; 3];

/// Noisy image, row by row from the top. All its layers have `size` pixels.
pub(super) struct NoisyImage<'a> {
    /// Width and height.
    pub(super) size: [u32; 2],
    pub(super) noisy: &'a [Rgb],
    pub(super) kind: Kind<'a>,
}

/// Kind of image.
#[derive(Clone, Copy)]
pub(super) enum Kind<'a> {
    /// Albedo of the first surfaces, 0 to 1.
    Albedo,
    /// Normals of the first surfaces, −1 to 1.
    Normal,
    /// Unbounded radiance, with guides that are already denoised.
    Radiance { albedo: &'a [Rgb], normal: &'a [Rgb] },
}

impl NoisyImage<'_> {
    /// Returns the number of pixels.
    ///
    /// # Panics
    /// Panics if a layer has another number of pixels.
    pub(super) fn pixels(&self) -> usize {
        let count = self.size[0].to_usize() * self.size[1].to_usize();
        let whole = |image: &[Rgb]| assert_eq!(image.len(), count, "a picture of {:?} pixels", self.size);
        whole(self.noisy);
        if let Kind::Radiance { albedo, normal } = self.kind {
            whole(albedo);
            whole(normal);
        }
        count
    }
}
