//! Radiance and auxiliary channels in one OpenEXR file, written with the `exr` crate.
//!
//! Channels: `R G B NIR` (radiance, W·m⁻²·sr⁻¹·nm⁻¹, f32), `variance.*` (of that mean, f32), `albedo.*` and
//! `normal.{X,Y,Z}` (f16), `depth.Z` (metres along the ray, f32, infinite if nothing was hit), `id.class`, `id.plant`,
//! `id.leaf`, `id.part` (u32, from the label pass; part + 1, 0 for none). If pixels have different sample counts, `spp`
//! (u32). The header's comment contains the provenance. For compositing, `coverage.{soil,crop,weed}` and Cryptomattes
//! can be added.

mod cryptomatte;
mod order;

use exr::prelude::*;
use furrow_base::geometry::Window;
use furrow_base::math::{Spectrum, ToInt};
use furrow_base::{Error, Result};
use furrow_optics::texture::exr_size;
use furrow_render::film::Film;
use furrow_render::render::{self, LabelMap, label::NONE};
use furrow_render::scene::tag::{Class, Tag};
use std::path::Path;

/// Largest height of an image that is compressed by one thread.
const SMALL_ROWS: u32 = 128;

/// Channels of one layer.
type Channels = SmallVec<[AnyChannel<FlatSamples>; 4]>;

fn channel(name: &str, samples: FlatSamples) -> AnyChannel<FlatSamples> {
    AnyChannel { name: name.into(), sample_data: samples, quantize_linearly: false, sampling: Vec2(1, 1) }
}

/// Encodes raw numbers: one vector per channel, row by row from the top.
pub(super) fn encode_map(width: u32, height: u32, channels: &[(&str, Vec<f32>)]) -> Result<Vec<u8>> {
    let of = |(name, values): &(&str, Vec<f32>)| channel(name, FlatSamples::F32(values.clone()));
    write(Window::full(width, height), channels.iter().map(of).collect(), "")
}

/// Encodes a film and its labels, which must have the same window; `with_spp` adds each pixel's sample count.
pub(super) fn encode(film: &Film, labels: &LabelMap, with_spp: bool, text: &str) -> Result<Vec<u8>> {
    write(film.window, channels(film, labels, with_spp), text)
}

/// Encodes a film, its labels, the coverage of each class, and the Cryptomattes `CryptoClass`, `CryptoPlant` and
/// `CryptoLeaf`. `tags` holds the labels of each part.
pub fn encode_layers(film: &Film, labels: &LabelMap, tags: &[Tag], text: &str) -> Result<Vec<u8>> {
    let mut channels = channels(film, labels, false);
    let coverage = render::coverage(film, tags);
    for class in Class::ALL {
        let shares = coverage.iter().map(|c| c[class as usize]).collect();
        channels.push(channel(&format!("coverage.{}", class.name()), FlatSamples::F32(shares)));
    }
    let class_name = |tag: Tag| tag.class.name().to_owned();
    let names: [(&str, NameOf); 3] =
        [("CryptoClass", class_name), ("CryptoPlant", plant_name), ("CryptoLeaf", leaf_name)];
    let mut words = Vec::new();
    for (layer, name) in names {
        let names: Vec<String> = tags.iter().copied().map(name).collect();
        let matte = cryptomatte::matte(layer, film, &names);
        words.extend(matte.attributes());
        channels.extend(matte.channels.into_iter().map(|(name, values)| channel(&name, FlatSamples::F32(values))));
    }
    write_with(film.window, channels, text, words, Compression::ZIP16)
}

/// Function that names a part in a Cryptomatte.
type NameOf = fn(Tag) -> String;

/// Returns the name of a plant; parts without a plant are ground.
fn plant_name(tag: Tag) -> String {
    if tag.plant == 0 { "ground".into() } else { format!("plant_{}", tag.plant) }
}

