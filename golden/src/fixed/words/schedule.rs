//! The order of the matrix passes: which product feeds which v_ij.
//!
//! v_00 = Cz⁺ b comes first, in limbs; then v_ij = −(Ax v_{i−1,j} + Ay v_{i,j−1}) by rising degree, so that every
//! operand is finished as early as possible before it is needed. All products of a v_ij are added up before they are
//! rounded, once. A matrix without the mirror symmetry has one product for each of its parity flips. Hardware and
//! bit-true model read the same list.
//!
//! The lanes of the parallel engine are plain multiply-accumulators and shift nothing: the products of v_00 with a low
//! limb are one [accumulation](accumulations), those of the high limbs another, and their rows are added once, in front
//! of `rescale`. The serial engine has one accumulator of each parity and shifts in front of it.
//!
//! With a network there is no polynomial: after v_00 come the layers of the [network](super::network), each a product and
//! its bias, then the steps of [`relax`](crate::fixed::stages::relax), whose operands are multiplied by μ1 or μ2. Where every
//! contact has a μ of its own, the layers are computed for each contact, their first takes the mask of its window as well,
//! and the operands of the steps are those of [`shear`](crate::fixed::stages::shear).

use super::coefficients::Flips;
pub use super::formats::vectors;
use super::formats::Formats;

/// (i, j) of the v_ij up to degree 3, in order of computation.
pub const EXPONENTS: [(u32, u32); 10] =
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

/// Contents of a matrix in the coefficient memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// High limb of Cz⁺.
    InverseHigh,
    /// Low limb of Cz⁺.
    InverseLow,
    /// −Ax·(4/3)·mu_max.
    Ax,
    /// −Ay·(4/3)·mu_max.
    Ay,
    /// Weights of a layer of the network.
    Layer(usize),
    /// Weights of the mask of a contact's window, in the first layer.
    Mask,
    /// Biases of a layer of the network, one column.
    Bias(usize),
}

/// A matrix in the coefficient memory: the blocks of one parity flip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Matrix {
    /// What the matrix contains.
    pub kind: Kind,
    /// Source parity = target parity XOR `flip`.
    pub flip: usize,
}

/// A vector that a pass multiplies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operand {
    /// High limb of the folded input.
    InputHigh,
    /// Low limb of the folded input.
    InputLow,
    /// v_ij, by its index in [`EXPONENTS`]; with a network v_00, or p after so many steps of `relax`.
    Vector(usize),
    /// Images of a hidden layer's neurons, after ReLU.
    Layer(usize),
    /// High limb of the folded window of a contact.
    Window,
    /// Folded mask of that window.
    Mask,
    /// p after so many steps of `relax`, times the μ of each taxel's contact.
    Shear(usize, Axis),
    /// One quad of [`ONE`](super::network::ONE)s, the operand of the biases.
    One,
}

/// The result of an accumulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A vector for `rescale`, by its number: [`Formats::vectors`].
    Vector(usize),
    /// A layer of the network.
    Layer(usize),
}

/// A scalar that an operand is multiplied by: the position of μ on an axis, over 512.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// μ1.
    X,
    /// μ2.
    Y,
}

/// One matrix-vector product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Product {
    /// The matrix.
    pub matrix: Matrix,
    /// The vector.
    pub operand: Operand,
    /// Whether the product, one of two high limbs, is shifted left by `formats.limb_align` bits.
    pub align: bool,
    /// Whether operand and result have x and y exchanged.
    pub transposed: bool,
    /// What the operand is multiplied by first.
    pub factor: Option<Axis>,
}

/// The products of every vector that leaves `rescale`: the v_ij in order of [`EXPONENTS`]; with a network v_00, then those
/// of each step of `relax`.
pub fn schedule(formats: &Formats) -> Vec<Vec<Product>> {
    let limbs = (formats.input_low_bits > 0, formats.inverse_low_bits > 0);
    match formats.has_network() {
        false => products(formats.degree, limbs, formats.shared_a, &formats.flips),
        true => {
            let first = products(0, limbs, false, &formats.flips);
            first.into_iter().chain((0..formats.degree).map(|step| shear(formats, step))).collect()
        }
    }
}

