//! The subset of glTF 2.0 documents that the program reads and writes.
//!
//! Source: Khronos glTF 2.0 specification, revision 2.0.1; `KHR_lights_punctual`, `KHR_texture_transform`,
//! `KHR_materials_diffuse_transmission`. Field names are those of the specification; other fields are ignored when
//! reading. Every reference between objects is an unchecked index until it is looked up.

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
/// Target of a buffer view with vertices.
pub const ARRAY_BUFFER: u32 = 34962;
/// Target of a buffer view with indices.
pub const ELEMENT_ARRAY_BUFFER: u32 = 34963;
/// Sampler filter: nearest texel.
pub const NEAREST: u32 = 9728;
/// Sampler filter: bilinear.
pub const LINEAR: u32 = 9729;
/// Sampler filter: trilinear, between two mip levels.
pub const LINEAR_MIPMAP_LINEAR: u32 = 9987;
/// Wrapping mode: clamps to the edge.
pub const CLAMP_TO_EDGE: u32 = 33071;
/// Wrapping mode: repeats the image, every second time mirrored.
pub const MIRRORED_REPEAT: u32 = 33648;
/// Wrapping mode: repeats the image.
pub const REPEAT: u32 = 10497;

/// Extension: sheets with diffuse transmission.
pub const DIFFUSE_TRANSMISSION: &str = "KHR_materials_diffuse_transmission";
/// Extension: directional and punctual lights.
pub const LIGHTS: &str = "KHR_lights_punctual";
/// Extension: an older model of materials.
pub const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
/// Extension: thin or solid sheets that transmit light without scattering.
pub const TRANSMISSION: &str = "KHR_materials_transmission";
/// Extension: translated, rotated and scaled textures.
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
    /// Root object.
    Document {
        /// Version and origin.
        asset: Asset,
        /// Extensions used by the file.
        extensions_used: Vec<String> = "Vec::is_empty",
        /// Extensions that a reader must support.
        extensions_required: Vec<String> = "Vec::is_empty",
        /// Index of the default scene.
        scene: Option<usize> = "Option::is_none",
        /// Scenes.
        scenes: Vec<Scene> = "Vec::is_empty",
        /// Nodes: one or several trees.
        nodes: Vec<Node> = "Vec::is_empty",
        /// Cameras.
        cameras: Vec<Camera> = "Vec::is_empty",
        /// Meshes.
        meshes: Vec<Mesh> = "Vec::is_empty",
        /// Skins: joints that deform meshes.
        skins: Vec<Skin> = "Vec::is_empty",
        /// Animations, which are not read.
        animations: Vec<Value> = "Vec::is_empty",
        /// Materials.
        materials: Vec<Material> = "Vec::is_empty",
        /// Textures: an image and its sampler.
        textures: Vec<Texture> = "Vec::is_empty",
        /// Images.
        images: Vec<Image> = "Vec::is_empty",
        /// Samplers of textures.
        samplers: Vec<Sampler> = "Vec::is_empty",
        /// Arrays of numbers in buffer views.
        accessors: Vec<Accessor> = "Vec::is_empty",
        /// Byte ranges of buffers.
        buffer_views: Vec<BufferView> = "Vec::is_empty",
        /// Binary data.
        buffers: Vec<Buffer> = "Vec::is_empty",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// Version and origin.
    Asset {
        /// "2.0".
        version: String,
        /// Smallest version that a reader must support.
        min_version: Option<String> = "Option::is_none",
        /// Name of the program that wrote the file.
        generator: Option<String> = "Option::is_none",
        /// Application-specific data.
        extras: Value = "Value::is_null",
    }
    /// Scene: nodes that are rendered together.
    Scene {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Root nodes of its trees.
        nodes: Vec<usize> = "Vec::is_empty",
    }
    /// Node: a coordinate frame in the scene tree.
    Node {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Child nodes.
        children: Vec<usize> = "Vec::is_empty",
        /// Transformation matrix by columns, instead of translation, rotation and scale.
        matrix: Option<[f64; 16]> = "Option::is_none",
        /// Translation.
        translation: Option<[f64; 3]> = "Option::is_none",
        /// Rotation, a quaternion x, y, z, w.
        rotation: Option<[f64; 4]> = "Option::is_none",
        /// Scale.
        scale: Option<[f64; 3]> = "Option::is_none",
        /// Index of the mesh at this node.
        mesh: Option<usize> = "Option::is_none",
        /// Weights of the mesh's morph targets, overriding those of the mesh.
        weights: Option<Vec<f64>> = "Option::is_none",
        /// Index of the skin that deforms the mesh.
        skin: Option<usize> = "Option::is_none",
        /// Index of the camera at this node.
        camera: Option<usize> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
        /// Data of this program: the label.
        extras: Value = "Value::is_null",
    }
    /// Skin: joints that deform meshes.
    Skin {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Accessor of the matrices that transform a mesh into the joints' frames.
        inverse_bind_matrices: Option<usize> = "Option::is_none",
        /// Root joint.
        skeleton: Option<usize> = "Option::is_none",
        /// Nodes that are joints.
        joints: Vec<usize>,
    }
    /// A camera.
    Camera {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Type: "perspective".
        #[serde(rename = "type")]
        kind: String,
        /// Perspective projection.
        perspective: Option<Perspective> = "Option::is_none",
        /// Data of this program: all intrinsics.
        extras: Value = "Value::is_null",
    }
    /// Perspective projection without distortion.
    Perspective {
        /// Ratio of width to height.
        aspect_ratio: f64,
        /// Vertical field of view, radians.
        yfov: f64,
        /// Distance of the near plane, metres.
        znear: f64,
    }
    /// A mesh.
    Mesh {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Primitives.
        primitives: Vec<Primitive>,
        /// Weights of the morph targets.
        weights: Vec<f64> = "Vec::is_empty",
        /// Data of this program: the label.
        extras: Value = "Value::is_null",
    }
    /// Primitive: the part of a mesh with one material.
    Primitive {
        /// Accessors by attribute name.
        attributes: std::collections::BTreeMap<String, usize>,
        /// Accessor of the indices.
        indices: Option<usize> = "Option::is_none",
        /// Index of the material.
        material: Option<usize> = "Option::is_none",
        /// Morph targets: accessors of displacements by attribute name.
        targets: Vec<std::collections::BTreeMap<String, usize>> = "Vec::is_empty",
        /// Mode: 4 or absent for triangles, 5 for a strip, 6 for a fan.
        mode: Option<u32> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// A material.
    Material {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// Base colour, metalness and roughness.
        pbr_metallic_roughness: Pbr,
        /// Normal map.
        normal_texture: Option<NormalInfo> = "Option::is_none",
        /// Emitted light, linear R, G, B; default 0.
        emissive_factor: Option<[f32; 3]> = "Option::is_none",
        /// Alpha mode: OPAQUE, MASK or BLEND.
        alpha_mode: Option<String> = "Option::is_none",
        /// Alpha threshold of MASK; default ½.
        alpha_cutoff: Option<f32> = "Option::is_none",
        /// Whether back faces are visible.
        double_sided: bool,
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
        /// Data of this program: the near infrared.
        extras: Value = "Value::is_null",
    }
    /// Base colour, metalness and roughness.
    Pbr {
        /// Linear R, G, B and alpha; default 1.
        base_color_factor: Option<[f32; 4]> = "Option::is_none",
        /// Texture that multiplies it, sRGB.
        base_color_texture: Option<TextureInfo> = "Option::is_none",
        /// Metalness; default 1.
        metallic_factor: Option<f32> = "Option::is_none",
        /// Roughness; default 1. GGX α is its square.
        roughness_factor: Option<f32> = "Option::is_none",
        /// Texture that multiplies metalness and roughness.
        metallic_roughness_texture: Option<TextureInfo> = "Option::is_none",
    }
    /// `KHR_materials_pbrSpecularGlossiness`, which precedes the metallic-roughness extensions.
    SpecularGlossiness {
        /// Linear R, G, B and alpha; default 1.
        diffuse_factor: Option<[f32; 4]> = "Option::is_none",
        /// Texture that multiplies it, sRGB.
        diffuse_texture: Option<TextureInfo> = "Option::is_none",
        /// One minus the roughness; default 1.
        glossiness_factor: Option<f32> = "Option::is_none",
    }
    /// `KHR_materials_diffuse_transmission`.
    DiffuseTransmission {
        /// Fraction of the diffuse light that is transmitted instead of reflected.
        diffuse_transmission_factor: f32,
        /// Linear R, G, B of the transmitted light; default 1.
        diffuse_transmission_color_factor: Option<[f32; 3]> = "Option::is_none",
        /// Texture that multiplies it, sRGB.
        diffuse_transmission_color_texture: Option<TextureInfo> = "Option::is_none",
    }
    /// Reference to a texture and its coordinates.
    TextureInfo {
        /// Index of the texture.
        index: usize,
        /// Number n of the coordinates TEXCOORD_n.
        tex_coord: usize = "is_zero",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// Reference to a tangent-space normal map.
    NormalInfo {
        /// Index of the texture.
        index: usize,
        /// Number n of the coordinates TEXCOORD_n.
        tex_coord: usize = "is_zero",
        /// Factor on the normals' x and y; default 1.
        scale: Option<f32> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// `KHR_texture_transform`: uv → offset + rotation · scale · uv.
    TextureTransform {
        /// Offset.
        offset: [f32; 2],
        /// Rotation, radians.
        rotation: f32,
        /// Scale; default 1.
        scale: Option<[f32; 2]> = "Option::is_none",
        /// Number of the coordinates, overriding that of the texture reference.
        tex_coord: Option<usize> = "Option::is_none",
    }
    /// Texture: an image and its sampler.
    Texture {
        /// Index of the sampler.
        sampler: Option<usize> = "Option::is_none",
        /// Index of the image.
        source: Option<usize> = "Option::is_none",
        /// Data of extensions.
        extensions: Map<String, Value> = "Map::is_empty",
    }
    /// An image.
    Image {
        /// Its name.
        name: Option<String> = "Option::is_none",
        /// URI of its file, or its data as a data URI.
        uri: Option<String> = "Option::is_none",
        /// Media type: image/png or image/jpeg.
        mime_type: Option<String> = "Option::is_none",
        /// Index of the buffer view with its data.
        buffer_view: Option<usize> = "Option::is_none",
    }
    /// Sampler: filters and wrapping modes of a texture.
    Sampler {
        /// Magnification filter.
        mag_filter: Option<u32> = "Option::is_none",
        /// Minification filter.
        min_filter: Option<u32> = "Option::is_none",
        /// Wrapping mode in u; default REPEAT.
        wrap_s: Option<u32> = "Option::is_none",
        /// Wrapping mode in v; default REPEAT.
        wrap_t: Option<u32> = "Option::is_none",
    }
    /// Accessor: an array of numbers.
    Accessor {
        /// Index of the buffer view.
        buffer_view: Option<usize> = "Option::is_none",
        /// Offset in the buffer view, bytes.
        byte_offset: usize = "is_zero",
        /// Type of the components.
        component_type: u32,
        /// Whether integers are normalised to 0..1 (signed: −1..1).
        normalized: bool = "is_false",
        /// Number of elements.
        count: usize,
        /// Type of the elements: SCALAR, VEC2, VEC3, …
        #[serde(rename = "type")]
        kind: String,
        /// Minimum of each component.
        min: Option<Vec<f32>> = "Option::is_none",
        /// Maximum of each component.
        max: Option<Vec<f32>> = "Option::is_none",
        /// Sparse elements that override those in the buffer view.
        sparse: Option<Sparse> = "Option::is_none",
    }
    /// Elements that override others.
    Sparse {
        /// Number of elements.
        count: usize,
        /// Their indices.
        indices: SparseBytes,
        /// Their values, of the accessor's type.
        values: SparseBytes,
    }
    /// Tightly packed indices or values of sparse elements.
    SparseBytes {
        /// Index of the buffer view.
        buffer_view: usize,
        /// Offset in the buffer view, bytes.
        byte_offset: usize = "is_zero",
        /// Type of the indices.
        component_type: Option<u32> = "Option::is_none",
    }
    /// Byte range of a buffer.
    BufferView {
        /// Index of the buffer.
        buffer: usize,
        /// Offset in the buffer, bytes.
        byte_offset: usize = "is_zero",
        /// Length in bytes.
        byte_length: usize,
        /// Distance between elements, bytes; default: tightly packed.
        byte_stride: Option<usize> = "Option::is_none",
        /// Purpose: vertices or indices.
        target: Option<u32> = "Option::is_none",
    }
    /// Binary data.
    Buffer {
        /// Length in bytes.
        byte_length: usize,
        /// URI of its file, or its data as a data URI; default: the binary chunk of the GLB file.
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

/// Returns an item by its index; the error is a message.
pub(super) fn item<'a, T>(of: &'a [T], index: usize, what: &str) -> Result<&'a T, String> {
    of.get(index).ok_or_else(|| format!("{what} {index} is referenced, but there are {}", of.len()))
}
