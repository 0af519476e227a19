//! Edits of the camera and of what it took.

use crate::film::{Filter, Footprint};
use crate::math::Spectrum;
use crate::sensor::{Camera, MatrixDesc, MosaicDesc, Motion, Photograph, PsfDesc, SensorDesc};

/// A pinhole whose pixels gather light over their own square.
pub(super) fn sharp(camera: &mut Camera, filter: &mut Footprint) {
    *camera = camera.with_aperture(None);
    *filter = Filter::Box.footprint();
}

/// Puts the grey of the colour image in the place of the near infrared one: what a trainer of four bands sees of a camera of three.
pub(super) fn gray_nir(photograph: &mut Photograph) {
    let gray = |rgb: [f32; 3]| Spectrum::new(rgb[0], rgb[1], rgb[2], 0.0).luminance().round();
    let pixels = photograph.rgb.as_chunks::<3>().0.iter();
    photograph.nir = pixels.map(|rgb| gray(rgb.map(f32::from)) as u8).collect();
    if let Some(deep) = &mut photograph.deep {
        deep.nir = deep.rgb.as_chunks::<3>().0.iter().map(|rgb| gray(rgb.map(f32::from)) as u16).collect();
    }
}

/// A shutter that opens for no time.
pub(super) fn frozen(camera: &mut Camera, _: &mut Footprint) {
    *camera = camera.with_motion(Motion { exposure: 0.0, ..*camera.motion() });
}

/// Every pixel sees all colours, as the filters have them.
pub(super) fn all_colors(sensor: &mut SensorDesc) {
    (sensor.mosaic, sensor.matrix) = (MosaicDesc::Off, MatrixDesc::Off);
}

/// Optics that blur nothing.
pub(super) fn no_spread(sensor: &mut SensorDesc) {
    sensor.psf = PsfDesc::default();
}
