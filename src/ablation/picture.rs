//! Edits of the camera and of what it took.

use crate::film::{Filter, Footprint};
use crate::math::Spectrum;
use crate::sensor::{Camera, Photograph};

/// A pinhole whose pixels gather light over their own square.
pub(super) fn sharp(camera: &mut Camera, filter: &mut Footprint) {
    *camera = camera.with_aperture(None);
    *filter = Filter::Box.footprint();
}

/// Puts the grey of the colour image in the place of the near infrared one: what a trainer of four bands sees of a camera of three.
pub(super) fn gray_nir(photograph: &mut Photograph) {
    let gray = |rgb: &[u8; 3]| {
        let [r, g, b] = rgb.map(f32::from);
        Spectrum::new(r, g, b, 0.0).luminance().round() as u8
    };
    photograph.nir = photograph.rgb.as_chunks::<3>().0.iter().map(gray).collect();
}
