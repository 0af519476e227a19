//! A walk over a network that writes it down as an ONNX graph; see [`super`].

use super::proto::{Attribute, AttributeKind, DataType, Graph, Node, Tensor};
use crate::train::data::Normalization;
use crate::train::data::normalise::LEAST;
use crate::train::net::{Conv, Norm, Operations};
use crate::train::weights::Array;

/// A graph as far as it is written. Values are names; each operation's first result has its name.
#[derive(Default)]
pub(super) struct Recorder {
    pub(super) graph: Graph,
    /// How many operations have no name of the network's.
    unnamed: usize,
}

impl Recorder {
    /// One operation with one result, which is named.
    fn named(&mut self, name: &str, op: &str, inputs: &[&str], attributes: Vec<Attribute>) -> String {
        self.graph.node.push(Node {
            input: inputs.iter().map(ToString::to_string).collect(),
            output: vec![name.into()],
            name: name.into(),
            op_type: op.into(),
            attribute: attributes,
        });
        name.into()
    }

    /// The same under a name that is made up.
    fn op(&mut self, op: &str, inputs: &[&str], attributes: Vec<Attribute>) -> String {
        self.unnamed += 1;
        let name = format!("{}_{}", op.to_lowercase(), self.unnamed);
        self.named(&name, op, inputs, attributes)
    }

    /// A constant of single precision.
    fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        self.graph.initializer.push(Tensor {
            dims: shape.iter().map(|n| *n as i64).collect(),
            data_type: DataType::Float.into(),
            name: name.into(),
            raw_data: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        });
        name.into()
    }

    /// Trained weights as constants under their names.
    pub(super) fn weights<'a>(&mut self, arrays: impl IntoIterator<Item = &'a Array>) {
        for array in arrays {
            self.constant(&array.name, &array.shape, &array.values);
        }
    }

    /// From 8-bit pixels that lie as height × width × bands to what the network takes: values from 0 to 1, the mean taken out, by
    /// the deviation: √(mean of (x − mean)²), a step of 8 bits at least.
    pub(super) fn normalise(&mut self, image: &str, how: &Normalization) -> String {
        let x = self.op("Cast", &[image], vec![whole("to", DataType::Float as i64)]);
        let x = self.op("Transpose", &[&x], vec![several("perm", &[0, 3, 1, 2])]);
        let white = self.constant("white", &[], &[255.0]);
        let x = self.op("Div", &[&x, &white], vec![]);
        let axes: &[i64] = match how {
            Normalization::Fixed { mean, sd } => {
                let mean = self.constant("mean", &[1, mean.len(), 1, 1], mean);
                let sd = self.constant("deviation", &[1, sd.len(), 1, 1], sd);
                let less = self.op("Sub", &[&x, &mean], vec![]);
                return self.op("Div", &[&less, &sd], vec![]);
            }
            Normalization::Band => &[2, 3],
            Normalization::Image => &[1, 2, 3],
        };
        let over = || vec![several("axes", axes), whole("keepdims", 1)];
        let mean = self.op("ReduceMean", &[&x], over());
        let less = self.op("Sub", &[&x, &mean], vec![]);
        let squares = self.op("Mul", &[&less, &less], vec![]);
        let variance = self.op("ReduceMean", &[&squares], over());
        let sd = self.op("Sqrt", &[&variance], vec![]);
        let least = self.constant("least_deviation", &[], &[LEAST]);
        let sd = self.op("Max", &[&sd, &least], vec![]);
        self.op("Div", &[&less, &sd], vec![])
    }

    /// Names the network's values `scores`, and their highest `classes`.
    pub(super) fn end(&mut self, x: &str) {
        self.named("scores", "Identity", &[x], vec![]);
        let place = self.op("ArgMax", &["scores"], vec![whole("axis", 1), whole("keepdims", 0)]);
        self.named("classes", "Cast", &[&place], vec![whole("to", DataType::Uint8 as i64)]);
    }
}

impl Operations for Recorder {
    type Value = String;
    /// Places of the maxima, and the value before.
    type Places = (String, String);

