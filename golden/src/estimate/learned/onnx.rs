//! ONNX: a network as a file that other programs run, from stress to μ and its standard deviation.
//!
//! ```text
//! stress, mask ── masked b ── b/s, parities ─┬─ deconvolutions ─┬─ layers: MatMul, Add, Relu on images ── μ, σ
//!                    └─ peak ── s ─┘         └──────────────────┘
//! ```
//! The parities are an axis of length four in front of the batch, with a matrix each: as few products as the network itself has.
//! All numbers are those of the network, in single precision; only the order of sums may differ.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: `stress` of the window | batch × rows × cols | MPa |
//! | in: `mask` | batch × rows × cols | 1 on taxels that are dead or beyond the array, else 0 |
//! | out: `mu`, `sigma` | batch × 2: x, y | – |

mod proto;

use super::features::AMPLITUDE;
use super::network::{LN_SIGMA, PLACES};
use super::Learned;
use crate::physics::symmetry::folded::EVEN;
use crate::physics::symmetry::parity::sign;
use crate::spec::quads::Quads;
use faer::Mat;
use prost::Message;
use proto::{
    Attribute, Dimension, Entry, Graph, Model, Node, OperatorSet, Tensor, TensorShape, TensorType, Type, Value, FLOAT,
    INT64,
};
use std::f32::consts::LN_2;

/// Version of the format, and of the operators: those of 2021, which every runtime has.
const IR_VERSION: i64 = 8;
const OPERATORS: i64 = 13;
/// Mirror images or parities of a quad.
const FOUR: usize = Quads::LANES;

impl Learned {
    /// The network as the bytes of an ONNX file; `name` is that of the graph. A window around a contact is an input of its own:
    /// the readings of its taxels, from which those of other contacts have been taken out.
    pub fn to_onnx(&self, name: &str) -> Vec<u8> {
        let mut graph = Builder::default();
        let inputs = self.add_features(&mut graph);
        let last = self.add_layers(&mut graph, inputs);
        self.add_outputs(&mut graph, &last);
        let window = self.signature.window;
        let of_window = |name: &str, doc: &str| {
            value(name, doc, [None, Some(window.rows), Some(window.cols)].map(dimension).to_vec())
        };
        let of_shear = |name: &str, doc: &str| value(name, doc, [None, Some(2)].map(dimension).to_vec());
        let graph = Graph {
            name: name.to_owned(),
            input: vec![
                of_window("stress", "normal stress in MPa, compression positive"),
                of_window("mask", "1 on taxels that are dead or beyond the array, else 0"),
            ],
            output: vec![
                of_shear("mu", "ratio of shear to normal force, x and y"),
                of_shear("sigma", "standard deviation of mu, x and y"),
            ],
            ..graph.graph
        };
        let entry = |key: &str, value: String| Entry { key: key.to_owned(), value };
        let signature = &self.signature;
        let model = Model {
            ir_version: IR_VERSION,
            producer_name: "dermis".to_owned(),
            producer_version: env!("CARGO_PKG_VERSION").to_owned(),
            doc_string: "shear of a contact from the normal stress under an elastic cover".to_owned(),
            graph: Some(graph),
            opset_import: vec![OperatorSet { domain: String::new(), version: OPERATORS }],
            metadata_props: vec![
                entry("pitch_x_mm", self.sensor.pitch_x_mm.to_string()),
                entry("pitch_y_mm", self.sensor.pitch_y_mm.to_string()),
                entry("thickness_mm", self.sensor.thickness_mm.to_string()),
                entry("medium", self.medium.to_string()),
                entry("window", window.to_string()),
                entry("unipolar", signature.unipolar.to_string()),
                entry("mu_max", signature.mu_max.to_string()),
            ],
        };
        model.encode_to_vec()
    }

