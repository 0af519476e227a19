//! Conversion of surfaces to glTF materials, textures and images.

use super::pack::Pack;
use crate::appearance::{Appearance, EncodedImage, Surface};
use furrow_grow::model::document::{
    CLAMP_TO_EDGE, DIFFUSE_TRANSMISSION, DiffuseTransmission, Document, Image, LINEAR, LINEAR_MIPMAP_LINEAR, Material,
    NEAREST, NormalInfo, Pbr, Sampler, Texture, TextureInfo,
};
use serde_json::json;

/// Index of the glTF sampler of images with a mask, which are not filtered, as in this renderer.
const UNFILTERED: usize = 0;
/// Index of the glTF sampler of other images.
const FILTERED: usize = 1;

/// Writes materials, textures, samplers and images. Texture and image have the same index.
pub(super) fn write(appearance: Appearance, document: &mut Document, pack: &mut Pack) {
    document.samplers = vec![sampler(NEAREST, NEAREST), sampler(LINEAR, LINEAR_MIPMAP_LINEAR)];
    for (index, EncodedImage { bytes, content, masked }) in appearance.images.into_iter().enumerate() {
        document.images.push(Image {
            name: Some(format!("{content} {index}")),
            mime_type: Some("image/png".into()),
            buffer_view: Some(pack.picture(bytes)),
            uri: None,
        });
        let sampler = Some(if masked { UNFILTERED } else { FILTERED });
        document.textures.push(Texture { sampler, source: Some(index), ..Texture::default() });
    }
    document.materials = appearance.surfaces.iter().enumerate().map(material).collect();
}

fn sampler(near: u32, far: u32) -> Sampler {
    let edge = Some(CLAMP_TO_EDGE);
    Sampler { mag_filter: Some(near), min_filter: Some(far), wrap_s: edge, wrap_t: edge }
}

fn material((number, surface): (usize, &Surface)) -> Material {
    let [reflected, transmitted] = [surface.images.reflected, surface.images.transmitted]
        .map(|t| t.map(|index| TextureInfo { index, ..TextureInfo::default() }));
    let factors = &surface.factors;
    let [r, g, b] = factors.reflected.to_array();
    let mean = surface.mean;
    let mut material = Material {
        name: Some(format!("material {number}")),
        pbr_metallic_roughness: Pbr {
            base_color_factor: Some([r, g, b, 1.0]),
            base_color_texture: reflected,
            metallic_factor: Some(0.0),
            // glTF's roughness is the square root of α.
            roughness_factor: Some(surface.roughness.sqrt()),
            ..Pbr::default()
        },
        normal_texture: surface.images.relief.map(|index| NormalInfo {
            index,
            scale: Some(surface.relief),
            ..NormalInfo::default()
        }),
        double_sided: true,
        extras: json!({ "nir_reflectance": mean.reflectance.0.w, "nir_transmittance": mean.transmittance.0.w }),
        ..Material::default()
    };
    if surface.masked {
        material.alpha_mode = Some("MASK".into());
        material.alpha_cutoff = Some(0.5);
    }
    if factors.share > 0.0 {
        let of = DiffuseTransmission {
            diffuse_transmission_factor: factors.share,
            diffuse_transmission_color_factor: Some(factors.transmitted.to_array()),
            diffuse_transmission_color_texture: transmitted,
        };
        material.extensions.insert(DIFFUSE_TRANSMISSION.into(), json!(of));
    }
    material
}
