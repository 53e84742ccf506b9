//! Scenes with several partition cases: one [`Model`] per case on shared hardware, and the choice between them per
//! frame.
//!
//! All cases use the lanes, the search and the force unit of case 0. A case adds counter limits, addresses, its
//! coefficients in the shared memory and a frame buffer. The result of a frame is to the bit that of the chosen case's
//! model; [`choose`](crate::fixed::stages::choose) chooses it.
//!
//! Where the scene lists no cases, the largest set of cases that fits the board is built, and of equally large sets the
//! one with the finest cases. A case left out is kept in [`Dropped`] with the resources of a design that includes it.

use super::cycles::SHORTEST_SWEEP;
use crate::board::Board;
use crate::fixed::model::{FixedError, Model, Stage, Trace};
use crate::fixed::stages::choose::{self, FrameStats};
use crate::fixed::stages::prepare::Scale;
use crate::fixed::stages::send::CASE_SHIFT;
use crate::fixed::words::formats::{derive, Shape};
use crate::frame::Frame;
use crate::matrices::{Matrices, MAX_DEGREE};
use crate::partition::{subarrays, Case, Grid, Subarray};
use crate::reconstruct::{CaseChoice, Reconstruction};
use crate::scene::Scene;
use crate::symmetry::quads::Quads;

/// A case that divides the array but was left out, because a design with it exceeds the board.
#[derive(Clone, Debug)]
pub struct Dropped {
    /// The case left out.
    pub case: Case,
    /// The design of the cases built and this one.
    pub design: Model,
}

impl Model {
    /// The model of the cases that the scene lists, else of as many cases as fit the board, else of case 0 alone.
    pub(in crate::fixed) fn of_choices(
        scene: &Scene,
        scale: &Scale,
        degree: Option<usize>,
        board: &Board,
    ) -> Result<Model, FixedError> {
        let listed = scene.partition.listed.is_some();
        let mut choices = scene.partition.choices(&scene.sensor);
        // A case with too few quads is an error only where the scene lists it or no other is left.
        let large: Vec<Case> = choices.iter().copied().filter(|&case| is_large(scene, case)).collect();
        if !listed && large.len() > 1 {
            choices = large;
        }
        let short = |model: &Model| model.resources.shortages(&model.board);
        // If case 0 alone exceeds the board, so does every set of cases, since all contain it.
        let whole = shape(scene, Case::WHOLE, degree)?;
        if !listed {
            let alone = Model::of_shapes(scene, scale, board, vec![(Case::WHOLE, whole.clone())])?;
            if !short(&alone).is_empty() {
                return Ok(alone);
            }
        }
        let mut shapes = vec![whole];
        for &case in &choices[1..] {
            shapes.push(shape(scene, case, degree)?);
        }
        let all: Vec<usize> = (0..choices.len()).collect();
        let of = |subset: &[usize]| -> Result<Model, FixedError> {
            let pick = |&at: &usize| (choices[at], shapes[at].clone());
            Model::of_shapes(scene, scale, board, subset.iter().map(pick).collect())
        };
        if listed {
            return of(&all);
        }
        let mut model = None;
        for subset in subsets(choices.len()) {
            let built = of(&subset)?;
            let fits = short(&built).is_empty();
            model = Some((built, subset));
            if fits {
                break;
            }
        }
        let (mut model, subset) = model.ok_or(FixedError::Internal("no set of two cases to build"))?;
        // If no two cases fit, the last set tried is returned, and [`Model::new`] reports what the board lacks.
        if short(&model).is_empty() {
            for &at in all.iter().filter(|at| !subset.contains(at)) {
                let with: Vec<usize> = all.iter().copied().filter(|k| subset.contains(k) || *k == at).collect();
                model.dropped.push(Dropped { case: choices[at], design: of(&with)? });
            }
        }
        Ok(model)
    }

    /// The model of `cases`; where there are several, case 0 is the first.
    pub(in crate::fixed) fn of_shapes(
        scene: &Scene,
        scale: &Scale,
        board: &Board,
        cases: Vec<(Case, Shape)>,
    ) -> Result<Model, FixedError> {
        let (cases, shapes): (Vec<Case>, Vec<Shape>) = cases.into_iter().unzip();
        let own = |case: Case| {
            let mut scene = scene.clone();
            scene.partition.case = case;
            scene
        };
        let designs = derive(scene, &shapes, board)?;
        let several = designs.len() > 1;
        let mut models = Vec::with_capacity(designs.len());
        for (&case, design) in cases.iter().zip(designs) {
            if several && !is_large(scene, case) {
                return Err(FixedError::SmallCase { case, quads: design.formats.quads });
            }
            models.push(Model::of_design(&own(case), scale, design, board)?);
        }
        if !several {
            return models.pop().ok_or(FixedError::Internal("no case to build"));
        }
        let whole = models[0].clone();
        Ok(Model { scene: scene.clone(), built: models, ..whole })
    }

