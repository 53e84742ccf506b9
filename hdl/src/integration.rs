//! Files for an integrator, beside the generated hardware: testbench, FuseSoC core file, script for Vivado.

use dermis_golden::fixed::Model;
use dermis_golden::spec::board::Family;

use crate::core_file::core_file;
use crate::generate::Generated;
use crate::manifest::GeneratedFile;
use crate::testbench::testbench;
use crate::vivado;

impl Generated {
    /// Adds the files for an integrator: `<top>_tb.sv` with its memory files, `<top>.core`, and `<top>_vivado.tcl` for a
    /// device of Xilinx.
    pub fn add_integration(&mut self, model: &Model) {
        let (top, scene) = (self.top.clone(), &model.scene.name);
        self.add_core_file(model, testbench(model, &top, &self.files));
        if model.board.family == Family::Artix7 {
            let text = vivado::script(&top, scene, &model.board);
            self.files.push(GeneratedFile { name: format!("{top}_vivado.tcl"), text });
        }
        self.seal();
    }

    /// Adds the files of a testbench and the FuseSoC core file; not sealed.
    pub(crate) fn add_core_file(&mut self, model: &Model, bench: Vec<GeneratedFile>) {
        let (top, scene) = (&self.top, &model.scene.name);
        let names = |files: &[GeneratedFile]| files.iter().map(|file| file.name.clone()).collect::<Vec<_>>();
        let core = core_file(top, scene, model.board.family, &names(&self.files), &names(&bench));
        let name = format!("{top}.core");
        self.files.extend(bench);
        self.files.push(GeneratedFile { name, text: core });
    }
}
