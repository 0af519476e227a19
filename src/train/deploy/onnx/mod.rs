//! A network as an ONNX file: what ONNX Runtime and other programs run without libtorch and without us.
//!
//! Source: the ONNX specification 1.12, operators of version 17. Input `image`: 8-bit numbers, images × height × width × bands.
//! Outputs `scores`: images × classes × height × width, the highest is the prediction; `classes`: its number, 8 bit, images × height ×
//! width. Whoever runs it chooses the number of images, height and width; SegNet takes 32 pixels at least, Basic SegNet 16. The metadata hold `network`, `bands`, `classes` (JSON lists), `width`, `height` (what the network learnt at),
//! `weights_sha256` and `version`.
//!
//! SegNets unpool with `MaxUnpool`, which ONNX Runtime has on CPUs but not every runtime has: the U-Net runs on more of them.
//!
//! By hand over `prost`: ONNX crates bring a runtime or the whole format, of which the networks need a few messages.

mod graph;
pub mod proto;

use crate::output::write_atomically;
use crate::train::data::Band;
use crate::train::deploy::Facts;
use crate::train::net::fitting;
use crate::train::run::TrainedModel;
use crate::{Error, Result};
use graph::Recorder;
use prost::Message;
use proto::{
    DataType, Dimension, DimensionValue, Entry, Model, OperatorSet, Shape, TensorType, Type, TypeValue, ValueInfo,
};
use std::path::Path;

/// Version of the operators: the first with `Shape` from axis to axis and the last with axes as attributes of `ReduceMean`.
const OPERATORS: i64 = 17;
/// Version of the format that belongs to it.
const FORMAT: i64 = 8;

/// The network as an ONNX file's message.
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
    let known = |n: usize| DimensionValue::Value(n as i64);
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
            "one score a class and pixel; the highest is the prediction",
            DataType::Float,
            [any("images"), known(classes), any("height"), any("width")],
        ),
        value("classes", "number of each pixel's class", DataType::Uint8, [any("images"), any("height"), any("width")]),
    ];
    let facts = serde_json::to_value(Facts::of(card, (card.input.width, card.input.height)));
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
            "{} Bring pictures to {} x {} pixels (antialiased), leave their values as they are: normalisation is part of the graph.",
            card.network.about(),
            card.input.width,
            card.input.height
        ),
        graph: Some(graph),
        opset_import: vec![OperatorSet { domain: String::new(), version: OPERATORS }],
        metadata_props: words.collect(),
    })
}

/// Writes the network as an ONNX file, atomically; equal networks give equal bytes.
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
