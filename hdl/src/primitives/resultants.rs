//! Sums per subarray in place of a force per taxel.

use dermis_golden::fixed::formats::FORCE_BITS;
use dermis_golden::fixed::resultants::{beats, BEATS, POSITION_BITS, SUMS, SUM_BITS};
use dermis_golden::partition::Grid;
use dermis_golden::sensor::Sensor;
use rust_hdl::prelude::*;

use super::counter::count_bits;
use super::pass_through::pass_through;
use crate::wire::{Wire, Word};

/// ```text
/// s_axis (forces, row-major; status) --> X fz⁺, Y fz⁺ --> sums of each subarray --> m_axis (sums; status)
/// ```
/// One force is accepted per cycle. The sums start to leave four cycles after the last force, then the status beats
/// pass through. If the scene asks for a force per taxel, the whole stream passes through on wires.
#[derive(LogicBlock)]
pub struct Resultants {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high.
    pub rst: Signal<In, Bit>,
    /// `{fz, fy, fx}` of a taxel, 32 bits signed each, or a status beat; valid with `s_axis_tvalid`.
    pub s_axis_tdata: Wire<In>,
    /// A beat is offered on `s_axis_tdata`; the sender holds it until `s_axis_tready`.
    pub s_axis_tvalid: Signal<In, Bit>,
    /// The block accepts a beat in this cycle.
    pub s_axis_tready: Signal<Out, Bit>,
    /// The beat is the last of its frame; valid with `s_axis_tvalid`.
    pub s_axis_tlast: Signal<In, Bit>,
    /// A beat of sums, or a status beat, 96 bits; valid with `m_axis_tvalid`.
    pub m_axis_tdata: Wire<Out>,
    /// A beat is offered on `m_axis_tdata`; it is held until `m_axis_tready`.
    pub m_axis_tvalid: Signal<Out, Bit>,
    /// The receiver accepts a beat in this cycle.
    pub m_axis_tready: Signal<In, Bit>,
    /// The beat is the last of its frame; valid with `m_axis_tvalid`.
    pub m_axis_tlast: Signal<Out, Bit>,
    _wanted: bool,
    _sensor: Sensor,
    _parts: Grid,
    _state: State,
}

/// Position in the frame.
#[derive(Clone, Debug, Default)]
struct State {
    taxel: usize,
    /// Remaining cycles until the sums are complete.
    settling: usize,
    /// Index of the next beat of sums.
    beat: usize,
    sums: Vec<[i64; SUMS]>,
}

/// Cycles from the last force to complete sums.
const SETTLE: usize = 3;

impl Resultants {
    /// For the array `sensor` divided into `parts`; if sums are not `wanted`, the stream passes through.
    pub fn new(wanted: bool, sensor: &Sensor, parts: Grid) -> Self {
        let beat = 3 * FORCE_BITS as usize;
        Resultants {
            clk: Default::default(),
            rst: Default::default(),
            s_axis_tdata: Wire::new(beat),
            s_axis_tvalid: Default::default(),
            s_axis_tready: Default::default(),
            s_axis_tlast: Default::default(),
            m_axis_tdata: Wire::new(beat),
            m_axis_tvalid: Default::default(),
            m_axis_tready: Default::default(),
            m_axis_tlast: Default::default(),
            _wanted: wanted,
            _sensor: sensor.clone(),
            _parts: parts,
            _state: State { sums: vec![[0; SUMS]; parts.rows * parts.cols], ..State::default() },
        }
    }

    fn counting(&self) -> bool {
        self._wanted && self._state.taxel < self._sensor.taxels()
    }

    fn sending(&self) -> bool {
        self._wanted && !self.counting() && self._state.beat < BEATS * self._state.sums.len()
    }

    fn add(&mut self) {
        let (sensor, parts, taxel) = (&self._sensor, self._parts, self._state.taxel);
        let (row, col) = (taxel / sensor.cols, taxel % sensor.cols);
        let part = row / (sensor.rows / parts.rows) * parts.cols + col / (sensor.cols / parts.cols);
        let [x, y] = dermis_golden::fixed::resultants::half_pitches(sensor, taxel);
        let [fx, fy, fz] = [0, 1, 2].map(|k| self.s_axis_tdata.val().signed(k, FORCE_BITS as usize));
        let pressed = fz.max(0);
        let values = [fx, fy, fz, pressed, x * pressed, y * pressed];
        self._state.sums[part].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        self._state.taxel += 1;
        self._state.settling = SETTLE;
    }

