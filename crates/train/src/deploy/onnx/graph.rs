//! Records the operations of a network as an ONNX graph; see [`super`].

use super::proto::{Attribute, AttributeKind, DataType, Graph, Node, Tensor};
use crate::data::Normalization;
use crate::data::normalise::LEAST;
use crate::net::{Conv, Norm, Operations};
use crate::weights::Array;
use furrow_base::math::{ToFloat, ToInt};

/// Implementation of [`Operations`] that appends a node per operation. A value is its name in the graph; the first output of an operation
/// has the operation's name.
#[derive(Default)]
pub(super) struct Recorder {
    pub(super) graph: Graph,
    /// Number of operations without a layer name; numbers their generated names.
    unnamed: usize,
}

impl Recorder {
    /// Appends an operation with one output called `name` and returns that name.
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

    /// Appends an operation under a generated name, such as `relu_12`.
    fn op(&mut self, op: &str, inputs: &[&str], attributes: Vec<Attribute>) -> String {
        self.unnamed += 1;
        let name = format!("{}_{}", op.to_lowercase(), self.unnamed);
        self.named(&name, op, inputs, attributes)
    }

    /// Adds a single-precision constant and returns its name.
    fn constant(&mut self, name: &str, shape: &[usize], values: &[f32]) -> String {
        self.graph.initializer.push(Tensor {
            dims: shape.iter().map(|n| n.to_i64()).collect(),
            data_type: DataType::Float.into(),
            name: name.into(),
            raw_data: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        });
        name.into()
    }

    /// Adds a list of integers (sizes, shapes, axes) as a constant, unless the same list is there already; returns its name.
    fn wholes(&mut self, values: &[i64]) -> String {
        let words: Vec<String> = values.iter().map(ToString::to_string).collect();
        let name = format!("whole_{}", words.join("_"));
        if self.graph.initializer.iter().all(|tensor| tensor.name != name) {
            self.graph.initializer.push(Tensor {
                dims: vec![values.len().to_i64()],
                data_type: DataType::Int64.into(),
                name: name.clone(),
                raw_data: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            });
        }
        name
    }

    /// Adds a single-precision scalar as a constant, unless the same value is there already; returns its name.
    fn number(&mut self, value: f32) -> String {
        let name = format!("number_{value}");
        if self.graph.initializer.iter().all(|tensor| tensor.name != name) {
            self.constant(&name, &[], &[value]);
        }
        name
    }

    /// Resizes `x` to the height and width that the graph value `size` holds; samples are at pixel centres (`half_pixel`).
    fn resize(&mut self, x: &str, size: &str, mode: &str) -> String {
        let channels = self.op("Shape", &[x], vec![whole("end", 2)]);
        let size = self.op("Concat", &[&channels, size], vec![whole("axis", 0)]);
        let attributes = vec![
            word("mode", mode),
            word("coordinate_transformation_mode", "half_pixel"),
            number("cubic_coeff_a", -0.75),
        ];
        self.op("Resize", &[x, "", "", &size], attributes)
    }

    /// Adds the trained weights as constants under their own names.
    pub(super) fn weights<'a>(&mut self, arrays: impl IntoIterator<Item = &'a Array>) {
        for array in arrays {
            self.constant(&array.name, &array.shape, &array.values);
        }
    }

    /// Appends the input normalization and returns its output, images × bands × height × width. The 8-bit pixels (images × height × width
    /// × bands) are scaled to 0..1, the mean is subtracted and the result divided by the standard deviation √(mean of (x − mean)²). The
    /// standard deviation of an image is at least [`LEAST`], one 8-bit step.
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

    /// Ends the graph: names the network's output `x` `scores` and appends its argmax over the classes as `classes`.
    pub(super) fn end(&mut self, x: &str) {
        self.named("scores", "Identity", &[x], vec![]);
        let place = self.op("ArgMax", &["scores"], vec![whole("axis", 1), whole("keepdims", 0)]);
        self.named("classes", "Cast", &[&place], vec![whole("to", DataType::Uint8 as i64)]);
    }
}

impl Operations for Recorder {
    type Value = String;
    /// Indices of the maxima, and the name of the pooling's input.
    type PoolIndices = (String, String);

    fn conv(&mut self, x: &String, name: &str, conv: Conv) -> String {
        let (weight, bias) = (format!("{name}.weight"), format!("{name}.bias"));
        let mut inputs = vec![x.as_str(), &weight];
        if conv.bias {
            inputs.push(&bias);
        }
        let (kernel, stride) = (conv.kernel.to_i64(), conv.stride.to_i64());
        let (before, after) = (conv.padding().0.to_i64(), conv.padding().1.to_i64());
        let attributes = vec![
            several("kernel_shape", &[kernel; 2]),
            several("strides", &[stride; 2]),
            several("pads", &[before, before, after, after]),
            whole("group", conv.groups.to_i64()),
        ];
        self.named(name, "Conv", &inputs, attributes)
    }

