//! Stage `prepare`: calibration and averaging before `receive`; options that the scene does not use are wires.

use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use crate::primitives::{Average, Calibrate};
use crate::wire::Wire;

/// Codes in, words of the frame buffer out.
#[derive(LogicBlock)]
pub struct Prepare {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// A taxel's code, `code_bits` wide, two's complement; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A taxel's word, `input_bits` wide, two's complement; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The word is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    /// Number of frames in a sliding mean; valid with `m_axis_tvalid`. Otherwise one bit, 0.
    pub frames: Wire<Out>,
    /// Zero and gain of each taxel.
    pub calibrate: Calibrate,
    average: Average,
}

impl Prepare {
    /// With the input options of `model`.
    pub fn new(model: &Model) -> Self {
        let (formats, taxels) = (model.formats(), model.scene.sensor.taxels());
        let bits = formats.code_bits as usize;
        let average = Average::new(taxels, bits, model.prepare.average, model.prepare.mean);
        Prepare {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(bits),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(formats.input_bits as usize),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            frames: Wire::new(average.frames.width()),
            calibrate: Calibrate::new(&model.prepare, taxels, bits),
            average,
        }
    }
}

impl Logic for Prepare {
    #[hdl_gen]
    fn update(&mut self) {
        self.calibrate.clk.next = self.clk.val();
        self.calibrate.rst.next = self.rst.val();
        self.average.clk.next = self.clk.val();
        self.average.rst.next = self.rst.val();
        self.calibrate.s_axis_tdata.next = self.s_axis_tdata.val();
        self.calibrate.s_axis_tvalid.next = self.s_axis_tvalid.val();
        self.calibrate.s_axis_tlast.next = self.s_axis_tlast.val();
        self.s_axis_tready.next = self.calibrate.s_axis_tready.val();
        self.average.s_axis_tdata.next = self.calibrate.m_axis_tdata.val();
        self.average.s_axis_tvalid.next = self.calibrate.m_axis_tvalid.val();
        self.average.s_axis_tlast.next = self.calibrate.m_axis_tlast.val();
        self.calibrate.m_axis_tready.next = self.average.s_axis_tready.val();
        self.m_axis_tdata.next = self.average.m_axis_tdata.val();
        self.m_axis_tvalid.next = self.average.m_axis_tvalid.val();
        self.m_axis_tlast.next = self.average.m_axis_tlast.val();
        self.average.m_axis_tready.next = self.m_axis_tready.val();
        self.frames.next = self.average.frames.val();
    }
}