    fn restart(&mut self) {
        let parts = self._state.sums.len();
        self._state = State { sums: vec![[0; SUMS]; parts], ..State::default() };
    }
}

impl Logic for Resultants {
    fn update(&mut self) {
        if self._wanted && self.clk.pos_edge() {
            if self.counting() {
                if self.s_axis_tvalid.val() {
                    self.add();
                }
            } else if self._state.settling > 0 {
                self._state.settling -= 1;
            } else if self.sending() {
                self._state.beat += usize::from(self.m_axis_tready.val());
            } else if self.s_axis_tvalid.val() && self.m_axis_tready.val() && self.s_axis_tlast.val() {
                self.restart();
            }
            if self.rst.val() {
                self.restart();
            }
        }
        let (counting, sending) = (self.counting(), self.sending());
        let passing = !counting && !sending;
        self.s_axis_tready.next = counting || passing && self.m_axis_tready.val();
        self.m_axis_tvalid.next = sending && self._state.settling == 0 || passing && self.s_axis_tvalid.val();
        self.m_axis_tlast.next = passing && self.s_axis_tlast.val();
        self.m_axis_tdata.next = match (sending, self._state.beat) {
            (true, beat) => {
                let words = beats(&self._state.sums[beat / BEATS])[beat % BEATS];
                Word::of_fields(&words.map(i64::from), FORCE_BITS as usize)
            }
            (false, _) => self.s_axis_tdata.val(),
        };
    }

    fn connect(&mut self) {
        self.s_axis_tready.connect();
        self.m_axis_tdata.connect();
        self.m_axis_tvalid.connect();
        self.m_axis_tlast.connect();
    }

