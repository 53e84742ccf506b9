//! Program: the instructions of the passes. Each is the products of a group of rows of one matrix with one vector; the lanes
//! add those of an accumulation up.
//!
//! | | shape | unit |
//! |---|---|---|
//! | in: accumulations of each [`Section`], layout of the coefficient memory | – | – |
//! | out: [`Instruction`]s | one per product and group of rows | words of the memories |

use super::contents::{CasePlan, Plan};
use crate::fixed::words::formats::Formats;
use crate::fixed::words::schedule::{
    operand_number, sections, Axis, Kind, Matrix, Operand, Product, Section, Target, EXPONENTS,
};
use crate::spec::board::EngineKind;
use serde::Serialize;

/// The products of one group of rows of a matrix with a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// What the accumulation results in.
    pub target: Target,
    /// Index of the group of rows.
    pub group: usize,
    /// Matrix and vector.
    pub product: Product,
    /// First address in the coefficient memory.
    pub coefficients: usize,
    /// Number of words there: the stored columns.
    pub columns: usize,
    /// First address in the operand memory; 0 for the input.
    pub operand: usize,
    /// Number of operand vectors that must be readable before.
    pub needs: usize,
    /// Last product of an accumulation.
    pub last: bool,
}

/// The instructions of a section: for each accumulation, for each group of rows, its products.
pub fn instructions(case: &CasePlan, section: &Section) -> Vec<Instruction> {
    let CasePlan { formats, storage, .. } = case;
    let first = |number: usize| section.operands[..number].iter().sum::<usize>();
    let mut all = Vec::new();
    for (target, products) in &section.accumulations {
        for group in 0..storage.groups_of(products) {
            for (index, &product) in products.iter().enumerate() {
                let number = operand_number(formats, product.operand);
                let needs = match (product.operand, number) {
                    // p is read once μ is known.
                    (Operand::Vector(_), Some(number)) => number.max(formats.layers.len()) + 1,
                    (_, Some(number)) => number + 1,
                    // The first layer waits for v_00, so that one vector is written after the other.
                    (Operand::InputHigh, None) => usize::from(matches!(target, Target::Layer(_))),
                    (_, None) => 0,
                };
                all.push(Instruction {
                    target: *target,
                    group,
                    product,
                    coefficients: storage.address_of(product.matrix, group),
                    columns: storage.columns_of(product.matrix, group).len(),
                    operand: number.map_or(0, first),
                    needs,
                    last: index + 1 == products.len(),
                });
            }
        }
    }
    all
}

/// An instruction in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Listed {
    /// The case, as a scene file names it.
    pub case: String,
    /// The section, and when it runs.
    pub section: &'static str,
    /// Index in the section.
    pub step: usize,
    /// What the accumulation results in.
    pub result: String,
    /// Index of the group of rows.
    pub group: usize,
    /// The matrix.
    pub matrix: String,
    /// Source parity = target parity XOR `flip`.
    pub flip: usize,
    /// The vector that it multiplies.
    pub operand: String,
    /// First address in the coefficient memory.
    pub coefficients: usize,
    /// Cycles: one per stored column.
    pub cycles: usize,
}

/// The issues of a frame, one per cycle of a product: index of the section in the hardware's table, and of the instruction in it.
/// `case` is the index of the case taken, `contacts` the number of those with a μ of their own.
pub fn issued(plan: &Plan, case: usize, contacts: usize) -> Vec<[usize; 2]> {
    let before: usize = plan.cases()[..case].iter().map(|case| sections(&case.formats).len()).sum();
    let case = &plan.cases()[case];
    let mut all = Vec::new();
    for (index, (section, (_, times))) in sections(&case.formats).iter().zip(runs(case, contacts)).enumerate() {
        let own = instructions(case, section);
        let steps =
            own.iter().enumerate().flat_map(|(step, own)| std::iter::repeat_n([before + index, step], own.columns));
        let once: Vec<[usize; 2]> = steps.collect();
        all.extend(once.repeat(times));
    }
    all
}

/// The program of all cases, in the order of the table in the hardware; none for the serial engine, which has no lanes.
pub fn listing(plan: &Plan) -> Vec<Listed> {
    let mut all = Vec::new();
    let parallel = plan.board.engine == EngineKind::Parallel;
    for case in plan.cases().iter().filter(|_| parallel) {
        for (section, (section_name, _)) in sections(&case.formats).iter().zip(runs(case, 0)) {
            let listed = |(step, instruction): (usize, Instruction)| Listed {
                case: case.case.to_string(),
                section: section_name,
                step,
                result: result(&case.formats, instruction.target),
                group: instruction.group,
                matrix: matrix(instruction.product.matrix),
                flip: instruction.product.matrix.flip,
                operand: operand(&case.formats, &instruction.product),
                coefficients: instruction.coefficients,
                cycles: instruction.columns,
            };
            all.extend(instructions(case, section).into_iter().enumerate().map(listed));
        }
    }
    all
}