    /// Adds what the first layer takes; returns its name, 4 × batch × channels.
    fn add_features(&self, graph: &mut Builder) -> String {
        let quads = self.signature.window.quads();
        let n = quads.rows * quads.cols;
        let zero = graph.scalar("zero", 0.0);
        let one = graph.scalar("one", 1.0);
        let two = graph.scalar("two", 2.0);
        graph.whole("taxels", &[-1, n as i64]);
        let readings = graph.add("Reshape", &["stress", "taxels"], "readings");
        let mask = graph.add("Reshape", &["mask", "taxels"], "masked");
        let is_masked = graph.add("Greater", &[&mask, &zero], "is_masked");
        let mut b = graph.add("Where", &[&is_masked, &zero, &readings], "alive");
        if self.signature.unipolar {
            b = graph.add("Relu", &[&b], "without_tension");
        }
        // s is the power of two above the peak; its logarithm is rounded, so that it may be one too low or too high.
        let size = graph.add("Abs", &[&b], "size");
        let peak = graph.add_with("ReduceMax", &[&size], "peak", vec![Attribute::ints("axes", &[1])]);
        let ln = graph.add("Log", &[&peak], "ln_peak");
        let per_two = graph.scalar("per_two", 1.0 / LN_2);
        let exponent = graph.add("Mul", &[&ln, &per_two], "exponent");
        let exponent = graph.add("Floor", &[&exponent], "floor");
        let below = graph.add("Pow", &[&two, &exponent], "below");
        let above = graph.add("Mul", &[&below, &two], "above");
        let above_twice = graph.add("Mul", &[&above, &two], "above_twice");
        let too_low = graph.add("GreaterOrEqual", &[&peak, &above], "too_low");
        let too_high = graph.add("Less", &[&peak, &below], "too_high");
        let lower = graph.add("Where", &[&too_high, &below, &above], "lower");
        let power = graph.add("Where", &[&too_low, &above_twice, &lower], "power");
        let has_peak = graph.add("Greater", &[&peak, &zero], "has_peak");
        let s = graph.add("Where", &[&has_peak, &power, &one], "s");
        let amplitude = graph.scalar("amplitude", AMPLITUDE);
        let amplified = graph.add("Mul", &[&b, &amplitude], "amplified");
        let scaled = graph.add("Div", &[&amplified, &s], "scaled");
        // The parities of a quad are half the Hadamard transform of its images.
        let parities = |parity: usize| {
            let images = |quad: usize, taxel: usize| {
                let of_lane = |lane: usize| if quads.taxel(quad, lane) == taxel { sign(parity, lane) } else { 0.0 };
                0.5 * (0..FOUR).map(of_lane).sum::<f64>() as f32
            };
            Mat::from_fn(n, quads.len(), |taxel, quad| images(quad, taxel))
        };
        let of_parities = graph.matrices("parities", &std::array::from_fn(parities), false);
        let stress = graph.add("MatMul", &[&scaled, &of_parities], "stress_parities");
        let inverse = graph.matrices("inverse", &self.features.inverse, true);
        let deconvolved = graph.add("MatMul", &[&stress, &inverse], "deconvolved");
        let mask = graph.add("MatMul", &[&mask, &of_parities], "mask_parities");
        graph.add_with("Concat", &[&stress, &deconvolved, &mask], "features", vec![Attribute::int("axis", 2)])
    }