    fn norm(&mut self, x: &String, name: &str, norm: Norm) -> String {
        let [gain, shift, mean, variance] =
            ["weight", "bias", "running_mean", "running_var"].map(|what| format!("{name}.{what}"));
        let epsilon = number("epsilon", norm.epsilon.to_f32());
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

    fn pool(&mut self, x: &String) -> (String, Self::PoolIndices) {
        let smaller = self.op("MaxPool", &[x], vec![several("kernel_shape", &[2, 2]), several("strides", &[2, 2])]);
        let places = format!("{smaller}.places");
        if let Some(node) = self.graph.node.last_mut() {
            node.output.push(places.clone());
        }
        (smaller, (places, x.clone()))
    }

    /// The output size is read at run time from the shape of the pooling's input.
    fn unpool(&mut self, x: &String, (places, before): Self::PoolIndices) -> String {
        let size = self.op("Shape", &[&before], vec![]);
        let attributes = vec![several("kernel_shape", &[2, 2]), several("strides", &[2, 2])];
        self.op("MaxUnpool", &[x, &places, &size], attributes)
    }

    fn pool3(&mut self, x: &String) -> String {
        let attributes =
            vec![several("kernel_shape", &[3, 3]), several("strides", &[2, 2]), several("pads", &[1, 1, 1, 1])];
        self.op("MaxPool", &[x], attributes)
    }

    /// Output pixel i of n takes source pixel ⌊i · m / n⌋ of m, as `upsample_nearest2d` of PyTorch does.
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

    fn to_multiple(&mut self, x: &String, pixels: usize) -> String {
        let (less, pixels) = (self.wholes(&[pixels.to_i64() - 1]), self.wholes(&[pixels.to_i64()]));
        let size = self.op("Shape", &[x], vec![whole("start", 2)]);
        let more = self.op("Add", &[&size, &less], vec![]);
        let times = self.op("Div", &[&more, &pixels], vec![]);
        let size = self.op("Mul", &[&times, &pixels], vec![]);
        self.resize(x, &size, "linear")
    }

    fn tokens(&mut self, x: &String, name: &str, channels: usize, _grid: usize) -> String {
        let size = self.op("Shape", &[x], vec![whole("start", 2)]);
        let position = self.resize(&format!("{name}.position"), &size, "cubic");
        let placed = self.op("Add", &[x, &position], vec![]);
        let row = self.wholes(&[0, channels.to_i64(), 1, -1]);
        let patches = self.op("Reshape", &[&placed, &row], vec![]);
        let images = self.op("Shape", &[x], vec![whole("end", 1)]);
        let one = self.wholes(&[channels.to_i64(), 1, 1]);
        let shape = self.op("Concat", &[&images, &one], vec![whole("axis", 0)]);
        let class = self.op("Expand", &[&format!("{name}.class"), &shape], vec![]);
        self.op("Concat", &[&class, &patches], vec![whole("axis", 3)])
    }

    fn map(&mut self, tokens: &String, like: &String) -> String {
        let [from, to, axis] = [[1], [i64::MAX], [3]].map(|n| self.wholes(&n));
        let patches = self.op("Slice", &[tokens, &from, &to, &axis], vec![]);
        let size = self.op("Shape", &[like], vec![]);
        self.op("Reshape", &[&patches, &size], vec![])
    }

    fn layer_norm(&mut self, x: &String, name: &str, norm: Norm) -> String {
        let lying = self.op("Transpose", &[x], vec![several("perm", &[0, 2, 3, 1])]);
        let inputs = [&lying, &format!("{name}.weight"), &format!("{name}.bias")];
        let y =
            self.op("LayerNormalization", &inputs.map(String::as_str), vec![number("epsilon", norm.epsilon.to_f32())]);
        self.op("Transpose", &[&y], vec![several("perm", &[0, 3, 1, 2])])
    }

    /// x / 2 · (1 + erf(x / √2)).
    fn gelu(&mut self, x: &String) -> String {
        let [root, one, half] = [std::f32::consts::FRAC_1_SQRT_2, 1.0, 0.5].map(|n| self.number(n));
        let y = self.op("Mul", &[x, &root], vec![]);
        let y = self.op("Erf", &[&y], vec![]);
        let y = self.op("Add", &[&y, &one], vec![]);
        let y = self.op("Mul", &[&y, &half], vec![]);
        self.op("Mul", &[x, &y], vec![])
    }

    /// Each head sums its values with the weights softmax(qᵀ · k / √d), where d = channels / heads.
    fn attention(&mut self, x: &String, channels: usize, heads: usize) -> String {
        let (wide, heads) = ((channels / heads).to_f32(), heads.to_i64());
        let shape = self.wholes(&[0, 3 * heads, -1, 0]);
        let all = self.op("Reshape", &[x, &shape], vec![]);
        let [query, key, value] = [0, 1, 2].map(|part| {
            let [from, to, axis] = [part * heads, (part + 1) * heads, 1].map(|n| self.wholes(&[n]));
            self.op("Slice", &[&all, &from, &to, &axis], vec![])
        });
        let turned = || vec![several("perm", &[0, 1, 3, 2])];
        let query = self.op("Transpose", &[&query], turned());
        let products = self.op("MatMul", &[&query, &key], vec![]);
        let root = self.number(wide.sqrt().recip());
        let products = self.op("Mul", &[&products, &root], vec![]);
        let shares = self.op("Softmax", &[&products], vec![whole("axis", 3)]);
        let shares = self.op("Transpose", &[&shares], turned());
        let sums = self.op("MatMul", &[&value, &shares], vec![]);
        let shape = self.wholes(&[0, channels.to_i64(), 1, -1]);
        self.op("Reshape", &[&sums, &shape], vec![])
    }

    fn scale(&mut self, x: &String, name: &str, channels: usize) -> String {
        let shape = self.wholes(&[channels.to_i64(), 1, 1]);
        let gamma = self.op("Reshape", &[&format!("{name}.gamma"), &shape], vec![]);
        self.op("Mul", &[x, &gamma], vec![])
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
