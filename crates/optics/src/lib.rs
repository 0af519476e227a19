//! Optics of Furrow: surface reflectance and transmittance, light sources and camera sensors.
//!
//! | module | contents |
//! |---|---|
//! | [`optics`] | pigments, leaf and soil reflectance, spectral bands |
//! | [`texture`] | images, height and normal maps, noise; synthesis of leaf and soil textures |
//! | [`bsdf`] | scattering functions in the local frame |
//! | [`light`] | sun, sky, environment maps, lamps |
//! | [`sensor`] | lens, sensor chip, image processing, LiDAR |

pub mod bsdf;
pub mod light;
pub mod optics;
pub mod sensor;
pub mod texture;
