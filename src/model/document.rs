//! A glTF 2.0 document: the part of it that the program reads and writes.
//!
//! Source: Khronos glTF 2.0 specification, revision 2.0.1; `KHR_lights_punctual`, `KHR_texture_transform`,
//! `KHR_materials_diffuse_transmission`. Field names are the specification's; what is not listed here is skipped when read.
//! Every reference between objects is an index that may point nowhere until it is looked up.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Component type of 32-bit floating point numbers.
pub const FLOAT: u32 = 5126;
/// Component type of 32-bit indices.
pub const UNSIGNED_INT: u32 = 5125;
/// Component type of 16-bit indices.
pub const UNSIGNED_SHORT: u32 = 5123;
/// Component type of 8-bit indices.
pub const UNSIGNED_BYTE: u32 = 5121;
/// Purpose of a view that holds vertices.
pub const ARRAY_BUFFER: u32 = 34962;
/// Purpose of a view that holds indices.
pub const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Filter and wrapping codes of samplers.
pub const NEAREST: u32 = 9728;
/// Bilinear.
pub const LINEAR: u32 = 9729;
/// Bilinear between two levels.
pub const LINEAR_MIPMAP_LINEAR: u32 = 9987;
/// The nearest texel of the edge lies outside.
pub const CLAMP_TO_EDGE: u32 = 33071;
/// The image again lies outside.
pub const REPEAT: u32 = 10497;

/// Extension: sheets that let light through diffusely.
pub const DIFFUSE_TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
/// Extension: suns and lamps.
pub const LIGHTS: &str = "KHR_lights_punctual";
/// Extension: textures moved, turned and scaled.
pub const TEXTURE_TRANSFORM: &str = "KHR_texture_transform";

macro_rules! objects {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $ty:ty $(= $skip:literal)?,)* })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        pub struct $name {
            $($(#[$field_doc])* $(#[serde(skip_serializing_if = $skip)])? pub $field: $ty,)*
        }
    )*};
}