/// Returns the name of a leaf or of the plant's other parts.
fn leaf_name(tag: Tag) -> String {
    match (tag.plant, tag.leaf) {
        (0, _) => plant_name(tag),
        (_, 0) => format!("{}/stem", plant_name(tag)),
        (_, leaf) => format!("{}/leaf_{leaf}", plant_name(tag)),
    }
}

/// Returns the channels that every file of a film and its labels has.
fn channels(film: &Film, labels: &LabelMap, with_spp: bool) -> Channels {
    let mut channels = SmallVec::new();
    let pixels = &film.pixels;
    for (band, name) in Spectrum::NAMES.iter().enumerate() {
        let of = |f: fn(&furrow_render::film::Pixel) -> Spectrum| pixels.iter().map(move |p| f(p).to_array()[band]);
        channels.push(channel(name, FlatSamples::F32(of(|p| p.mean).collect())));
        channels.push(channel(&format!("variance.{name}"), FlatSamples::F32(of(|p| p.variance).collect())));
        channels
            .push(channel(&format!("albedo.{name}"), FlatSamples::F16(of(|p| p.albedo).map(f16::from_f32).collect())));
    }
    for (axis, name) in ["X", "Y", "Z"].iter().enumerate() {
        let samples = pixels.iter().map(|p| f16::from_f32(p.normal.to_array()[axis])).collect();
        channels.push(channel(&format!("normal.{name}"), FlatSamples::F16(samples)));
    }
    channels.push(channel("depth.Z", FlatSamples::F32(pixels.iter().map(|p| p.depth).collect())));
    let ids = [
        ("class", labels.tags.iter().map(|t| t.class as u32).collect()),
        ("plant", labels.tags.iter().map(|t| t.plant).collect()),
        ("leaf", labels.tags.iter().map(|t| u32::from(t.leaf)).collect()),
        ("part", labels.parts.iter().map(|p| if *p == NONE { 0 } else { p + 1 }).collect::<Vec<u32>>()),
    ];
    for (name, samples) in ids {
        channels.push(channel(&format!("id.{name}"), FlatSamples::U32(samples)));
    }
    if with_spp {
        channels.push(channel("spp", FlatSamples::U32(pixels.iter().map(|p| p.samples).collect())));
    }
    channels
}

/// Encodes the radiance channels alone.
pub(super) fn encode_radiance(film: &Film, text: &str) -> Result<Vec<u8>> {
    let band = |i: usize| FlatSamples::F32(film.pixels.iter().map(|p| p.mean.to_array()[i]).collect());
    let channels = Spectrum::NAMES.iter().enumerate().map(|(i, name)| channel(name, band(i))).collect();
    write(film.window, channels, text)
}

/// Rounds a number to half precision.
pub fn half(x: f32) -> f32 {
    f16::from_f32(x).to_f32()
}

/// Precision of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Single,
}

/// Encodes values at the pixels' centres: `depth.Z` and `normal.X/Y/Z` (f16), each if it is not empty. `wavelets`
/// selects the compression PIZ, which is smaller than the default for data with few distinct values.
pub fn encode_geometry(
    width: u32,
    height: u32,
    (depth, precision): (&[f32], Precision),
    normals: &[[f32; 3]],
    wavelets: bool,
) -> Result<Vec<u8>> {
    let halves = |values: &mut dyn Iterator<Item = f32>| FlatSamples::F16(values.map(f16::from_f32).collect());
    let mut channels = SmallVec::new();
    if !depth.is_empty() {
        let values = match precision {
            Precision::Half => halves(&mut depth.iter().copied()),
            Precision::Single => FlatSamples::F32(depth.to_vec()),
        };
        channels.push(channel("depth.Z", values));
    }
    for (i, axis) in ["X", "Y", "Z"].iter().enumerate().filter(|_| !normals.is_empty()) {
        channels.push(channel(&format!("normal.{axis}"), halves(&mut normals.iter().map(|n| n[i]))));
    }
    let compression = if wavelets { Compression::PIZ } else { Compression::ZIP16 };
    write_with(Window::full(width, height), channels, "", Vec::new(), compression)
}