/// The products of a step of `relax`: −(μ1 Ax + μ2 Ay) p.
fn shear(formats: &Formats, step: usize) -> Vec<Product> {
    let of = |kind, axis, flips: &[usize]| -> Vec<Product> {
        let product = |&flip| match formats.by_contact() {
            true => Product::of(kind, flip, Operand::Shear(step, axis)),
            false => Product { factor: Some(axis), ..Product::of(kind, flip, Operand::Vector(step)) },
        };
        flips.iter().map(product).collect()
    };
    [of(Kind::Ax, Axis::X, &formats.flips.ax), of(Kind::Ay, Axis::Y, &formats.flips.ay)].concat()
}

/// The products of a layer of the network.
pub fn layer(formats: &Formats, layer: usize) -> Vec<Product> {
    let inputs = match layer.checked_sub(1) {
        Some(before) => Operand::Layer(before),
        None if formats.by_contact() => Operand::Window,
        None => Operand::InputHigh,
    };
    let weights = Product::of(Kind::Layer(layer), 0, inputs);
    let mask = (layer == 0 && formats.by_contact()).then(|| Product::of(Kind::Mask, 0, Operand::Mask));
    let bias = Product::of(Kind::Bias(layer), 0, Operand::One);
    [weights].into_iter().chain(mask).chain([bias]).collect()
}

/// The products of every accumulation of the parallel engine's lanes, with their result; of v_00 that of the low limbs
/// comes first, the layers of a network come after v_00.
pub fn accumulations(formats: &Formats) -> Vec<(Target, Vec<Product>)> {
    let of = |(k, products): (usize, Vec<Product>)| {
        by_limbs(&products).into_iter().map(move |part| (Target::Vector(k), part))
    };
    let mut vectors = schedule(formats).into_iter().enumerate();
    let mut all: Vec<_> = vectors.by_ref().take(1).flat_map(of).collect();
    all.extend((0..formats.layers.len()).map(|index| (Target::Layer(index), layer(formats, index))));
    all.extend(vectors.flat_map(of));
    all
}

/// Accumulations that the lanes do one after the other, and the operands that come in meanwhile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// The accumulations in order.
    pub accumulations: Vec<(Target, Vec<Product>)>,
    /// Length in quads of each vector that they read from the operand memory, in the order in which it is written.
    pub operands: Vec<usize>,
}

/// The sections of a subarray: one. Where each contact has a μ of its own: v_00; the layers, once for each contact; a step of
/// `relax`, repeated.
///
/// | section | vectors in the operand memory |
/// |---|---|
/// | with a search | the v_ij but those of the highest degree |
/// | with one μ | v_00, the images of each hidden layer, one quad when μ is known, then p after each step but the last |
/// | v_00 of contacts | none |
/// | layers of a contact | its window, its mask, the images of each hidden layer, one quad when μ is known |
/// | step of contacts | p times μ1, p times μ2 |
pub fn sections(formats: &Formats) -> Vec<Section> {
    let all = accumulations(formats);
    let (vectors, images) = (formats.operand_vectors(), || formats.hidden_rows().chain([1]));
    let quads = vec![formats.quads; vectors];
    let Some(window) = formats.window_quads else {
        let operands = match (formats.has_network(), quads.split_first()) {
            (true, Some((&first, steps))) => [first].into_iter().chain(images()).chain(steps.iter().copied()).collect(),
            _ => quads,
        };
        return vec![Section { accumulations: all, operands }];
    };
    let part = |of: &dyn Fn(&Target) -> bool, operands| Section {
        accumulations: all.iter().filter(|(target, _)| of(target)).cloned().collect(),
        operands,
    };
    vec![
        part(&|target| *target == Target::Vector(0), Vec::new()),
        part(&|target| matches!(target, Target::Layer(_)), [window; 2].into_iter().chain(images()).collect()),
        part(&|target| *target == Target::Vector(1), vec![formats.quads; 2]),
    ]
}

