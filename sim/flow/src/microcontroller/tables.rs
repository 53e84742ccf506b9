//! Tables: the matrices of the passes and the products that read them, as `engine.c` takes them.

use std::fmt::{Display, Write};

use dermis_golden::fixed::words::formats::Formats;
use dermis_golden::fixed::words::quantised::{coefficient, Quantised};
use dermis_golden::fixed::words::schedule::{layer, schedule, Kind, Matrix, Operand, Product};
use dermis_golden::fixed::{FixedError, Model};

/// Rows that `engine.c` multiplies at a time; a matrix is stored in whole blocks.
const BLOCK: usize = 4;
/// Parities of a vector.
const PARITIES: usize = 4;
/// Numbers in a line of a table.
const PER_LINE: usize = 12;

/// A table of constants in C.
pub(super) fn table(kind: &str, name: &str, values: &[impl Display]) -> String {
    let values: Vec<String> = values.iter().map(ToString::to_string).collect();
    let lines: Vec<String> = values.chunks(PER_LINE).map(|line| format!("    {}", line.join(", "))).collect();
    format!("static const {kind} {name}[{}] = {{\n{}\n}};\n\n", values.len(), lines.join(",\n"))
}

/// Where the vectors that products multiply are in the work memory, as indices of their first word.
pub(super) struct Layout {
    /// High limb of the folded input.
    pub input_high: usize,
    /// Low limb, where there is one.
    pub input_low: usize,
    /// The operand of the biases.
    pub bias: usize,
    vectors: usize,
    /// Words from one v_ij to the next; 0 with a network, which needs one at a time.
    stride: usize,
    layers: Vec<usize>,
    /// Number of all words.
    pub words: usize,
}

impl Layout {
    /// The layout of a scene with one subarray and one μ.
    pub fn new(formats: &Formats) -> Layout {
        let vector = PARITIES * formats.quads;
        let input_low = vector;
        let bias = input_low + if formats.input_low_bits > 0 { vector } else { 0 };
        let vectors = bias + PARITIES;
        let (stride, count) = match formats.has_network() {
            true => (0, 1),
            false => (vector, formats.operand_vectors()),
        };
        let mut words = vectors + count * vector;
        let mut next = |rows: &usize| {
            words += PARITIES * rows;
            words - PARITIES * rows
        };
        let layers = formats.layers.iter().map(&mut next).collect();
        Layout { input_high: 0, input_low, bias, vectors, stride, layers, words }
    }

    /// Index of v_ij number `k`, or of p after so many steps.
    fn vector(&self, k: usize) -> usize {
        self.vectors + k * self.stride
    }

    fn of(&self, operand: Operand) -> Result<usize, FixedError> {
        match operand {
            Operand::InputHigh => Ok(self.input_high),
            Operand::InputLow => Ok(self.input_low),
            Operand::One => Ok(self.bias),
            Operand::Vector(k) => Ok(self.vector(k)),
            Operand::Layer(index) => Ok(self.layers[index]),
            Operand::Window | Operand::Mask | Operand::Shear(..) => {
                Err(FixedError::Internal("C for a product of contacts"))
            }
        }
    }
}

/// A sum of products.
struct Sum {
    products: Vec<Product>,
    /// Number of rows.
    rows: usize,
    /// Where its operand is in the work memory.
    result: usize,
}

impl Sum {
    /// Accumulators in memory.
    fn stored(&self) -> usize {
        PARITIES * self.rows.next_multiple_of(BLOCK)
    }
}

/// The matrices and sums of products of a scene.
pub(super) struct Tables<'a> {
    formats: &'a Formats,
    quantised: &'a Quantised,
    layout: &'a Layout,
    vectors: Vec<Sum>,
    layers: Vec<Sum>,
}