    /// Adds the layers; returns the name of the last one's parities.
    fn add_layers(&self, graph: &mut Builder, mut inputs: String) -> String {
        let transform = (0..FOUR * FOUR).map(|k| 0.5 * sign(k / FOUR, k % FOUR) as f32);
        let transform = graph.constant("transform", &[FOUR, FOUR], transform);
        graph.whole("four_rows", &[FOUR as i64, -1]);
        let layers = &self.network.layers;
        for (k, layer) in layers.iter().enumerate() {
            let name = |what: &str| format!("{what}_{k}");
            let width = layer.bias.len();
            let weights = graph.matrices(&name("weights"), &layer.weights, true);
            let product = graph.add("MatMul", &[&inputs, &weights], &name("product"));
            let bias = (0..FOUR)
                .flat_map(|parity| layer.bias.iter().map(move |bias| if parity == EVEN { *bias } else { 0.0 }));
            let bias = graph.constant(&name("bias"), &[FOUR, 1, width], bias);
            inputs = graph.add("Add", &[&product, &bias], &name("layer"));
            if k + 1 < layers.len() {
                let flat = graph.add("Reshape", &[&inputs, "four_rows"], &name("flat"));
                let images = graph.add("MatMul", &[&transform, &flat], &name("images"));
                let rectified = graph.add("Relu", &[&images], &name("rectified"));
                let parities = graph.add("MatMul", &[&transform, &rectified], &name("rectified_parities"));
                graph.whole(&name("shape"), &[FOUR as i64, -1, width as i64]);
                inputs = graph.add("Reshape", &[&parities, &name("shape")], &name("activation"));
            }
        }
        inputs
    }

    /// Adds μ and σ from the parities of the last layer.
    fn add_outputs(&self, graph: &mut Builder, last: &str) {
        let outputs: Vec<String> = PLACES
            .iter()
            .enumerate()
            .map(|(output, (parity, channel))| {
                let name = |what: &str| format!("{what}_of_output_{output}");
                graph.whole_of(&name("parity"), &[], &[*parity as i64]);
                graph.whole(&name("channel"), &[*channel as i64]);
                let own = vec![Attribute::int("axis", 0)];
                let of_parity = graph.add_with("Gather", &[last, &name("parity")], &name("channels"), own);
                let own = vec![Attribute::int("axis", 1)];
                graph.add_with("Gather", &[&of_parity, &name("channel")], &name("value"), own)
            })
            .collect();
        let joined = |graph: &mut Builder, of: &[String], name: &str| {
            let of: Vec<&str> = of.iter().map(String::as_str).collect();
            graph.add_with("Concat", &of, name, vec![Attribute::int("axis", 1)])
        };
        let (mean, ln_sigma) = outputs.split_at(PLACES.len() / 2);
        let mu_max = graph.scalar("mu_max", self.signature.mu_max as f32);
        let mean = joined(graph, mean, "mean_of_mu_max");
        let mean = graph.add("Mul", &[&mean, &mu_max], "mean");
        // No further than mu_max.
        let size = graph.add_with("ReduceL2", &[&mean], "mean_size", vec![Attribute::ints("axes", &[1])]);
        let size = graph.add("Max", &[&size, &mu_max], "mean_size_or_more");
        let share = graph.add("Div", &[&mu_max, &size], "share");
        graph.add("Mul", &[&mean, &share], "mu");
        let ln_sigma = joined(graph, ln_sigma, "ln_sigma");
        let [low, high] = [graph.scalar("ln_sigma_low", LN_SIGMA[0]), graph.scalar("ln_sigma_high", LN_SIGMA[1])];
        let clipped = graph.add("Clip", &[&ln_sigma, &low, &high], "ln_sigma_clipped");
        let sigma = graph.add("Exp", &[&clipped], "sigma_of_mu_max");
        graph.add("Mul", &[&sigma, &mu_max], "sigma");
    }
}

/// An axis of this length, or of any: that of the batch.
fn dimension(length: Option<usize>) -> Dimension {
    Dimension { dim_value: length.map(|length| length as i64), dim_param: length.is_none().then(|| "batch".to_owned()) }
}

/// An input or output.
fn value(name: &str, doc: &str, dim: Vec<Dimension>) -> Value {
    let tensor_type = TensorType { elem_type: FLOAT, shape: Some(TensorShape { dim }) };
    Value { name: name.to_owned(), of_type: Some(Type { tensor_type: Some(tensor_type) }), doc_string: doc.to_owned() }
}

/// A graph while it grows. Every result has the name of its node.
#[derive(Default)]
struct Builder {
    graph: Graph,
}

impl Builder {
    /// Adds an operation; returns the name of its result.
    fn add(&mut self, operator: &str, operands: &[&str], name: &str) -> String {
        self.add_with(operator, operands, name, Vec::new())
    }