/// Index of an operand among the vectors of its [`Section`]; `None` for the input and [`Operand::One`].
pub fn operand_number(formats: &Formats, operand: Operand) -> Option<usize> {
    match operand {
        Operand::InputHigh | Operand::InputLow | Operand::One => None,
        Operand::Window => Some(0),
        Operand::Mask => Some(1),
        Operand::Shear(_, axis) => Some(axis as usize),
        Operand::Layer(layer) => Some(layer + if formats.by_contact() { 2 } else { 1 }),
        Operand::Vector(0) => Some(0),
        // With a network the images and μ are between v_00 and p.
        Operand::Vector(index) => Some(index + formats.layers.len()),
    }
}

/// The products of one v_ij by their shift: those of low limbs, if there are any, then the others.
pub fn by_limbs(products: &[Product]) -> Vec<Vec<Product>> {
    let (high, low): (Vec<Product>, Vec<Product>) = products.iter().partition(|product| product.align);
    [low, high].into_iter().filter(|part| !part.is_empty()).collect()
}

/// The products for a polynomial of `degree`; `limbs`: whether the input and Cz⁺ have a low limb; `shared_a`: whether
/// Ax is used for Ay; `flips` of the matrices.
pub fn products(degree: usize, limbs: (bool, bool), shared_a: bool, flips: &Flips) -> Vec<Vec<Product>> {
    let of = |kind, flips: &[usize], operand, align, transposed| -> Vec<Product> {
        let product = |&flip| Product { align, transposed, ..Product::of(kind, flip, operand) };
        flips.iter().map(product).collect()
    };
    let mut first = of(Kind::InverseHigh, &flips.inverse, Operand::InputHigh, true, false);
    if limbs.0 {
        first.extend(of(Kind::InverseHigh, &flips.inverse, Operand::InputLow, false, false));
    }
    if limbs.1 {
        first.extend(of(Kind::InverseLow, &flips.inverse, Operand::InputHigh, false, false));
    }
    let index = |i, j| EXPONENTS.iter().position(|&e| e == (i, j));
    let mut all = vec![first];
    for &(i, j) in EXPONENTS[..vectors(degree)].iter().skip(1) {
        let mut products = Vec::new();
        if let Some(source) = j.checked_sub(1).and_then(|below| index(i, below)) {
            let (kind, flips) = if shared_a { (Kind::Ax, &flips.ax) } else { (Kind::Ay, &flips.ay) };
            products.extend(of(kind, flips, Operand::Vector(source), false, shared_a));
        }
        if let Some(source) = i.checked_sub(1).and_then(|left| index(left, j)) {
            products.extend(of(Kind::Ax, &flips.ax, Operand::Vector(source), false, false));
        }
        // The older operand first: its pass hides the latency of the younger one.
        products.sort_by_key(Product::operand_index);
        all.push(products);
    }
    all
}

/// Whether the result of these products has x and y exchanged.
pub fn is_transposed(products: &[Product]) -> bool {
    products.iter().any(|product| product.transposed)
}

impl Product {
    /// A plain product.
    fn of(kind: Kind, flip: usize, operand: Operand) -> Product {
        Product { matrix: Matrix { kind, flip }, operand, align: false, transposed: false, factor: None }
    }

    /// Index of the operand's v_ij; 0 for all other operands.
    pub fn operand_index(&self) -> usize {
        match self.operand {
            Operand::Vector(index) => index,
            Operand::InputHigh
            | Operand::InputLow
            | Operand::Layer(_)
            | Operand::Window
            | Operand::Mask
            | Operand::Shear(..)
            | Operand::One => 0,
        }
    }
}