/// When each section runs, and how often in a frame with so many contacts.
fn runs(case: &CasePlan, contacts: usize) -> Vec<(&'static str, usize)> {
    match case.formats.by_contact() {
        false => vec![("each subarray", case.parts.len())],
        true => vec![("first", 1), ("each contact", contacts), ("each step of relax", case.formats.degree)],
    }
}

/// v_ij, or p after so many steps of `relax`.
fn vector(formats: &Formats, index: usize) -> String {
    match (formats.has_network(), EXPONENTS.get(index)) {
        (false, Some((i, j))) => format!("v_{i}{j}"),
        (_, _) if index == 0 => "v_00".to_owned(),
        _ => format!("p_{index}"),
    }
}

fn result(formats: &Formats, target: Target) -> String {
    match target {
        Target::Vector(_) if formats.by_contact() && target != Target::Vector(0) => "p".to_owned(),
        Target::Vector(index) => vector(formats, index),
        Target::Layer(layer) => format!("layer {}", layer + 1),
    }
}

fn matrix(matrix: Matrix) -> String {
    match matrix.kind {
        Kind::InverseHigh => "Cz⁺, high limb".to_owned(),
        Kind::InverseLow => "Cz⁺, low limb".to_owned(),
        Kind::Ax => "−Ax".to_owned(),
        Kind::Ay => "−Ay".to_owned(),
        Kind::Layer(layer) => format!("weights {}", layer + 1),
        Kind::Mask => "weights of the mask".to_owned(),
        Kind::Bias(layer) => format!("biases {}", layer + 1),
    }
}

fn operand(formats: &Formats, product: &Product) -> String {
    let mu = |axis| if axis == Axis::X { "μ1" } else { "μ2" };
    let own = match product.operand {
        Operand::InputHigh => "b, high limb".to_owned(),
        Operand::InputLow => "b, low limb".to_owned(),
        Operand::Vector(index) => vector(formats, index),
        Operand::Layer(layer) => format!("images of layer {}", layer + 1),
        Operand::Window => "window".to_owned(),
        Operand::Mask => "mask of the window".to_owned(),
        Operand::Shear(_, axis) => format!("{} ∘ p", mu(axis)),
        Operand::One => "1".to_owned(),
    };
    let own = product.factor.map_or_else(|| own.clone(), |axis| format!("{} {own}", mu(axis)));
    if product.transposed {
        own + ", x and y exchanged"
    } else {
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::Model;
    use crate::spec::scene::Scene;

    /// Every product of every accumulation is in the program once per group of rows, and every word of the coefficient
    /// memory is read.
    #[test]
    fn every_coefficient_is_read() {
        for name in ["eight-by-eight", "sensor-1-noisy", "eight-by-eight-contacts", "sensor-4"] {
            let model = Model::new(&Scene::builtin(name).unwrap()).unwrap();
            let listed = listing(&model);
            let words: usize = model.cases().iter().map(|case| case.storage.words()).sum();
            let mut read = vec![false; words];
            for own in &listed {
                read[own.coefficients..][..own.cycles].fill(true);
            }
            assert!(read.iter().all(|word| *word), "{name}");
            let sections: Vec<usize> = listed.iter().filter(|own| own.step == 0).map(|own| own.coefficients).collect();
            assert_eq!(sections.len(), if name.ends_with("contacts") { 3 } else { model.cases().len() }, "{name}");
        }
    }

    #[test]
    fn an_instruction_is_named_as_the_equations_are() {
        let of = |scene: &str, result: &str| -> Vec<String> {
            let model = Model::new(&Scene::builtin(scene).unwrap()).unwrap();
            let own = listing(&model).into_iter().filter(|own| own.result == result && own.group == 0);
            own.map(|own| format!("{} · {}", own.matrix, own.operand)).collect()
        };
        assert_eq!(of("eight-by-eight", "v_11"), ["−Ay · v_10", "−Ax · v_01"]);
        // Square taxels in a square subarray: Ay is Ax transposed.
        let mut square = Scene::builtin("sensor-4").unwrap();
        square.partition.case = crate::spec::partition::Case::numbered(1).unwrap();
        let listed = listing(&Model::new(&square).unwrap());
        assert!(listed.iter().any(|own| own.result == "v_01" && own.operand == "v_00, x and y exchanged"));
        let model = Model::new(&Scene::builtin("eight-by-eight-contacts").unwrap()).unwrap();
        let listed = listing(&model);
        let step: Vec<&str> = listed.iter().filter(|own| own.result == "p").map(|own| own.operand.as_str()).collect();
        assert_eq!(step, ["μ1 ∘ p", "μ2 ∘ p"].repeat(step.len() / 2));
    }
}
