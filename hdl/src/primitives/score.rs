//! Sparse objective over one sweep: Σ log2(|p| + ⌊Σp / 2^20⌋) for nine candidates in parallel.

use dermis_golden::fixed::formats::{Formats, EPSILON_SHIFT};
use dermis_golden::fixed::search::log2;
use rust_hdl::prelude::*;

use super::logarithm::{functions, located_bits, LOG_BITS};
use crate::wire::{Wire, Word};

/// Values of a quad's four taxels and Σp in; `totals` of all valid quads since the `first`, [`LATENCY`] cycles later.
///
/// One cycle each: magnitude; addition of ε Σp (0 for Σp < 0: such a candidate is not eligible); first half of the
/// logarithm; second half and table; sum of the counted lanes; accumulation.
#[derive(LogicBlock)]
pub struct Score {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// `values`, `mask` and `sums` belong to a quad.
    pub valid: Signal<In, Bit>,
    /// The quad is the sweep's first: the totals restart.
    pub first: Signal<In, Bit>,
    /// Counted lanes, one bit each; valid with `valid`.
    pub mask: Wire<In>,
    /// Nine values per lane, `search_bits[0]` each, signed, field 9·lane + k; valid with `valid`.
    pub values: Wire<In>,
    /// Σp of the nine candidates, `sum_bits[0]` each, signed; valid with `valid`.
    pub sums: Wire<In>,
    /// Nine totals, `score_bits` each, 2^−6; constant until the next valid quad.
    pub totals: Wire<Out>,
    _pipe: Vec<Option<(bool, [i64; 9])>>,
}

/// Cycles from a quad to the totals that contain it.
pub const LATENCY: usize = 6;

impl Score {
    /// With the widths of `formats`.
    pub fn new(formats: &Formats) -> Self {
        Score {
            clk: Default::default(),
            valid: Default::default(),
            first: Default::default(),
            mask: Wire::new(4),
            values: Wire::new(36 * formats.search_bits[0] as usize),
            sums: Wire::new(9 * formats.sum_bits[0] as usize),
            totals: Wire::new(9 * formats.score_bits as usize),
            _pipe: vec![None; LATENCY - 1],
        }
    }

    fn widths(&self) -> (usize, usize, usize) {
        (self.values.width() / 36, self.sums.width() / 9, self.totals.width() / 9)
    }
}

impl Logic for Score {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let (v, s, t) = self.widths();
            let logs = self.valid.val().then(|| {
                let logs = std::array::from_fn(|k| {
                    let epsilon = self.sums.val().signed(k, s).max(0) >> EPSILON_SHIFT;
                    (0..4)
                        .filter(|&lane| self.mask.val().field(lane, 1) == 1)
                        .map(|lane| log2(self.values.val().signed(9 * lane + k, v).abs() + epsilon))
                        .sum()
                });
                (self.first.val(), logs)
            });
            self._pipe.push(logs);
            if let Some((first, added)) = self._pipe.remove(0) {
                let before = |k| if first { 0 } else { self.totals.val().signed(k, t) };
                let totals: [i64; 9] = std::array::from_fn(|k| before(k) + added[k]);
                self.totals.next = Word::of_fields(&totals, t);
            }
        }
    }

    fn connect(&mut self) {
        self.totals.connect();
    }

    fn hdl(&self) -> Verilog {
        let (v, s, t) = self.widths();
        let shift = EPSILON_SHIFT as usize;
        // With small arrays and short words ε Σp is always 0.
        let e = (s - 1).saturating_sub(shift).max(1);
        let x = v.max(e) + 1;
        let lane_sum = LOG_BITS + 2;
        let pad = |bits: usize| match bits {
            0 => String::new(),
            _ => format!("{bits}'d0, "),
        };
        Verilog::Custom(format!(
            "\
{functions}reg [4:0] valids, firsts;
reg [15:0] masks;
always @(posedge clk) begin
  valids <= {{valids[3:0], valid}};
  firsts <= {{firsts[3:0], first}};
  masks <= {{masks[11:0], mask}};
end
genvar k, l;
generate
  for (k = 0; k < 9; k = k + 1) begin : candidate
    reg [{e_end}:0] epsilon;
    always @(posedge clk) epsilon <= {epsilon};
    wire unused = &{{1'b0, sums[k * {s} +: {below}]}};
    wire [{logs_end}:0] logs;
    reg [{lane_sum_end}:0] together;
    for (l = 0; l < 4; l = l + 1) begin : lane
      wire [{v_end}:0] value = values[(9 * l + k) * {v} +: {v}];
      reg [{v_end}:0] magnitude;
      reg [{x_end}:0] argument;
      reg [{located_end}:0] located;
      reg [{log_end}:0] log;
      always @(posedge clk) begin
        magnitude <= value[{v_end}] ? -value : value;
        argument <= {{{pad_v}magnitude}} + {{{pad_e}epsilon}};
        located <= locate(argument);
        log <= logarithm(located);
      end
      assign logs[l * {log_bits} +: {log_bits}] = masks[12 + l] ? log : {log_bits}'d0;
    end
    always @(posedge clk) begin
      together <= {{2'd0, logs[0 +: {log_bits}]}} + {{2'd0, logs[{log_bits} +: {log_bits}]}}
        + {{2'd0, logs[{log2} +: {log_bits}]}} + {{2'd0, logs[{log3} +: {log_bits}]}};
      if (valids[4])
        totals[k * {t} +: {t}] <= (firsts[4] ? {t}'d0 : totals[k * {t} +: {t}]) + {together};
    end
  end
endgenerate",
            functions = functions(x),
            epsilon = match s - 1 > shift {
                true => format!("sums[(k + 1) * {s} - 1] ? {e}'d0 : sums[k * {s} + {shift} +: {e}]"),
                false => "1'd0".to_string(),
            },
            below = if s - 1 > shift { shift } else { s },
            e_end = e - 1,
            logs_end = 4 * LOG_BITS - 1,
            lane_sum_end = lane_sum - 1,
            v_end = v - 1,
            x_end = x - 1,
            located_end = located_bits(x) - 1,
            log_end = LOG_BITS - 1,
            log_bits = LOG_BITS,
            log2 = 2 * LOG_BITS,
            log3 = 3 * LOG_BITS,
            pad_v = pad(x - v),
            pad_e = pad(x - e),
            together = match t.checked_sub(lane_sum) {
                Some(0) => "together".to_string(),
                Some(more) => format!("{{{more}'d0, together}}"),
                None => format!("together[{}:0]", t - 1),
            },
        ))
    }
}
