//! EXR files as maps from channel name to values.

use exr::prelude::*;
use std::collections::BTreeMap;
use std::path::Path as File;

/// Reads every channel as single precision, and the comment of the header.
pub fn read_layers(path: &File) -> (BTreeMap<String, Vec<f32>>, String) {
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = image.from_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).layer_data;
    let comment = layer.attributes.comments.as_ref().map(ToString::to_string).unwrap_or_default();
    let channels = layer.channel_data.list.into_iter().map(|c| {
        let values = match c.sample_data {
            FlatSamples::U32(v) => v.into_iter().map(|v| v as f32).collect(),
            FlatSamples::F32(v) => v,
            FlatSamples::F16(v) => v.into_iter().map(f16::to_f32).collect(),
        };
        (c.name.to_string(), values)
    });
    (channels.collect(), comment)
}

/// Writes channels as f32, or as f16 where `half` returns true for the channel's name.
pub fn write_layers(path: &File, size: (u32, u32), channels: &BTreeMap<String, Vec<f32>>, half: impl Fn(&str) -> bool) {
    let list = channels.iter().map(|(name, values)| {
        let samples = if half(name) {
            FlatSamples::F16(values.iter().map(|v| f16::from_f32(*v)).collect())
        } else {
            FlatSamples::F32(values.clone())
        };
        AnyChannel::new(name.as_str(), samples)
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: exr::prelude::attribute::LineOrder::Increasing,
    };
    let layer = Layer::new(
        (size.0 as usize, size.1 as usize),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(list.collect()),
    );
    Image::from_layer(layer).write().to_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}