    fn hdl(&self) -> Verilog {
        if !self._wanted {
            return pass_through("A force per taxel: the stream passes through.");
        }
        let (sensor, parts) = (&self._sensor, self._parts);
        let count = parts.rows * parts.cols;
        let (rows, cols) = (sensor.rows / parts.rows, sensor.cols / parts.cols);
        let [r, c, pr, pc, p] = [rows, cols, parts.rows, parts.cols, count].map(count_bits);
        let (place, sum) = (POSITION_BITS as usize + 1, SUM_BITS as usize);
        // Sign extension of each sum to 64 bits.
        let more = 64 - sum;
        let wide: Vec<String> =
            (0..SUMS).rev().map(|k| format!("{{{{{more}{{sum{k}[{e}]}}}}, sum{k}}}", e = sum - 1)).collect();
        let each = |text: &dyn Fn(usize) -> String| (0..SUMS).map(text).collect::<String>();
        let declare = each(&|k| {
            format!("reg [{e}:0] sums{k} [0:{}];\nwire [{e}:0] sum{k} = sums{k}[part_out];\n", count - 1, e = sum - 1)
        });
        let clear = each(&|k| format!("      sums{k}[i] <= {sum}'d0;\n"));
        let values = ["fx", "fy", "fz", "pressed", "moment_x", "moment_y"];
        let bits = [32, 32, 32, 32, 32 + place, 32 + place];
        let add = each(&|k| {
            let (value, from) = (values[k], bits[k]);
            format!(
                "    sums{k}[part2] <= sums{k}[part2] + {{{{{}{{{value}[{}]}}}}, {value}}};\n",
                sum - from,
                from - 1
            )
        });
        // Index of the subarray as a table, in place of a product.
        let part = (0..count)
            .map(|k| {
                let (i, j) = (k / parts.cols, k % parts.cols);
                format!("    {{{pr}'d{i}, {pc}'d{j}}}: part = {p}'d{k};\n")
            })
            .collect::<String>();
        Verilog::Custom(format!(
            "\
reg [{c_end}:0] col;
reg [{pc_end}:0] part_col;
reg [{r_end}:0] row;
reg [{pr_end}:0] part_row;
reg signed [{place_end}:0] x, y, x1, y1;
reg [{p_end}:0] part, part1, part2, part_out;
reg [1:0] quarter;
reg counting, settling1, settling2, settling3, sending;
reg valid1, valid2;
reg signed [31:0] fx1, fy1, fz1, pressed1;
reg signed [31:0] fx, fy, fz, pressed;
reg signed [{moment_end}:0] moment_x, moment_y;
integer i;
always @(*) begin
  case ({{part_row, part_col}})
{part}    default: part = {p}'d0;
  endcase
end
{declare}wire [383:0] all = {{{wide}}};
wire [95:0] now = quarter[1] ? (quarter[0] ? all[288 +: 96] : all[192 +: 96])
  : (quarter[0] ? all[96 +: 96] : all[0 +: 96]);
wire col_last = col == {c}'d{col_last};
wire line_last = col_last && part_col == {pc}'d{part_col_last};
wire row_last = row == {r}'d{row_last};
wire last_force = line_last && row_last && part_row == {pr}'d{part_row_last};
wire take = counting && s_axis_tvalid;
wire passing = !counting && !settling1 && !settling2 && !settling3 && !sending;
wire sent = sending && m_axis_tready;
wire finish = passing && s_axis_tvalid && m_axis_tready && s_axis_tlast;
always @(*) s_axis_tready = counting || (passing && m_axis_tready);
always @(*) m_axis_tvalid = sending || (passing && s_axis_tvalid);
always @(*) m_axis_tlast = passing && s_axis_tlast;
always @(*) m_axis_tdata = sending ? now : s_axis_tdata;
always @(posedge clk) begin
  if (rst || finish) begin
    counting <= 1'b1;
    {{settling1, settling2, settling3, sending}} <= 4'd0;
    {{valid1, valid2}} <= 2'd0;
    col <= {c}'d0;
    part_col <= {pc}'d0;
    row <= {r}'d0;
    part_row <= {pr}'d0;
    x <= -{place}'sd{x_last};
    y <= -{place}'sd{y_last};
    part_out <= {p}'d0;
    quarter <= 2'd0;
    for (i = 0; i <= {last_part}; i = i + 1) begin
{clear}    end
  end else begin
    valid1 <= take;
    valid2 <= valid1;
    if (take) begin
      col <= col_last ? {c}'d0 : col + {c}'d1;
      x <= line_last ? -{place}'sd{x_last} : x + {place}'sd2;
      if (col_last) part_col <= line_last ? {pc}'d0 : part_col + {pc}'d1;
      if (line_last) begin
        y <= y + {place}'sd2;
        row <= row_last ? {r}'d0 : row + {r}'d1;
        if (row_last) part_row <= part_row + {pr}'d1;
      end
      if (last_force) counting <= 1'b0;
    end
    settling1 <= take && last_force;
    settling2 <= settling1;
    settling3 <= settling2;
    if (settling3) sending <= 1'b1;
    if (sent) begin
      quarter <= quarter + 2'd1;
      if (quarter == 2'd3) begin
        part_out <= part_out + {p}'d1;
        if (part_out == {p}'d{last_part}) sending <= 1'b0;
      end
    end
    if (valid2) begin
{add}    end
  end
  {{fz1, fy1, fx1}} <= s_axis_tdata;
  pressed1 <= s_axis_tdata[95] ? 32'd0 : s_axis_tdata[95:64];
  {{x1, y1, part1}} <= {{x, y, part}};
  {{fz, fy, fx, pressed}} <= {{fz1, fy1, fx1, pressed1}};
  moment_x <= pressed1 * x1;
  moment_y <= pressed1 * y1;
  part2 <= part1;
end",
            c_end = c - 1,
            pc_end = pc - 1,
            r_end = r - 1,
            pr_end = pr - 1,
            p_end = p - 1,
            place_end = place - 1,
            moment_end = 32 + place - 1,
            wide = wide.join(", "),
            col_last = cols - 1,
            part_col_last = parts.cols - 1,
            row_last = rows - 1,
            part_row_last = parts.rows - 1,
            x_last = sensor.cols - 1,
            y_last = sensor.rows - 1,
            last_part = count - 1,
        ))
    }
}