    /// The models of the cases built, case 0 first; for a scene with one case, this model alone.
    pub fn cases(&self) -> &[Model] {
        match self.built.is_empty() {
            true => std::slice::from_ref(self),
            false => &self.built,
        }
    }

    /// Whether the hardware has several cases and chooses one per frame.
    pub fn chooses(&self) -> bool {
        !self.built.is_empty()
    }

    /// The paper's number of the case, 0 to 3; 0 for a partition that the paper does not number.
    pub fn number(&self) -> u32 {
        (0..4).find(|&number| Case::numbered(number) == Some(self.scene.partition.case)).unwrap_or(0) as u32
    }

    /// Subarrays along rows and columns of each case built, in the order of [`Model::cases`].
    pub fn grids(&self) -> Vec<Grid> {
        self.cases().iter().map(Model::grid).collect()
    }

    /// Index in [`Model::cases`] of the case chosen for a frame of `codes`: one per taxel, row-major, `input_bits`
    /// wide.
    pub fn choose(&self, codes: &[i32]) -> usize {
        let mut seen = FrameStats::default();
        for (index, &code) in codes.iter().enumerate() {
            seen.add(&self.scene.sensor, index, code, self.noise_floor);
        }
        seen.choose(&self.grids(), self.scene.partition.condition, self.noise_floor)
    }

    /// [`Model::run`] for a scene with several cases.
    pub(in crate::fixed) fn run_chosen(&self, codes: &[i32]) -> Trace {
        let chosen = self.choose(&self.prepare.run(codes));
        let case = &self.built[chosen];
        let mut trace = case.run(codes);
        let words = vec![vec![chosen as i64]];
        trace.stages.insert(1, Stage { name: "choose", words });
        for beat in trace.status.iter_mut().step_by(crate::fixed::stages::send::STATUS_BEATS) {
            beat[2] |= (case.number() << CASE_SHIFT) as i32;
        }
        let cycles = &mut trace.cycles;
        for count in [&mut cycles.first_output, &mut cycles.latency, &mut cycles.total] {
            *count += choose::LATENCY;
        }
        trace
    }

    /// [`Model::decode`] for a scene with several cases.
    pub(in crate::fixed) fn decode_chosen(
        &self,
        readings: &[Frame],
        engine: &str,
        beats: &[[i32; 3]],
        status: &[[i32; 3]],
    ) -> Result<Reconstruction, FixedError> {
        let number = status.first().map_or(0, |beat| beat[2] as u32 >> CASE_SHIFT & 3);
        let case = self.built.iter().find(|case| case.number() == number);
        let case = case.ok_or(FixedError::Internal("the status names a case that was not built"))?;
        let mut result = case.decode(readings, engine, beats, status)?;
        let reason = "the finest whose boundaries cut nothing, by the hardware's rule".to_string();
        let case = case.scene.partition.case.to_string();
        result.extra.taken = Some(CaseChoice { case, reason, refused: Vec::new() });
        Ok(result)
    }
}

/// The subarrays of a case and their matrices; the polynomial has `degree` if given, else the degree that the series
/// needs.
pub(in crate::fixed) fn shape(scene: &Scene, case: Case, degree: Option<usize>) -> Result<Shape, FixedError> {
    let parts = subarrays(case, &scene.sensor)?;
    // Scenes with dead taxels have a single subarray.
    let dead = parts[0].local_indices(&scene.input.dead);
    let mut matrices = Matrices::of(scene, &parts[0].sensor(&scene.sensor), MAX_DEGREE)?.without(&dead)?;
    matrices.degree = degree.unwrap_or(matrices.degree);
    Ok(Shape { matrices, parts: parts.len() })
}

/// Whether every subarray has the [`SHORTEST_SWEEP`] quads that a search shared by several cases needs.
fn is_large(scene: &Scene, case: Case) -> bool {
    let quads = |part: &Subarray| Quads { rows: part.rows, cols: part.cols }.len() as u64;
    subarrays(case, &scene.sensor).is_ok_and(|parts| parts.iter().all(|part| quads(part) >= SHORTEST_SWEEP))
}

/// All subsets of `count` cases with case 0 and at least one other, as indices: the largest first, then those with the
/// finest cases.
fn subsets(count: usize) -> Vec<Vec<usize>> {
    let of = |bits: usize| std::iter::once(0).chain((1..count).filter(move |k| bits >> k & 1 == 1));
    let mut all: Vec<Vec<usize>> = (2..1usize << count).step_by(2).map(|bits| of(bits).collect()).collect();
    all.sort_by(|a, b| b.len().cmp(&a.len()).then(a.cmp(b)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_subsets_come_first() {
        assert_eq!(subsets(2), [vec![0, 1]]);
        let four = subsets(4);
        assert_eq!(four.len(), 7);
        assert_eq!(four[..3], [vec![0, 1, 2, 3], vec![0, 1, 2], vec![0, 1, 3]]);
        assert_eq!(four[6], [0, 3]);
    }
}