/// Encodes single-precision channels with distinct names.
pub fn encode_planes(width: u32, height: u32, planes: Vec<(String, Vec<f32>)>) -> Result<Vec<u8>> {
    let channels = planes.into_iter().map(|(name, values)| channel(&name, FlatSamples::F32(values))).collect();
    write(Window::full(width, height), channels, "")
}

/// Width, height, depths and normals; one of the last two may be empty.
pub type Geometry = (u32, u32, Vec<f32>, Vec<[f32; 3]>);

/// Reads a file written by [`encode_geometry`].
pub fn read_geometry(path: &Path) -> Result<Geometry> {
    decode_geometry(path, furrow_base::input::contents(path).map_err(Error::reading(path))?)
}

/// Decodes a file's bytes as [`read_geometry`] does; errors mention `path`.
pub fn decode_geometry(path: &Path, bytes: Vec<u8>) -> Result<Geometry> {
    let wrong = |what: String| Error::input(what).in_file(path);
    exr_size::check(&bytes).map_err(wrong)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_buffered(std::io::Cursor::new(bytes)).map_err(|e| wrong(e.to_string()))?;
    let layer = image.layer_data;
    let values = |name: &str| -> Result<Vec<f32>> {
        let found = layer.channel_data.list.iter().find(|c| c.name.eq_case_insensitive(name));
        let found = found.ok_or_else(|| wrong(format!("it has no channel {name}")))?;
        Ok(found.sample_data.values_as_f32().collect())
    };
    let has = |name: &str| layer.channel_data.list.iter().any(|c| c.name.eq_case_insensitive(name));
    let depth = if has("depth.Z") { values("depth.Z")? } else { Vec::new() };
    let mut normals = Vec::new();
    if depth.is_empty() || ["normal.X", "normal.Y", "normal.Z"].into_iter().any(has) {
        let (x, y, z) = (values("normal.X")?, values("normal.Y")?, values("normal.Z")?);
        normals = x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect();
    }
    Ok((layer.size.0.to_u32(), layer.size.1.to_u32(), depth, normals))
}

fn write(w: Window, channels: Channels, text: &str) -> Result<Vec<u8>> {
    write_with(w, channels, text, Vec::new(), Compression::ZIP16)
}

/// Encodes channels with additional header attributes, given as names and values.
fn write_with(
    w: Window,
    channels: Channels,
    text: &str,
    words: Vec<(String, String)>,
    compression: Compression,
) -> Result<Vec<u8>> {
    let failed = |e: &dyn std::fmt::Display| Error::failed(format!("cannot encode an EXR: {e}"));
    let mut attributes = LayerAttributes {
        layer_position: Vec2(w.x0.to_i32(), w.y0.to_i32()),
        comments: Text::new_or_none(text),
        ..LayerAttributes::default()
    };
    let with_words = !words.is_empty();
    for (name, value) in words {
        let pair = Text::new_or_none(&name).zip(Text::new_or_none(&value));
        let (name, value) = pair.ok_or_else(|| failed(&format!("{name} has characters that a header cannot store")))?;
        attributes.other.insert(name, exr::prelude::attribute::AttributeValue::Text(value));
    }
    // Rows in increasing order, independent of the thread that compressed them, so that equal runs write equal bytes.
    let encoding =
        Encoding { compression, blocks: Blocks::ScanLines, line_order: exr::prelude::attribute::LineOrder::Increasing };
    let size = Vec2(w.width().to_usize(), w.height().to_usize());
    let image = Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels)));
    let mut bytes = std::io::Cursor::new(Vec::new());
    // Threads are started for every file, which takes longer than to compress a small one.
    let writer = if w.height() <= SMALL_ROWS { image.write().non_parallel() } else { image.write() };
    writer.to_unbuffered(&mut bytes).map_err(|e| failed(&e))?;
    let bytes = bytes.into_inner();
    if with_words { order::sorted(bytes).ok_or_else(|| failed(&"its header is incomplete")) } else { Ok(bytes) }
}
