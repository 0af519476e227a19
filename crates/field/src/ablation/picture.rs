//! Edits of the camera, the sensor and the image.

use furrow_base::math::{RoundTo, Spectrum};
use furrow_optics::sensor::{Camera, MatrixDesc, MosaicDesc, Motion, Photograph, PsfDesc, SensorDesc};
use furrow_render::film::{Filter, Footprint};

/// Makes the camera a pinhole with a box filter.
pub(super) fn sharp(camera: &mut Camera, filter: &mut Footprint) {
    *camera = camera.with_aperture(None);
    *filter = Filter::Box.footprint();
}

/// Replaces the near-infrared image by the grey of the colour image, as if a camera without near infrared fed a four-band network.
pub(super) fn gray_nir(photograph: &mut Photograph) {
    let gray = |rgb: [f32; 3]| Spectrum::new(rgb[0], rgb[1], rgb[2], 0.0).luminance().round();
    let pixels = photograph.rgb.as_chunks::<3>().0.iter();
    photograph.nir = pixels.map(|rgb| gray(rgb.map(f32::from)).trunc_to::<u8>()).collect();
    if let Some(deep) = &mut photograph.deep {
        deep.nir = deep.rgb.as_chunks::<3>().0.iter().map(|rgb| gray(rgb.map(f32::from)).trunc_to::<u16>()).collect();
    }
}

/// Sets the exposure time for motion blur to zero.
pub(super) fn frozen(camera: &mut Camera, _: &mut Footprint) {
    *camera = camera.with_motion(Motion { exposure: 0.0, ..*camera.motion() });
}

/// Removes colour mosaic and colour matrix: every pixel measures all colours, with the raw response of the filters.
pub(super) fn all_colors(sensor: &mut SensorDesc) {
    (sensor.mosaic, sensor.matrix) = (MosaicDesc::Off, MatrixDesc::Off);
}

/// Removes the point spread function of the optics.
pub(super) fn no_spread(sensor: &mut SensorDesc) {
    sensor.psf = PsfDesc::default();
}
