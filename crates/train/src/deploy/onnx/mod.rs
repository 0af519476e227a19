//! Export of a network as an ONNX file, which ONNX Runtime and other programs run without libtorch and without this program.
//!
//! Source: the ONNX specification 1.12, operator set 17. The input `image` is images × height × width × bands, unsigned 8-bit.
//! There are two outputs: `scores`, images × classes × height × width, whose maximum over the classes is the prediction; and
//! `classes`, the number of that class, images × height × width, unsigned 8-bit. The number of images, height and width are free at
//! run time; SegNet needs at least 32 pixels a side, Basic SegNet 16.
//!
//! The metadata are `network`, `bands` and `classes` (JSON lists), `width` and `height` (the training size), `weights_sha256` and
//! `version`.
//!
//! The SegNets use `MaxUnpool`, which ONNX Runtime implements on CPUs but some runtimes lack: the U-Net runs on more of them.
//!
//! The messages are written by hand with `prost`: ONNX crates bring a runtime or the whole format, and the networks need a few
//! messages of it.

mod graph;
pub mod proto;

use crate::data::Band;
use crate::deploy::ExportMetadata;
use crate::net::fitting;
use crate::run::TrainedModel;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::write_atomically;
use graph::Recorder;
use prost::Message;
use proto::{
    DataType, Dimension, DimensionValue, Entry, Model, OperatorSet, Shape, TensorType, Type, TypeValue, ValueInfo,
};
use std::path::Path;

/// Operator set version: has `Shape` with `start` and `end` (since 15) and still has `axes` as an attribute of `ReduceMean` (until 17).
const OPERATORS: i64 = 17;
/// IR version of the ONNX release that introduced [`OPERATORS`].
const FORMAT: i64 = 8;

/// Builds the ONNX message of a trained network.
pub fn model(trained: &TrainedModel) -> Result<Model> {
    let card = &trained.card;
    let (bands, classes) = (card.input.bands.len(), card.classes.len());
    let mut recorder = Recorder::default();
    recorder.weights(fitting(card.network, bands, classes, &trained.values)?);
    let x = recorder.normalise("image", &card.normalization);
    let y = card.network.walk(&mut recorder, &x, bands, classes);
    recorder.end(&y);
    let mut graph = recorder.graph;
    let any = |name: &str| DimensionValue::Param(name.into());
    let known = |n: usize| DimensionValue::Value(n.to_i64());
    let names: Vec<&str> = card.input.bands.iter().map(Band::name).collect();
    graph.name = card.network.name().into();
    graph.input = vec![value(
        "image",
        &format!("8-bit pixels, bands {} in this order", names.join(", ")),
        DataType::Uint8,
        [any("images"), any("height"), any("width"), known(bands)],
    )];
    graph.output = vec![
        value(
            "scores",
            "one score per class and pixel; the highest is the prediction",
            DataType::Float,
            [any("images"), known(classes), any("height"), any("width")],
        ),
        value("classes", "number of each pixel's class", DataType::Uint8, [any("images"), any("height"), any("width")]),
    ];
    let facts = serde_json::to_value(ExportMetadata::of(card, (card.input.width, card.input.height)));
    let facts = facts.map_err(|e| Error::failed(format!("cannot write JSON: {e}")))?;
    let words = facts.as_object().into_iter().flatten().map(|(key, value)| Entry {
        key: key.clone(),
        value: value.as_str().map_or_else(|| value.to_string(), str::to_owned),
    });
    Ok(Model {
        ir_version: FORMAT,
        producer_name: "furrow".into(),
        producer_version: env!("CARGO_PKG_VERSION").into(),
        doc_string: format!(
            "{} Resize images to {} x {} pixels (antialiased) and do not normalize them: normalization is part of the graph.",
            card.network.about(),
            card.input.width,
            card.input.height
        ),
        graph: Some(graph),
        opset_import: vec![OperatorSet { domain: String::new(), version: OPERATORS }],
        metadata_props: words.collect(),
    })
}

/// Writes the network as an ONNX file, atomically. Equal networks give byte-identical files.
pub fn write(trained: &TrainedModel, path: &Path) -> Result<()> {
    write_atomically(path, &model(trained)?.encode_to_vec())
}

fn value<const N: usize>(name: &str, about: &str, numbers: DataType, size: [DimensionValue; N]) -> ValueInfo {
    let dim = size.map(|value| Dimension { value: Some(value) }).into();
    let tensor = TensorType { elem_type: numbers.into(), shape: Some(Shape { dim }) };
    ValueInfo {
        name: name.into(),
        kind: Some(Type { value: Some(TypeValue::Tensor(tensor)) }),
        doc_string: about.into(),
    }
}