    /// Adds an operation with settings.
    fn add_with(&mut self, operator: &str, operands: &[&str], name: &str, attribute: Vec<Attribute>) -> String {
        self.graph.node.push(Node {
            input: operands.iter().map(|operand| (*operand).to_owned()).collect(),
            output: vec![name.to_owned()],
            name: name.to_owned(),
            op_type: operator.to_owned(),
            attribute,
        });
        name.to_owned()
    }

    /// Adds a constant; returns its name.
    fn constant(&mut self, name: &str, lengths: &[usize], values: impl IntoIterator<Item = f32>) -> String {
        self.graph.initializer.push(Tensor {
            dims: lengths.iter().map(|length| *length as i64).collect(),
            data_type: FLOAT,
            name: name.to_owned(),
            raw_data: values.into_iter().flat_map(f32::to_le_bytes).collect(),
        });
        name.to_owned()
    }

    /// Adds a constant without axes.
    fn scalar(&mut self, name: &str, value: f32) -> String {
        self.constant(name, &[], [value])
    }

    /// Adds a list of whole numbers: a shape or indices.
    fn whole(&mut self, name: &str, values: &[i64]) {
        self.whole_of(name, &[values.len() as i64], values);
    }

    /// Adds whole numbers with axes of these lengths.
    fn whole_of(&mut self, name: &str, lengths: &[i64], values: &[i64]) {
        self.graph.initializer.push(Tensor {
            dims: lengths.to_vec(),
            data_type: INT64,
            name: name.to_owned(),
            raw_data: values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        });
    }

    /// Adds the matrices of the four parities, 4 × rows × columns, or transposed.
    fn matrices(&mut self, name: &str, of: &[Mat<f32>; FOUR], transposed: bool) -> String {
        let [rows, cols] = if transposed { [of[0].ncols(), of[0].nrows()] } else { [of[0].nrows(), of[0].ncols()] };
        let at = |k: usize| {
            let (own, row, col) = (&of[k / (rows * cols)], k / cols % rows, k % cols);
            if transposed {
                own[(col, row)]
            } else {
                own[(row, col)]
            }
        };
        self.constant(name, &[FOUR, rows, cols], (0..FOUR * rows * cols).map(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::scene::{EstimatorKind, Scene};
    use std::collections::BTreeSet;

    /// `python/tests/test_onnx.py` runs the files; here every operand is there before it is used, and every name once.
    #[test]
    fn every_operand_is_defined_before() {
        for name in ["sensor-1", "sensor-1-unipolar", "sensor-1-bonded", "eight-by-eight-bonded", "sensor-3-contacts"] {
            let scene = Scene::builtin(name).unwrap();
            let learned = Learned::of_scene(&scene, EstimatorKind::EvidenceNetwork).unwrap();
            let graph = Model::decode(&learned.to_onnx(name)[..]).unwrap().graph.unwrap();
            let mut defined: BTreeSet<&str> = graph.input.iter().map(|input| input.name.as_str()).collect();
            for constant in &graph.initializer {
                let values: i64 = constant.dims.iter().product();
                let bytes = if constant.data_type == FLOAT { 4 } else { 8 };
                assert_eq!(constant.raw_data.len() as i64, bytes * values, "{name}: {}", constant.name);
                assert!(defined.insert(&constant.name), "{name}: {}", constant.name);
            }
            for node in &graph.node {
                assert!(node.input.iter().all(|operand| defined.contains(operand.as_str())), "{name}: {node:?}");
                assert!(defined.insert(&node.name) && node.output == [node.name.as_str()], "{name}: {node:?}");
            }
            assert!(graph.output.iter().all(|output| defined.contains(output.name.as_str())));
            // A ReLU in each layer but the last, one for the readings of a unipolar array.
            let relu = graph.node.iter().filter(|node| node.op_type == "Relu").count();
            assert_eq!(relu, learned.network.layers.len() - 1 + usize::from(learned.signature.unipolar));
        }
    }
}
