//! The array, row by row, and where each taxel lives.

use dermis_golden::fixed::quads::Quads;
use dermis_golden::partition::Grid;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::{Counter, Mirror};
use crate::wire::Wire;

/// Counts the taxels of the whole array row-major, one per `enable`, across all subarrays; `last` at the array's last taxel.
#[derive(LogicBlock)]
pub struct Scan {
    /// Clock.
    pub clk: Signal<In, Clock>,
    /// Back to the first taxel.
    pub clear: Signal<In, Bit>,
    /// Next taxel.
    pub enable: Signal<In, Bit>,
    /// The taxel is the array's last.
    pub last: Signal<Out, Bit>,
    /// Its quad's address in the array.
    pub address: Wire<Out>,
    /// Its subarray.
    pub part: Wire<Out>,
    /// The lane it is read from.
    pub lane: Wire<Out>,
    /// The lanes it is written to.
    pub mask: Wire<Out>,
    col: Counter,
    part_col: Counter,
    row: Counter,
    part_row: Counter,
    mirror: Mirror,
    line_end: Signal<Local, Bit>,
    part_end: Signal<Local, Bit>,
}

impl Scan {
    /// An array of `parts` subarrays of `layout`.
    pub fn new(layout: Quads, parts: Grid) -> Self {
        let count = parts.rows * parts.cols;
        Scan {
            clk: Default::default(),
            clear: Default::default(),
            enable: Default::default(),
            last: Default::default(),
            address: Wire::new(count_bits(count * layout.len())),
            part: Wire::new(count_bits(count)),
            lane: Wire::new(2),
            mask: Wire::new(4),
            col: Counter::new(layout.cols),
            part_col: Counter::new(parts.cols),
            row: Counter::new(layout.rows),
            part_row: Counter::new(parts.rows),
            mirror: Mirror::new(layout, parts),
            line_end: Default::default(),
            part_end: Default::default(),
        }
    }
}

impl Logic for Scan {
    #[hdl_gen]
    fn update(&mut self) {
        self.col.clk.next = self.clk.val();
        self.part_col.clk.next = self.clk.val();
        self.row.clk.next = self.clk.val();
        self.part_row.clk.next = self.clk.val();
        self.col.clear.next = self.clear.val();
        self.part_col.clear.next = self.clear.val();
        self.row.clear.next = self.clear.val();
        self.part_row.clear.next = self.clear.val();

        self.line_end.next = self.enable.val() & self.col.last.val() & self.part_col.last.val();
        self.part_end.next = self.line_end.val() & self.row.last.val();
        self.col.enable.next = self.enable.val();
        self.part_col.enable.next = self.enable.val() & self.col.last.val();
        self.row.enable.next = self.line_end.val();
        self.part_row.enable.next = self.part_end.val();
        self.last.next =
            self.col.last.val() & self.part_col.last.val() & self.row.last.val() & self.part_row.last.val();

        self.mirror.row.next = self.row.value.val();
        self.mirror.col.next = self.col.value.val();
        self.mirror.part_row.next = self.part_row.value.val();
        self.mirror.part_col.next = self.part_col.value.val();
        self.address.next = self.mirror.address.val();
        self.part.next = self.mirror.part.val();
        self.lane.next = self.mirror.lane.val();
        self.mask.next = self.mirror.mask.val();
    }
}