    fn conv(&mut self, x: &String, name: &str, conv: Conv) -> String {
        let (weight, bias) = (format!("{name}.weight"), format!("{name}.bias"));
        let mut inputs = vec![x.as_str(), &weight];
        if conv.bias {
            inputs.push(&bias);
        }
        let (kernel, stride) = (conv.kernel as i64, conv.stride as i64);
        let (before, after) = (conv.padding().0 as i64, conv.padding().1 as i64);
        let attributes = vec![
            several("kernel_shape", &[kernel; 2]),
            several("strides", &[stride; 2]),
            several("pads", &[before, before, after, after]),
            whole("group", conv.groups as i64),
        ];
        self.named(name, "Conv", &inputs, attributes)
    }

    fn norm(&mut self, x: &String, name: &str, norm: Norm) -> String {
        let [gain, shift, mean, variance] =
            ["weight", "bias", "running_mean", "running_var"].map(|what| format!("{name}.{what}"));
        let epsilon = number("epsilon", norm.epsilon as f32);
        self.named(name, "BatchNormalization", &[x, &gain, &shift, &mean, &variance], vec![epsilon])
    }

    fn relu(&mut self, x: &String) -> String {
        self.op("Relu", &[x], vec![])
    }

    fn relu6(&mut self, x: &String) -> String {
        for (name, value) in [("zero", 0.0), ("six", 6.0)] {
            if self.graph.initializer.iter().all(|tensor| tensor.name != name) {
                self.constant(name, &[], &[value]);
            }
        }
        self.op("Clip", &[x, "zero", "six"], vec![])
    }

    fn add(&mut self, a: &String, b: &String) -> String {
        self.op("Add", &[a, b], vec![])
    }

    fn concat(&mut self, a: &String, b: &String) -> String {
        self.op("Concat", &[a, b], vec![whole("axis", 1)])
    }

    fn pool(&mut self, x: &String) -> (String, Self::Places) {
        let smaller = self.op("MaxPool", &[x], vec![several("kernel_shape", &[2, 2]), several("strides", &[2, 2])]);
        let places = format!("{smaller}.places");
        if let Some(node) = self.graph.node.last_mut() {
            node.output.push(places.clone());
        }
        (smaller, (places, x.clone()))
    }

    /// The size that is asked for is that of the value before the pooling, whatever it is when the graph runs.
    fn unpool(&mut self, x: &String, (places, before): Self::Places) -> String {
        let size = self.op("Shape", &[&before], vec![]);
        let attributes = vec![several("kernel_shape", &[2, 2]), several("strides", &[2, 2])];
        self.op("MaxUnpool", &[x, &places, &size], attributes)
    }

    fn pool3(&mut self, x: &String) -> String {
        let attributes =
            vec![several("kernel_shape", &[3, 3]), several("strides", &[2, 2]), several("pads", &[1, 1, 1, 1])];
        self.op("MaxPool", &[x], attributes)
    }

    /// Pixel i of n takes ⌊i · m / n⌋ of m, as `upsample_nearest2d` does.
    fn enlarge(&mut self, x: &String, like: &String) -> String {
        let channels = self.op("Shape", &[x], vec![whole("end", 2)]);
        let size = self.op("Shape", &[like], vec![whole("start", 2)]);
        let size = self.op("Concat", &[&channels, &size], vec![whole("axis", 0)]);
        let attributes = vec![
            word("mode", "nearest"),
            word("nearest_mode", "floor"),
            word("coordinate_transformation_mode", "asymmetric"),
        ];
        self.op("Resize", &[x, "", "", &size], attributes)
    }
}

fn attribute(name: &str, kind: AttributeKind) -> Attribute {
    Attribute { name: name.into(), kind: kind.into(), ..Attribute::default() }
}

fn number(name: &str, value: f32) -> Attribute {
    Attribute { f: Some(value), ..attribute(name, AttributeKind::Float) }
}

fn whole(name: &str, value: i64) -> Attribute {
    Attribute { i: Some(value), ..attribute(name, AttributeKind::Int) }
}

fn several(name: &str, values: &[i64]) -> Attribute {
    Attribute { ints: values.into(), ..attribute(name, AttributeKind::Ints) }
}

fn word(name: &str, value: &str) -> Attribute {
    Attribute { s: Some(value.into()), ..attribute(name, AttributeKind::String) }
}