impl<'a> Tables<'a> {
    /// Those of a model with one subarray and one μ.
    pub fn new(model: &'a Model, layout: &'a Layout) -> Tables<'a> {
        let (formats, quantised) = (model.formats(), model.quantised());
        let sum = |products: Vec<Product>, result| {
            let rows = products.first().map_or(0, |product| quantised.size(product.matrix, formats.quads)[0]);
            Sum { products, rows, result }
        };
        let vectors = schedule(formats).into_iter().enumerate();
        let vectors = vectors.map(|(k, products)| sum(products, layout.vector(k))).collect();
        let layers = layout.layers.iter().enumerate().map(|(k, result)| sum(layer(formats, k), *result)).collect();
        Tables { formats, quantised, layout, vectors, layers }
    }

    fn sums(&self) -> impl Iterator<Item = &Sum> {
        self.vectors.iter().chain(&self.layers)
    }

    /// Each matrix once.
    fn matrices(&self) -> Vec<Matrix> {
        let mut all: Vec<Matrix> = Vec::new();
        for product in self.sums().flat_map(|sum| &sum.products) {
            if !all.contains(&product.matrix) {
                all.push(product.matrix);
            }
        }
        all
    }

    /// Number of coefficients that a matrix has in memory.
    fn coefficients(&self, matrix: Matrix) -> usize {
        let [rows, columns] = self.quantised.size(matrix, self.formats.quads);
        PARITIES * rows.next_multiple_of(BLOCK) * columns
    }

    /// Bytes of all coefficients.
    pub fn coefficient_bytes(&self) -> usize {
        self.matrices().into_iter().map(|matrix| size_of::<i32>() * self.coefficients(matrix)).sum()
    }

    /// Products of a coefficient and a word in a frame.
    pub fn products(&self) -> usize {
        self.sums().flat_map(|sum| &sum.products).map(|product| self.coefficients(product.matrix)).sum()
    }

    /// Number of accumulators.
    pub fn accumulators(&self) -> usize {
        self.sums().map(Sum::stored).max().unwrap_or(0)
    }

    /// Matrices, then sums, in C.
    ///
    /// # Errors
    /// [`FixedError::Internal`] for a product of contacts.
    pub fn text(&self) -> Result<String, FixedError> {
        let matrices = self.matrices().into_iter().map(|matrix| self.matrix(matrix));
        let mut text: String = matrices.collect();
        text += &self.list("VECTOR", &self.vectors)?;
        if !self.layers.is_empty() {
            text += &self.list("LAYER", &self.layers)?;
        }
        Ok(text)
    }

    /// A matrix in C: of each parity, of each block of rows, column by column.
    fn matrix(&self, matrix: Matrix) -> String {
        let [rows, columns] = self.quantised.size(matrix, self.formats.quads);
        let blocks = &self.quantised.blocks(matrix).parity;
        let word = |parity: usize, row: usize, column: usize| match row < rows {
            true => coefficient(self.formats, matrix.kind, blocks[parity][row * columns + column]),
            false => 0,
        };
        let mut words = Vec::with_capacity(self.coefficients(matrix));
        for parity in 0..PARITIES {
            for first in (0..rows).step_by(BLOCK) {
                let of = |column| (first..first + BLOCK).map(move |row| (row, column));
                words.extend((0..columns).flat_map(of).map(|(row, column)| word(parity, row, column)));
            }
        }
        format!("/* {rows} rows, {columns} columns. */\n") + &table("int32_t", &name(matrix), &words)
    }

    /// The sums `PREFIX_0`, `PREFIX_1` … and the list `PREFIXS` of them, in C.
    fn list(&self, prefix: &str, sums: &[Sum]) -> Result<String, FixedError> {
        let (mut text, mut list) = (String::new(), String::new());
        for (index, Sum { products, rows, result }) in sums.iter().enumerate() {
            let count = products.len();
            let _ = writeln!(text, "static const struct product {prefix}_{index}[{count}] = {{");
            let mut aligned = false;
            for product in products {
                // Products of high limbs come first; their sum is shifted when the first of the others is added.
                let shift = if aligned && !product.align { self.formats.limb_align } else { 0 };
                aligned = product.align;
                let axis = product.factor.map_or(0, |axis| axis as u32 + 1);
                let (name, columns) =
                    (name(product.matrix), self.quantised.size(product.matrix, self.formats.quads)[1]);
                let (operand, flip) = (self.layout.of(product.operand)?, product.matrix.flip);
                let transposed = u32::from(product.transposed);
                let _ = writeln!(
                    text,
                    "    {{{name}, {columns}U, {operand}U, {flip}U, {shift}U, {axis}U, {transposed}U}},"
                );
            }
            text += "};\n";
            let _ = writeln!(list, "    {{{prefix}_{index}, {count}U, {rows}U, {result}U}},");
        }
        let count = sums.len();
        let _ = write!(text, "static const struct accumulation {prefix}S[{count}] = {{\n{list}}};\n\n");
        Ok(text)
    }
}

/// Name of a matrix in C.
fn name(Matrix { kind, flip }: Matrix) -> String {
    match kind {
        Kind::InverseHigh => format!("INVERSE_HIGH_{flip}"),
        Kind::InverseLow => format!("INVERSE_LOW_{flip}"),
        Kind::Ax => format!("AX_{flip}"),
        Kind::Ay => format!("AY_{flip}"),
        Kind::Layer(layer) => format!("WEIGHTS_{layer}"),
        Kind::Mask => "MASK".to_owned(),
        Kind::Bias(layer) => format!("BIASES_{layer}"),
    }
}