objects! {
    /// The root.
    Document {
        /// Version and origin.
        asset: Asset,
        /// Extensions that it uses.
        extensions_used: Vec<String> = "Vec::is_empty",
        /// Extensions that a reader must know.
        extensions_required: Vec<String> = "Vec::is_empty",
        /// Which scene to show.
        scene: Option<usize> = "Option::is_none",
        /// Scenes.
        scenes: Vec<Scene> = "Vec::is_empty",
        /// Nodes: a tree, or several.
        nodes: Vec<Node> = "Vec::is_empty",
        /// Cameras.
        cameras: Vec<Camera> = "Vec::is_empty",
        /// Meshes.
        meshes: Vec<Mesh> = "Vec::is_empty",
        /// Skins: joints that bend meshes.
        skins: Vec<Skin> = "Vec::is_empty",
        /// Materials.
        materials: Vec<Material> = "Vec::is_empty",
        /// Textures: an image and how it is read.
        textures: Vec<Texture> = "Vec::is_empty",
        /// Images.
        images: Vec<Image> = "Vec::is_empty",
        /// How textures are read.
        samplers: Vec<Sampler> = "Vec::is_empty",
        /// Arrays of numbers in views.
        accessors: Vec<Accessor> = "Vec::is_empty",
        /// Spans of buffers.
        buffer_views: Vec<BufferView> = "Vec::is_empty",
        /// Bytes.
        buffers: Vec<Buffer> = "Vec::is_empty",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// Version and origin.
    Asset {
        /// "2.0".
        version: String,
        /// The program that wrote it.
        generator: Option<String> = "Option::is_none",
        /// More about it.
        extras: Value = "Value::is_null",
    }
    /// Nodes that are shown together.
    Scene {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Roots of its trees.
        nodes: Vec<usize> = "Vec::is_empty",
    }
    /// A place.
    Node {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Its children.
        children: Vec<usize> = "Vec::is_empty",
        /// Its transformation by columns; instead of the three below.
        matrix: Option<[f64; 16]> = "Option::is_none",
        /// Moved by.
        translation: Option<[f64; 3]> = "Option::is_none",
        /// Turned by the quaternion x, y, z, w.
        rotation: Option<[f64; 4]> = "Option::is_none",
        /// Scaled by.
        scale: Option<[f64; 3]> = "Option::is_none",
        /// What stands there.
        mesh: Option<usize> = "Option::is_none",
        /// By what it is bent.
        skin: Option<usize> = "Option::is_none",
        /// Who looks from there.
        camera: Option<usize> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
        /// The program's own: the label.
        extras: Value = "Value::is_null",
    }
    /// Joints that bend meshes.
    Skin {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Accessor of the matrices that carry a mesh into the joints' frames.
        inverse_bind_matrices: Option<usize> = "Option::is_none",
        /// The joint above all others.
        skeleton: Option<usize> = "Option::is_none",
        /// Nodes that are joints.
        joints: Vec<usize>,
    }
    /// A camera.
    Camera {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// "perspective".
        #[serde(rename = "type")]
        kind: String,
        /// Its lens.
        perspective: Option<Perspective> = "Option::is_none",
        /// The program's own: all intrinsics.
        extras: Value = "Value::is_null",
    }
    /// A lens without distortion.
    Perspective {
        /// Width over height.
        aspect_ratio: f64,
        /// Angle of view from top to bottom, radians.
        yfov: f64,
        /// Nearest depth that is drawn, metres.
        znear: f64,
    }
    /// A mesh.
    Mesh {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Its pieces.
        primitives: Vec<Primitive>,
        /// The program's own: the label.
        extras: Value = "Value::is_null",
    }
    /// A piece of a mesh, of one material.
    Primitive {
        /// Accessors by what they hold.
        attributes: std::collections::BTreeMap<String, usize>,
        /// Accessor of its indices.
        indices: Option<usize> = "Option::is_none",
        /// Its material.
        material: Option<usize> = "Option::is_none",
        /// 4 or nothing for triangles, 5 for a strip, 6 for a fan.
        mode: Option<u32> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// A material.
    Material {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Colour and gloss.
        pbr_metallic_roughness: Pbr,
        /// Relief.
        normal_texture: Option<NormalInfo> = "Option::is_none",
        /// OPAQUE, MASK or BLEND.
        alpha_mode: Option<String> = "Option::is_none",
        /// Opacity from which a MASK is there; ½ unless given.
        alpha_cutoff: Option<f32> = "Option::is_none",
        /// Whether it is seen from behind.
        double_sided: bool,
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
        /// The program's own: the near infrared.
        extras: Value = "Value::is_null",
    }
    /// Colour and gloss.
    Pbr {
        /// Linear R, G, B and opacity; 1 unless given.
        base_color_factor: Option<[f32; 4]> = "Option::is_none",
        /// Times this picture, sRGB.
        base_color_texture: Option<TextureInfo> = "Option::is_none",
        /// 1 unless given.
        metallic_factor: Option<f32> = "Option::is_none",
        /// 1 unless given; GGX α is its square.
        roughness_factor: Option<f32> = "Option::is_none",
    }
    /// What lets light through.
    DiffuseTransmission {
        /// Share of the diffuse light that passes instead of returning.
        diffuse_transmission_factor: f32,
        /// Linear R, G, B of what passes; 1 unless given.
        diffuse_transmission_color_factor: Option<[f32; 3]> = "Option::is_none",
        /// Times this picture, sRGB.
        diffuse_transmission_color_texture: Option<TextureInfo> = "Option::is_none",
    }
    /// Which texture, by which coordinates.
    TextureInfo {
        /// The texture.
        index: usize,
        /// Number of the coordinates, TEXCOORD_n.
        tex_coord: usize = "is_zero",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// Which texture holds normals of the tangent frame.
    NormalInfo {
        /// The texture.
        index: usize,
        /// Number of the coordinates, TEXCOORD_n.
        tex_coord: usize = "is_zero",
        /// Factor on their x and y; 1 unless given.
        scale: Option<f32> = "Option::is_none",
    }
    /// `KHR_texture_transform`: uv → offset + rotation · scale · uv.
    TextureTransform {
        /// Moved by.
        offset: [f32; 2],
        /// Turned by, radians.
        rotation: f32,
        /// Scaled by; 1 unless given.
        scale: Option<[f32; 2]> = "Option::is_none",
        /// Instead of the info's coordinates.
        tex_coord: Option<usize> = "Option::is_none",
    }
    /// An image and how it is read.
    Texture {
        /// How it is read.
        sampler: Option<usize> = "Option::is_none",
        /// The image.
        source: Option<usize> = "Option::is_none",
    }
    /// An image.
    Image {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Its file or its bytes as text.
        uri: Option<String> = "Option::is_none",
        /// image/png or image/jpeg.
        mime_type: Option<String> = "Option::is_none",
        /// Its bytes.
        buffer_view: Option<usize> = "Option::is_none",
    }
    /// How a texture is read.
    Sampler {
        /// Near.
        mag_filter: Option<u32> = "Option::is_none",
        /// Far.
        min_filter: Option<u32> = "Option::is_none",
        /// Outside in u; REPEAT unless given.
        wrap_s: Option<u32> = "Option::is_none",
        /// Outside in v.
        wrap_t: Option<u32> = "Option::is_none",
    }
    /// An array of numbers.
    Accessor {
        /// Where it lies.
        buffer_view: Option<usize> = "Option::is_none",
        /// From this byte of the view.
        byte_offset: usize = "is_zero",
        /// What its components are.
        component_type: u32,
        /// Whether whole numbers stand for 0 to 1.
        normalized: bool = "is_false",
        /// Number of elements.
        count: usize,
        /// SCALAR, VEC2, VEC3, …
        #[serde(rename = "type")]
        kind: String,
        /// Smallest components.
        min: Option<Vec<f32>> = "Option::is_none",
        /// Largest components.
        max: Option<Vec<f32>> = "Option::is_none",
        /// Elements that differ from what lies in the view.
        sparse: Value = "Value::is_null",
    }
    /// A span of a buffer.
    BufferView {
        /// The buffer.
        buffer: usize,
        /// From this byte.
        byte_offset: usize = "is_zero",
        /// So many bytes.
        byte_length: usize,
        /// From element to element; packed unless given.
        byte_stride: Option<usize> = "Option::is_none",
        /// Vertices or indices.
        target: Option<u32> = "Option::is_none",
    }
    /// Bytes.
    Buffer {
        /// So many.
        byte_length: usize,
        /// Their file or themselves as text; the GLB's own unless given.
        uri: Option<String> = "Option::is_none",
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_false(b: &bool) -> bool {
    !b
}
