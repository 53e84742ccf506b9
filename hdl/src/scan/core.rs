//! Top module of a scan: sequencer, capture, engine, status; with writable tables, the way of their images, and codes behind the
//! forces.

use dermis_golden::fixed::plan::resources::count_bits;
use dermis_golden::fixed::Model;

use super::{ScanCapture, ScanCodes, ScanParams, ScanSequencer, ScanStatus, ScanTables};
use crate::block;
use crate::engine::Engine;
use crate::error::HdlError;
use crate::language::{kernel_of, Block, Builder, Hierarchy, Inside, Net};
use crate::primitives::{Dff, Stream};
use crate::streams::BEAT_BITS;

block! {
    /// An engine that reads the converters of its array by itself.
    pub struct ScanCore {
        params: ScanParams,
        engine: Engine,
        /// Beats of forces in a frame.
        forces: usize,
        /// The images of tables and the codes in the output, where tables are written.
        tables: Option<Tables>,
    }
    ports ScanCorePorts {
        clock;
        reset;
        /// A scan may begin; high to scan all the time.
        in enable;
        /// A byte of an image of tables, as a beat of the engine's stream; valid with `s_axis_tvalid`.
        sink<Stream> s_axis: tables.as_ref().map_or(0, |_| engine.widths().s_axis.data);
        /// Address of the row that is driven, unsigned; valid after the reset.
        out row: count_bits(params.rows);
        /// Serial clock of all converters.
        out adc_sclk;
        /// Chip select of all converters, active low.
        out adc_cs_n;
        /// Commands to all converters.
        out adc_mosi;
        /// Outputs of the converters, one bit each; valid while `adc_cs_n` is low.
        in adc_miso: params.scan.converters;
        /// `{fz, fy, fx}`, 32 bits signed each, or a status beat; valid with `m_axis_tvalid`.
        source<Stream> m_axis: BEAT_BITS;
    }
}

/// What a scan with written tables has besides.
struct Tables {
    tables: ScanTables,
    codes: ScanCodes,
}

impl ScanCore {
    /// The scan and the engine of the scene of `model`.
    ///
    /// # Errors
    /// [`HdlError::Unsupported`] where codes come as a stream.
    pub fn new(model: &Model) -> Result<Self, HdlError> {
        let params = ScanParams::of(model)?;
        let code_bits = params.code_bits as usize;
        let tables = || Tables {
            tables: ScanTables::new(code_bits),
            codes: ScanCodes::new(model.scene.sensor.taxels(), code_bits),
        };
        let tables = model.has_writable_tables().then(tables);
        Ok(ScanCore { params, engine: Engine::new(model), forces: model.force_beats(), tables })
    }
}

impl Block for ScanCore {
    fn build<'k>(&'k self, k: &'k Builder, io: ScanCorePorts<Inside<'k>>) {
        let tables = self.tables.as_ref().map(|tables| k.instance("tables", &tables.tables));
        let codes = self.tables.as_ref().map(|tables| k.instance("codes", &tables.codes));
        let restart = k.instance("restart", Dff {});
        let sequencer = k.instance("sequencer", ScanSequencer::new(&self.params));
        let capture = k.instance("capture", ScanCapture::new(&self.params));
        let engine = k.instance("engine", &self.engine);
        let scan_status = k.instance("scan_status", ScanStatus::new(self.forces));
        k.comment("Registered, because the engine is large and its reset has a long route.");
        restart.d.set(io.rst);
        let restarts = [&sequencer.rst, &capture.rst, &engine.rst, &scan_status.rst];
        let of_tables: Vec<&Net> =
            tables.iter().map(|tables| &tables.rst).chain(codes.iter().map(|codes| &codes.rst)).collect();
        restarts.into_iter().chain(of_tables).for_each(|rst| rst.set(restart.q));

        k.comment("Scan");
        sequencer.clear.set(capture.clear);
        let room = scan_status.room & io.enable;
        sequencer.room.set(codes.as_ref().map_or(room, |codes| room & codes.room));
        io.row.set(sequencer.row);
        io.adc_sclk.set(sequencer.sclk);
        io.adc_cs_n.set(sequencer.cs_n);
        io.adc_mosi.set(sequencer.mosi);
        capture.miso.set(io.adc_miso);
        capture.take.set(sequencer.take);
        capture.done.set(sequencer.done);
        capture.result.set(sequencer.result);
        capture.opens.set(sequencer.opens);
        capture.closes.set(sequencer.closes);
        capture.ends.set(sequencer.ends);
        capture.channel.set(sequencer.channel);
        capture.alive.set(sequencer.alive);

        k.comment("Codes to the engine");
        match &tables {
            Some(tables) => {
                tables.code.set(capture.m_axis.data);
                tables.code_valid.set(capture.m_axis.valid);
                tables.code_last.set(capture.m_axis.last);
                capture.m_axis.ready.set(tables.code_ready);
                io.s_axis.connect(&tables.s_axis);
                tables.m_axis.connect(&engine.s_axis);
            }
            None => capture.m_axis.connect(&engine.s_axis),
        }

        k.comment("Forces, and marks in the status");
        scan_status.complete.set(tables.as_ref().map_or(capture.complete, |tables| tables.complete));
        scan_status.rail.set(capture.rail);
        scan_status.other.set(capture.other);
        engine.m_axis.connect(&scan_status.s_axis);
        match tables.as_ref().zip(codes.as_ref()) {
            Some((tables, codes)) => {
                k.unused([capture.complete]);
                codes.code.set(capture.m_axis.data);
                codes.passed.set(tables.passed);
                codes.complete.set(tables.complete);
                codes.broken.set(tables.broken);
                scan_status.m_axis.connect(&codes.s_axis);
                codes.m_axis.connect(&io.m_axis);
            }
            None => scan_status.m_axis.connect(&io.m_axis),
        }
    }
}

/// The top module of `model`, checked.
///
/// # Errors
/// As [`ScanCore::new`].
pub(super) fn scanner(model: &Model) -> Result<Hierarchy, HdlError> {
    let hierarchy = Hierarchy::of_kernel(kernel_of(&ScanCore::new(model)?));
    hierarchy.check()?;
    Ok(hierarchy)
}
