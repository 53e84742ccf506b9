//! The engine inside a rust-hdl design, in rust-hdl's own simulation, against the bit-true model.
//!
//! `cargo run --release --example rust_hdl [SCENE]` sends one frame to the engine of a scene and compares every beat.

use std::sync::mpsc;

use dermis_golden::fixed::Model;
use dermis_golden::spec::scene::Scene;
use dermis_hdl::engine::Engine;
use dermis_hdl::language::RustHdl;
use dermis_hdl::wire::{Wire, Word};
use rust_hdl::prelude::*;

/// A design of rust-hdl with an engine of Dermis in it.
#[derive(LogicBlock)]
struct Skin {
    clock: Signal<In, Clock>,
    reset: Signal<In, Bit>,
    code: Wire<In>,
    code_valid: Signal<In, Bit>,
    code_last: Signal<In, Bit>,
    code_ready: Signal<Out, Bit>,
    beat: Wire<Out>,
    beat_valid: Signal<Out, Bit>,
    beat_last: Signal<Out, Bit>,
    engine: RustHdl<Engine>,
}

impl Skin {
    fn new(model: &Model) -> Self {
        let engine = RustHdl::new(Engine::new(model));
        Skin {
            clock: Default::default(),
            reset: Default::default(),
            code: Wire::new(engine.s_axis.data.width()),
            code_valid: Default::default(),
            code_last: Default::default(),
            code_ready: Default::default(),
            beat: Wire::new(engine.m_axis.data.width()),
            beat_valid: Default::default(),
            beat_last: Default::default(),
            engine,
        }
    }
}

impl Logic for Skin {
    #[hdl_gen]
    fn update(&mut self) {
        self.engine.clk.next = self.clock.val();
        self.engine.rst.next = self.reset.val();
        self.engine.s_axis.data.next = self.code.val();
        self.engine.s_axis.valid.next = self.code_valid.val();
        self.engine.s_axis.last.next = self.code_last.val();
        self.code_ready.next = self.engine.s_axis.ready.val();
        self.beat.next = self.engine.m_axis.data.val();
        self.beat_valid.next = self.engine.m_axis.valid.val();
        self.beat_last.next = self.engine.m_axis.last.val();
        self.engine.m_axis.ready.next = true;
    }
}

/// The beats with which the engine of `model` answers `codes` in rust-hdl's simulation.
fn beats(model: &Model, codes: &[i32]) -> Result<Vec<[i32; 3]>, SimError> {
    let mut design = Skin::new(model);
    design.connect_all();
    let (sender, beats) = mpsc::channel();
    let codes: Vec<i64> = codes.iter().copied().map(i64::from).collect();
    let mut simulation: Simulation<Skin> = Simulation::new();
    simulation.add_clock(5, |design: &mut Box<Skin>| design.clock.next = !design.clock.val());
    simulation.add_testbench(move |mut sim: Sim<Skin>| {
        let mut design = sim.init()?;
        design.reset.next = true;
        wait_clock_cycles!(sim, clock, design, 2);
        wait_clock_false!(sim, clock, design);
        design.reset.next = false;
        let mut sent = 0;
        loop {
            // Inputs change while the clock is low; outputs are sampled before it rises.
            let code = codes.get(sent).copied();
            design.code.next = Word::of_fields(&[code.unwrap_or_default()], design.code.width()).into();
            design.code_valid.next = code.is_some();
            design.code_last.next = sent + 1 == codes.len();
            design = sim.wait(1, design)?;
            sent += usize::from(code.is_some() && design.code_ready.val());
            if design.beat_valid.val() {
                let beat = design.beat.val().word();
                let _ = sender.send([0, 1, 2].map(|word| beat.signed(word, 32) as i32));
                if design.beat_last.val() {
                    return sim.done(design);
                }
            }
            wait_clock_true!(sim, clock, design);
            wait_clock_false!(sim, clock, design);
        }
    });
    simulation.run(Box::new(design), u64::MAX)?;
    Ok(beats.into_iter().collect())
}

/// A paraboloid over the array, half of the full scale at its top.
fn frame(model: &Model) -> Vec<i32> {
    let sensor = &model.scene.sensor;
    let half = (1i64 << (model.formats().code_bits - 2)) - 1;
    let bow = |at: usize, count: usize| (4 * at * (count - at) / count / count.div_ceil(2).max(1)) as i64;
    let top = (bow(sensor.rows / 2, sensor.rows) * bow(sensor.cols / 2, sensor.cols)).max(1);
    let code =
        |taxel: usize| half * bow(taxel / sensor.cols, sensor.rows) * bow(taxel % sensor.cols, sensor.cols) / top;
    (0..sensor.taxels()).map(|taxel| code(taxel) as i32).collect()
}

/// Compares one frame; the number of beats.
fn compare(scene: &Scene) -> Result<usize, Box<dyn std::error::Error>> {
    let model = Model::new(scene)?;
    let codes = frame(&model);
    let trace = model.run(&codes);
    let expected: Vec<[i32; 3]> = trace.beats.iter().chain(&trace.status).copied().collect();
    let found = beats(&model, &codes).map_err(|error| format!("rust-hdl: {error:?}"))?;
    if let Some(at) = (0..expected.len().max(found.len())).find(|&at| found.get(at) != expected.get(at)) {
        return Err(format!("beat {at} is {:?}, expected {:?}", found.get(at), expected.get(at)).into());
    }
    Ok(found.len())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "eight-by-eight".to_owned());
    let beats = compare(&Scene::load(&name)?)?;
    println!("{name}: {beats} beats of a frame in rust-hdl's simulation, all as the bit-true model says");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_engine_in_a_rust_hdl_design_answers_as_the_model() {
        let text =
            "name = \"small\"\n[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 4.0\npitch_y_mm = 4.0\nthickness_mm = 3.0\n\
                    [search]\nnoise_floor_MPa = 0.0\nmu_max = 0.3\n";
        assert!(compare(&Scene::parse(text, "small.toml").unwrap()).unwrap() > 16);
    }

    /// As the small scene; `make nightly` runs it.
    #[test]
    #[ignore = "slow"]
    fn sensor_1_in_a_rust_hdl_design_answers_as_the_model() {
        compare(&Scene::builtin("sensor-1").unwrap()).unwrap();
    }
}
