//! In the place of stage `search` in a scene without a search: μ is 0 or that of a network, and the values are p.
//!
//! What `unfold` delivers is p itself, with a network after each step of `relax`; the last passes on directly as values; `start` says that all have
//! arrived. Since the force memory is written while the passes run, a frame is not computed before the previous one has
//! been sent.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::SearchPorts;
use crate::kernel_block;
use crate::language::{Body, Builder, Kernel};
use crate::ports::has_ports;

/// The `fill_quad`s of the last vector leave as `values` in the same cycle; `settled`, `values_begin` and `done` are `start` one cycle later.
/// The inputs that only a search needs are unused; the outputs that describe its result are constant 0.
#[derive(dermis_hdl_derive::Block)]
pub struct Unsearched {
    ports: SearchPorts,
    kernel: Body,
}

has_ports!(Unsearched: SearchPorts);

kernel_block!(
    Unsearched,
    ports SearchPorts,
    clock clk,
    inputs [rst, which, fill_which, fill_quad, fill, fill_index, fill_address, start, enabled, ready],
    outputs [
        values, values_valid, settled, values_begin, done, best_x, best_y, score, found, compared, taken, stalled,
    ]
);

impl Unsearched {
    /// With the widths of `model`.
    pub fn new(model: &Model) -> Self {
        Unsearched::with(SearchPorts::new(model), model.formats().vectors())
    }

    fn with(ports: SearchPorts, vectors: usize) -> Self {
        let kernel = kernel(&ports, vectors);
        Unsearched { ports, kernel: Body::default() }.bind(kernel)
    }
}

fn kernel(ports: &SearchPorts, vectors: usize) -> Kernel {
    let k = Builder::new("unsearched");
    let (rst, start) = (k.input("rst", 1), k.input("start", 1));
    k.input("which", ports.which.width());
    k.input("fill_which", ports.fill_which.width());
    let index = k.input("fill_index", ports.fill_index.width());
    k.input("fill_address", ports.fill_address.width());
    k.input("enabled", 1);
    k.input("ready", 1);
    k.wire("values", k.input("fill_quad", ports.fill_quad.width()));
    let fill = k.input("fill", 1);
    k.wire("values_valid", if vectors > 1 { fill & index.is(vectors as u64 - 1) } else { fill });
    let began = k.delay("began", start & !rst);
    for name in ["settled", "values_begin", "done"] {
        k.wire(name, began);
    }
    for (name, bits) in [
        ("best_x", ports.best_x.width()),
        ("best_y", ports.best_y.width()),
        ("score", ports.score.width()),
        ("found", 1),
        ("compared", 1),
        ("taken", 1),
        ("stalled", 1),
    ] {
        k.wire(name, k.constant(bits, 0));
    }
    k.finish()
}

#[cfg(test)]
mod tests {
    use dermis_golden::spec::scene::Scene;

    use super::*;
    use crate::language::testbench::{check, random_words, Reference};
    use crate::wire::Word;

    /// `start` of the cycle before, outside a reset; undefined before the first edge.
    struct Passed {
        began: Option<bool>,
        outputs: Vec<String>,
    }

    impl Reference for Passed {
        fn outputs(&mut self, inputs: &[Word]) -> Vec<Option<Word>> {
            let of = |name: &String| match name.as_str() {
                "values" => Some(inputs[8]),
                "values_valid" => Some(inputs[9]),
                "settled" | "values_begin" | "done" => self.began.map(Word::from),
                _ => Some(Word::default()),
            };
            self.outputs.iter().map(of).collect()
        }

        fn clock(&mut self, inputs: &[Word]) {
            self.began = Some(inputs[1].number() == 1 && inputs[0].number() == 0);
        }
    }

    #[test]
    fn coefficients_pass_on_as_values() {
        let mut scene = Scene::builtin("eight-by-eight").unwrap();
        scene.search.mu_max = 0.0;
        let block = Unsearched::new(&Model::new(&scene).unwrap());
        let kernel = block.kernel.kernel();
        let widths = [
            "rst",
            "start",
            "which",
            "fill_which",
            "fill_index",
            "fill_address",
            "enabled",
            "ready",
            "fill_quad",
            "fill",
        ]
        .map(|name| kernel.signals().find(|(own, _)| *own == name).unwrap().1.bits);
        let outputs = kernel.signals.iter().filter(|signal| signal.output).map(|signal| signal.name.clone()).collect();
        check(kernel, &random_words(1000, &widths), &mut Passed { began: None, outputs });
    }
}
