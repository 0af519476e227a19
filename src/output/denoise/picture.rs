//! What is denoised at once: a picture, and what guides it.

/// Red, green and blue, or a normal's three components.
pub(super) type Rgb = [f32; 3];

/// A noisy picture, row by row from the top. All its images have `size` pixels.
pub(super) struct Picture<'a> {
    /// Columns and rows.
    pub(super) size: [u32; 2],
    pub(super) noisy: &'a [Rgb],
    pub(super) kind: Kind<'a>,
}

/// What a picture shows.
#[derive(Clone, Copy)]
pub(super) enum Kind<'a> {
    /// Albedo of the first surfaces, 0 to 1.
    Albedo,
    /// Normals of the first surfaces, −1 to 1.
    Normal,
    /// Radiance without bound, with guides that were denoised before.
    Radiance { albedo: &'a [Rgb], normal: &'a [Rgb] },
}

impl Picture<'_> {
    /// The number of its pixels.
    ///
    /// # Panics
    /// Where an image has another.
    pub(super) fn pixels(&self) -> usize {
        let count = self.size[0] as usize * self.size[1] as usize;
        let whole = |image: &[Rgb]| assert_eq!(image.len(), count, "a picture of {:?} pixels", self.size);
        whole(self.noisy);
        if let Kind::Radiance { albedo, normal } = self.kind {
            whole(albedo);
            whole(normal);
        }
        count
    }
}
