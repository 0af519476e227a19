//! Materials as `UsdPreviewSurface`, with images and near infrared.
//!
//! The diffuse colour is the reflectance. The surface has no transmission, so transmitted colours are attributes of the
//! material, which no program reads by itself: `furrow:transmittance:file` times `furrow:transmittance:scale`.

use super::text::{Text, number, quoted, tuple};
use crate::appearance::{EncodedImage, Surface};
use furrow_base::math::Vec3;

/// Path of the materials in the stage.
const SCOPE: &str = "/field/materials";

/// Returns the path of a material in the stage.
pub(super) fn path(number: usize) -> String {
    format!("<{SCOPE}/material_{number}>")
}

/// Returns the path of an image in the folder of the export.
pub(super) fn file(index: usize, image: &EncodedImage) -> String {
    format!("textures/{}_{index}.png", image.content)
}

/// Returns all materials, in the scope `materials`.
pub(super) fn scope(surfaces: &[Surface], images: &[EncodedImage]) -> Text {
    let mut text = Text::at(1);
    text.open("Scope", "materials", &[]);
    for (number, surface) in surfaces.iter().enumerate() {
        Writer { surface, images, path: format!("{SCOPE}/material_{number}") }.write(number, &mut text);
    }
    text.close();
    text
}

/// Returns the reflectance of a surface, or the factor on its image.
fn reflectance(surface: &Surface) -> Vec3 {
    // Images and factors are made for reflectance divided by 1 − f; see `Factors`.
    surface.factors.reflected * (1.0 - surface.factors.share)
}

/// Writes one material.
struct Writer<'a> {
    surface: &'a Surface,
    images: &'a [EncodedImage],
    path: String,
}

impl Writer<'_> {
    fn write(&self, number: usize, text: &mut Text) {
        let images = self.surface.images;
        text.open("Material", &format!("material_{number}"), &[]);
        self.infrared(text);
        if self.surface.factors.share > 0.0 {
            self.transmittance(text);
        }
        text.set("token outputs:surface.connect", self.output("surface", "surface"));
        self.shader(text);
        if images.reflected.is_some() || images.relief.is_some() {
            text.open("Shader", "st", &[]);
            text.set("uniform token info:id", quoted("UsdPrimvarReader_float2"));
            text.set("string inputs:varname", quoted("st"));
            text.line("float2 outputs:result");
            text.close();
        }
        if let Some(index) = images.reflected {
            let [r, g, b] = reflectance(self.surface).to_array();
            self.texture("color", index, "sRGB", &[("scale", [r, g, b, 1.0])], text);
        }
        // Blender 5.0.1 reads the opacity of an image with a scale as its scaled colour.
        if let Some(index) = images.reflected.filter(|_| self.surface.masked) {
            self.texture("opacity", index, "sRGB", &[], text);
        }
        if let Some(index) = images.relief {
            let code = [("scale", [2.0, 2.0, 2.0, 1.0]), ("bias", [-1.0, -1.0, -1.0, 0.0])];
            self.texture("relief", index, "raw", &code, text);
        }
        text.close();
    }

    fn infrared(&self, text: &mut Text) {
        let mean = self.surface.mean;
        text.set("custom float furrow:nirReflectance", number(mean.reflectance.0.w));
        text.set("custom float furrow:nirTransmittance", number(mean.transmittance.0.w));
    }

    fn transmittance(&self, text: &mut Text) {
        let factors = &self.surface.factors;
        if let Some(index) = self.surface.images.transmitted {
            text.set("custom asset furrow:transmittance:file", self.asset(index));
        }
        let scale = factors.transmitted * factors.share;
        text.set("custom color3f furrow:transmittance:scale", tuple(&scale.to_array()));
    }

    fn shader(&self, text: &mut Text) {
        let surface = self.surface;
        text.open("Shader", "surface", &[]);
        text.set("uniform token info:id", quoted("UsdPreviewSurface"));
        match surface.images.reflected {
            Some(_) => text.set("color3f inputs:diffuseColor.connect", self.output("color", "rgb")),
            None => text.set("color3f inputs:diffuseColor", tuple(&reflectance(surface).to_array())),
        }
        text.set("float inputs:metallic", 0);
        if surface.images.relief.is_some() {
            text.set("normal3f inputs:normal.connect", self.output("relief", "rgb"));
        }
        if surface.masked {
            text.set("float inputs:opacity.connect", self.output("opacity", "a"));
            text.set("float inputs:opacityThreshold", 0.5);
        }
        // USD's roughness is the square root of α.
        text.set("float inputs:roughness", number(surface.roughness.sqrt()));
        text.line("token outputs:surface");
        text.close();
    }

    fn texture(&self, name: &str, index: usize, space: &str, values: &[(&str, [f32; 4])], text: &mut Text) {
        text.open("Shader", name, &[]);
        text.set("uniform token info:id", quoted("UsdUVTexture"));
        text.set("asset inputs:file", self.asset(index));
        text.set("token inputs:sourceColorSpace", quoted(space));
        text.set("float2 inputs:st.connect", self.output("st", "result"));
        text.set("token inputs:wrapS", quoted("clamp"));
        text.set("token inputs:wrapT", quoted("clamp"));
        for (name, value) in values {
            text.set(&format!("float4 inputs:{name}"), tuple(value));
        }
        text.line("float3 outputs:rgb");
        text.line("float outputs:a");
        text.close();
    }

    fn output(&self, shader: &str, output: &str) -> String {
        format!("<{}/{shader}.outputs:{output}>", self.path)
    }

    fn asset(&self, index: usize) -> String {
        format!("@./{}@", file(index, &self.images[index]))
    }
}
