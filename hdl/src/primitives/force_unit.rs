//! Force arithmetic: p(μ*) to force words, and the output beats with their status.

use dermis_golden::fixed::cycles::ACCEPT;
use dermis_golden::fixed::force::{force, mu_word};
use dermis_golden::fixed::formats::{force_shift, Formats, FORCE_BITS, FORCE_SHIFT_MAX, MULTIPLIER_BITS, MU_ROUND};
use dermis_golden::fixed::send::{
    CASE_SHIFT, FLAG_COEFFICIENTS, FLAG_CONDITION, FLAG_FOUND, FLAG_FRAMING, FLAG_NO_CONTACT,
};
use dermis_golden::fixed::Model;
use rust_hdl::prelude::*;

use super::case_counter::{largest, number_by_case};
use super::counter::count_bits;
use super::half_up::half_up;
use super::polynomial_word::resize;
use super::queue::LATENCY as LEAVING;
use super::raw_length::shift_bits;
use super::rescaler::SATURATION_BITS;
use super::sweep::position_bits;
use crate::wire::{Wire, Word};

/// A pipeline without stalls: memory (3 cycles), lane selection, products (2), shift, rounding and saturation,
/// threshold, output.
///
/// `beat` 0 asks for a force from `quad`, 1 … 3 for a status beat; the beat is on `beat_data` for one cycle, [`STEPS`]
/// cycles after `offer`. `start` stores μ, shift and status of subarray `part`, which are usable three cycles later;
/// `begin_frame` clears the counts of the frame.
#[derive(LogicBlock)]
pub struct ForceUnit {
    /// Clock; registers change on its rising edge.
    pub clk: Signal<In, Clock>,
    /// Synchronous reset, active high; clears the control pipeline only.
    pub rst: Signal<In, Bit>,
    /// Index of the case of the frame being sent.
    pub which: Wire<In>,
    /// A new frame: clears its counts, the contact flag and the saturations.
    pub begin_frame: Signal<In, Bit>,
    /// Stores position, exponents and status of subarray `part` in this cycle.
    pub start: Signal<In, Bit>,
    /// Index of the subarray; valid with `start`.
    pub part: Wire<In>,
    /// A beat is requested in this cycle.
    pub offer: Signal<In, Bit>,
    /// 0: a force, 1 … 3: a status beat; valid with `offer`.
    pub beat: Wire<In>,
    /// Index of the beat's subarray; valid with `offer`.
    pub beat_part: Wire<In>,
    /// Lane of the taxel in its quad; valid with `offer`.
    pub lane: Wire<In>,
    /// Four values p(μ*), `search_bits[0]` each, signed; three cycles after `offer`.
    pub quad: Wire<In>,
    /// μ1 in grid steps of the last level, signed; valid with `start`.
    pub position_x: Wire<In>,
    /// μ2 in grid steps of the last level, signed; valid with `start`.
    pub position_y: Wire<In>,
    /// Left shift of `normalise`; valid with `start`.
    pub normalise: Wire<In>,
    /// Right shift of `rescale`; valid with `start`.
    pub rescale: Wire<In>,
    /// The subarray meets the scene's condition; valid with `start`.
    pub condition: Signal<In, Bit>,
    /// The search found a candidate; valid with `start`.
    pub found: Signal<In, Bit>,
    /// `tlast` was early or missing; sampled when the beat with the flags leaves.
    pub framing: Signal<In, Bit>,
    /// The coefficient signature is wrong, 1 bit; valid with `start`.
    pub damaged: Wire<In>,
    /// Score of the best candidate, signed, 2^−6; valid with `start`.
    pub score: Wire<In>,
    /// Words saturated by `rescale`; valid with `start`.
    pub saturations: Wire<In>,
    /// Cycle counter of the frame; sampled when the first beat leaves.
    pub cycles: Wire<In>,
    /// `beat_data` holds a beat in this cycle.
    pub valid: Signal<Out, Bit>,
    /// The beat is the frame's last; valid with `valid`.
    pub last: Signal<Out, Bit>,
    /// `{fz, fy, fx}`, 32 bits signed each, or three status words; valid with `valid`.
    pub beat_data: Wire<Out>,
    _formats: Formats,
    _threshold: i64,
    _pipe: Vec<Option<Entry>>,
    _frame: Frame,
    _parts: Vec<Part>,
    _counts: Vec<usize>,
    _numbers: Vec<u32>,
    _checks: bool,
}

/// Cycles from `offer` to `valid`.
pub const STEPS: usize = 10;
/// Cycles from `offer` to `quad`.
const READ_STEPS: usize = 3;
/// Cycles from a value to its products.
const PRODUCT_STEPS: usize = 2;
/// Cycles for which a request travels along the pipeline.
const ASKED: usize = STEPS - 1;
/// Bits of the unsigned low part of p: a multiplier operand without its sign bit.
const LOW: usize = MULTIPLIER_BITS as usize - 1;
/// Cycles of a frame outside its counter: before the counter is cleared, two cycles after the frame starts, and from
/// its sampling to the first beat behind the queue.
const UNCOUNTED: u32 = ACCEPT as u32 + 3 + LEAVING as u32;
/// Width of the cycle counter, in bits.
pub const CYCLE_BITS: usize = 24;

#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    beat: u64,
    part: usize,
    lane: usize,
    value: i64,
}

/// Values stored per subarray.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    position: [i32; 2],
    normalise: u32,
    rescale: u32,
    condition: bool,
    found: bool,
    damaged: bool,
    score: i32,
    saturations: u32,
}

/// Values stored per frame.
#[derive(Clone, Copy, Debug, Default)]
struct Frame {
    cycles: u32,
    saturations: u32,
    contact: bool,
    counting: bool,
}

impl ForceUnit {
    /// With the widths, subarrays and case numbers of `model`.
    pub fn new(model: &Model) -> Self {
        let formats = &model.formats;
        let counts: Vec<usize> = model.cases().iter().map(|case| case.parts.len()).collect();
        let parts = largest(&counts);
        ForceUnit {
            clk: Default::default(),
            rst: Default::default(),
            which: Wire::new(count_bits(counts.len())),
            begin_frame: Default::default(),
            start: Default::default(),
            part: Wire::new(count_bits(parts)),
            beat_part: Wire::new(count_bits(parts)),
            offer: Default::default(),
            beat: Wire::new(2),
            lane: Wire::new(2),
            quad: Wire::new(4 * formats.search_bits[0] as usize),
            position_x: Wire::new(position_bits()),
            position_y: Wire::new(position_bits()),
            normalise: Wire::new(count_bits(formats.input_bits as usize)),
            rescale: Wire::new(shift_bits(formats)),
            condition: Default::default(),
            found: Default::default(),
            framing: Default::default(),
            damaged: Wire::new(1),
            score: Wire::new(formats.score_bits as usize),
            saturations: Wire::new(SATURATION_BITS),
            cycles: Wire::new(CYCLE_BITS),
            valid: Default::default(),
            last: Default::default(),
            beat_data: Wire::new(3 * FORCE_BITS as usize),
            _formats: formats.clone(),
            _checks: model.has_coefficient_check(),
            _threshold: model.threshold,
            _pipe: vec![None; ASKED],
            _frame: Frame::default(),
            _parts: vec![Part::default(); parts],
            _counts: counts,
            // The status names the case only where it is chosen per frame.
            _numbers: model.cases().iter().map(|case| if model.chooses() { case.number() } else { 0 }).collect(),
        }
    }

    fn case(&self) -> usize {
        (self.which.val().number() as usize).min(self._counts.len() - 1)
    }

    fn keep(&mut self) {
        let position = |wire: &Wire<In>| wire.val().signed(0, position_bits()) as i32;
        let part = Part {
            position: [position(&self.position_x), position(&self.position_y)],
            normalise: self.normalise.val().number() as u32,
            rescale: self.rescale.val().number() as u32,
            condition: self.condition.val(),
            found: self.found.val(),
            damaged: self.damaged.val().number() == 1,
            score: if self.found.val() { self.score.val().signed(0, self.score.width()) as i32 } else { 0 },
            saturations: self.saturations.val().number() as u32,
        };
        if let Some(kept) = self._parts.get_mut(self.part.val().number() as usize) {
            *kept = part;
        }
    }

    fn answer(&mut self, entry: &Entry) -> [i32; 3] {
        let case = self.case();
        let frame = &mut self._frame;
        let part = self._parts.get(entry.part).copied().unwrap_or_default();
        match entry.beat {
            0 => {
                let shift = force_shift(&self._formats, part.normalise, part.rescale);
                let mu = part.position.map(|x| mu_word(&self._formats, x));
                let result = force(&self._formats, entry.value, mu, shift, self._threshold);
                frame.saturations = (frame.saturations + result.saturations).min((1 << SATURATION_BITS) - 1);
                frame.contact |= result.words[2] != 0;
                result.words
            }
            1 => {
                let flag = |set: bool, bit: u32| if set { bit } else { 0 };
                let flags = flag(part.condition, FLAG_CONDITION)
                    | flag(part.found, FLAG_FOUND)
                    | flag(!frame.contact, FLAG_NO_CONTACT)
                    | flag(self.framing.val(), FLAG_FRAMING)
                    | flag(part.damaged, FLAG_COEFFICIENTS)
                    | self._numbers[case] << CASE_SHIFT;
                [part.position[0], part.position[1], flags as i32]
            }
            2 => [part.score, part.rescale as i32, part.normalise as i32],
            _ => [part.saturations as i32, frame.saturations as i32, frame.cycles as i32],
        }
    }

    /// Verilog of the shear components: the μ words of each subarray, then their products with p. Used with a search
    /// only.
    fn shear(&self) -> (String, String) {
        let f = &self._formats;
        let (p, mu) = (position_bits(), 18);
        let v = f.search_bits[0] as usize;
        let product = v + mu;
        let words = format!(
            "\
reg [{p_end}:0] x, y;
reg [{mu_end}:0] mu_xs [0:{last_part}];
reg [{mu_end}:0] mu_ys [0:{last_part}];
reg [{p_end}:0] xs [0:{last_part}];
reg [{p_end}:0] ys [0:{last_part}];
wire signed [{mp_end}:0] mu_step = {mp}'sd{mu_step};
wire signed [{mp_end}:0] wide_x = {{{{{mp_more}{{x[{p_end}]}}}}, x}};
wire signed [{mp_end}:0] wide_y = {{{{{mp_more}{{y[{p_end}]}}}}, y}};
reg signed [{mp_end}:0] scaled_x, scaled_y;
// Separate from the addition, whose unsigned operand would make the shift logical.
wire signed [{mp_end}:0] before_x = scaled_x >>> {mu_round_less};
wire signed [{mp_end}:0] before_y = scaled_y >>> {mu_round_less};
wire [{mp_end}:0] half_x = before_x + {mp}'sd1;
wire [{mp_end}:0] half_y = before_y + {mp}'sd1;
wire unused_mu = &{{1'b0, half_x, half_y}};
always @(posedge clk) begin
  x <= position_x;
  y <= position_y;
  scaled_x <= wide_x * mu_step;
  scaled_y <= wide_y * mu_step;
  if (start) begin
    xs[part] <= position_x;
    ys[part] <= position_y;
  end
  if (start2) begin
    mu_xs[part2] <= half_x[{mu}:1];
    mu_ys[part2] <= half_y[{mu}:1];
  end
end
",
            p_end = p - 1,
            mu_end = mu - 1,
            last_part = self._parts.len() - 1,
            mp = p + mu,
            mp_end = p + mu - 1,
            mp_more = mu,
            mu_step = f.mu_step,
            mu_round_less = MU_ROUND - 1,
        );
        let products = format!(
            "\
reg signed [{mu_end}:0] mu_x, mu_y;
reg signed [{product_end}:0] product_x, product_y;
// p as an unsigned low part that fits a multiplier and the signed rest; their products are added a cycle later.
wire signed [{mu_end}:0] low = {{1'b0, value[{low_end}:0]}};
wire signed [{high_end}:0] high = value[{v_end}:{low_bits}];
reg signed [{low_product_end}:0] low_x, low_y;
reg signed [{high_product_end}:0] high_x, high_y;
wire signed [{product}:0] doubled_x = {{product_x, 1'b0}};
wire signed [{product}:0] doubled_y = {{product_y, 1'b0}};
reg signed [{product}:0] moved_x, moved_y;
wire [{p_end}:0] status_x = xs[at_out];
wire [{p_end}:0] status_y = ys[at_out];
always @(posedge clk) begin
  mu_x <= mu_xs[at_value];
  mu_y <= mu_ys[at_value];
  low_x <= low * mu_x;
  low_y <= low * mu_y;
  high_x <= high * mu_x;
  high_y <= high * mu_y;
  product_x <= {{high_x, {low_bits}'d0}} + {{{{{sign}{{low_x[{low_product_end}]}}}}, low_x}};
  product_y <= {{high_y, {low_bits}'d0}} + {{{{{sign}{{low_y[{low_product_end}]}}}}, low_y}};
  moved_x <= doubled_x >>> shift;
  moved_y <= doubled_y >>> shift;
end
",
            mu_end = mu - 1,
            product_end = product - 1,
            p_end = p - 1,
            v_end = v - 1,
            low_bits = LOW,
            low_end = LOW - 1,
            high_end = v - LOW - 1,
            low_product_end = 2 * mu - 1,
            high_product_end = v - LOW + mu - 1,
            sign = product - 2 * mu,
        );
        (words, products)
    }

    /// The same without a search: fx and fy are zero.
    fn no_shear(&self) -> (String, String) {
        let unused = "wire unused_mu = &{1'b0, position_x, position_y};\n";
        let zero = "assign rounded[63:0] = 64'd0;\nassign clips[1:0] = 2'd0;\n";
        (unused.to_string(), zero.to_string())
    }
}

impl Logic for ForceUnit {
    fn update(&mut self) {
        if self.clk.pos_edge() {
            let leaving = self._pipe.remove(0);
            if let Some(entry) = leaving {
                if self._frame.counting {
                    self._frame.cycles = self.cycles.val().number() as u32 + UNCOUNTED;
                    self._frame.counting = false;
                }
                let words = self.answer(&entry);
                self.beat_data.next = Word::of_fields(&words.map(i64::from), FORCE_BITS as usize);
            }
            self.valid.next = leaving.is_some();
            let parts = self._counts[self.case()];
            self.last.next = leaving.is_some_and(|entry| entry.beat == 3 && entry.part + 1 == parts);
            let read = self._pipe.len() - READ_STEPS;
            if let Some(Some(entry)) = self._pipe.get_mut(read) {
                entry.value = self.quad.val().signed(entry.lane, self.quad.width() / 4);
            }
            self._pipe.push(self.offer.val().then(|| Entry {
                beat: self.beat.val().number(),
                part: self.beat_part.val().number() as usize,
                lane: self.lane.val().number() as usize,
                value: 0,
            }));
            if self.begin_frame.val() {
                self._frame = Frame { counting: true, ..Frame::default() };
            }
            if self.start.val() {
                self.keep();
            }
            if self.rst.val() {
                self._pipe.fill(None);
                self.valid.next = false;
                self.last.next = false;
            }
        }
    }

    fn connect(&mut self) {
        self.valid.connect();
        self.last.connect();
        self.beat_data.connect();
    }

    fn hdl(&self) -> Verilog {
        let f = &self._formats;
        let v = f.search_bits[0] as usize;
        let (mu, fraction) = (18, f.mu_fraction as usize);
        let product = v + mu;
        let p = position_bits();
        let part = self.part.width();
        let (n_bits, r_bits) = (self.normalise.width(), self.rescale.width());
        // force_shift = base + normalise − rescale, clamped to 0 and the largest useful shift.
        let base = force_shift(f, 0, 0) as usize;
        let (word, cap) = (FORCE_BITS as usize, SATURATION_BITS);
        let score = resize("score", self.score.width(), word);
        let threshold = match self._threshold {
            0 => "1'b0".to_string(),
            t => format!("magnitude < 33'd{}", t.min(1 << 32)),
        };
        let searched = f.degree > 0;
        let (mu_words, shear) = if searched { self.shear() } else { self.no_shear() };
        // Flag bit 4 is the coefficient check, if the scene has it.
        let (from, damaged) = if self._checks { (5, ", damages[at_out]") } else { (4, "") };
        let above = word - CASE_SHIFT as usize;
        let case_word = match self._numbers.iter().any(|&number| number > 0) {
            false => format!("{}'d0{damaged}", word - from),
            true => {
                let number = number_by_case(self._numbers.iter().map(|&number| number as usize), above);
                format!("{number}, {}'d0{damaged}", CASE_SHIFT as usize - from)
            }
        };
        let damages = match self._checks {
            true => format!(
                "reg damages [0:{}];\nalways @(posedge clk) if (start) damages[part] <= damaged;\n",
                self._parts.len() - 1
            ),
            false => "wire unused_damaged = &{1'b0, damaged};\n".to_string(),
        };
        let magnitude = if self._threshold == 0 {
            String::new()
        } else {
            "wire [32:0] magnitude = words[95] ? -{1'b1, words[95:64]} : {1'b0, words[95:64]};\n".to_string()
        };
        Verilog::Custom(format!(
            "\
wire unused_which = &{{1'b0, which}};
{damages}reg [{n_end}:0] normalise_held;
reg [{r_end}:0] rescale_held;
reg [{part_end}:0] part1, part2;
reg start1, start2;
// Stored per subarray, for the pipeline and the status beats.
reg [5:0] shifts [0:{last_part}];
reg [{n_end}:0] normalises [0:{last_part}];
reg [{r_end}:0] rescales [0:{last_part}];
reg [{word_end}:0] scores [0:{last_part}];
reg [{cap_end}:0] rescale_saturations [0:{last_part}];
reg conditions [0:{last_part}];
reg founds [0:{last_part}];
reg contact, counting;
reg [{cap_end}:0] force_saturations;
reg [{c_end}:0] cycles_held;
reg [5:0] shift_now;
wire [7:0] raw_shift = 8'd{base} + {{{n_more}'d0, normalise_held}} - {{{r_more}'d0, rescale_held}};
{mu_words}always @(posedge clk) begin
  normalise_held <= normalise;
  rescale_held <= rescale;
  start1 <= start;
  part1 <= part;
  shift_now <= raw_shift[7] ? 6'd0 : raw_shift > 8'd{shift_max} ? 6'd{shift_max} : raw_shift[5:0];
  start2 <= start1;
  part2 <= part1;
  if (start) begin
    normalises[part] <= normalise;
    rescales[part] <= rescale;
    scores[part] <= found ? {score} : {word}'d0;
    rescale_saturations[part] <= saturations;
    conditions[part] <= condition;
    founds[part] <= found;
  end
  if (start2) begin
    shifts[part2] <= shift_now;
  end
end
// The request travels along the pipeline: to the lane selection, the shift, the output.
reg [{asked_end}:0] offers;
reg [{beats_end}:0] beats;
reg [{lanes_end}:0] lanes;
reg [{ats_end}:0] ats;
wire leaves = offers[{asked_end}];
wire [1:0] beat_out = beats[{beats_end} -: 2];
wire [1:0] lane_value = lanes[{lanes_end} -: 2];
wire [{part_end}:0] at_value = ats[{at_value} +: {part}];
wire [{part_end}:0] at_shift = ats[{at_shift} +: {part}];
wire [{part_end}:0] at_out = ats[{ats_end} -: {part}];
reg [5:0] shift;
reg signed [{v_end}:0] value;
reg [{v_end}:0] value1, value2;
wire signed [{product}:0] doubled_z = {{{{{z_more}{{value2[{v_end}]}}}}, value2, {fraction_one}'d0}};
reg signed [{product}:0] moved_z;
wire [{all_end}:0] rounded;
wire [2:0] clips;
reg [{all_end}:0] words;
reg [2:0] clipped;
{shear}genvar axis;
generate
  for (axis = {first_axis}; axis < 3; axis = axis + 1) begin : component
    wire [{product}:0] moved = {moved};
{rounding}    assign rounded[axis * {word} +: {word}] =
      clips[axis] ? {{moved[{product}], {{{word_end}{{!moved[{product}]}}}}}} : half_up[{word}:1];
    wire unused = &{{1'b0, half_up[0]}};
  end
endgenerate
{magnitude}// The result of the threshold is registered beside the words.
reg [{all_end}:0] force_words;
reg below, presses;
reg [2:0] force_clips;
wire [{cap}:0] count = {{1'b0, force_saturations}} + {{{cap_less}'d0, force_clips[0]}} + {{{cap_less}'d0, force_clips[1]}}
  + {{{cap_less}'d0, force_clips[2]}};
reg [{all_end}:0] status;
always @(*) begin
  case (beat_out)
    2'd1: status = {{{case_word}, framing, !contact, founds[at_out], conditions[at_out], {y_word}, {x_word}}};
    2'd2: status = {{{n_word}'d0, normalises[at_out], {r_word}'d0, rescales[at_out], scores[at_out]}};
    default: status = {{{c_word}'d0, cycles_held, {cap_word}'d0, force_saturations, {cap_word}'d0, rescale_saturations[at_out]}};
  endcase
end
wire force_leaves = leaves && beat_out == 2'd0;
always @(posedge clk) begin
  if (rst) begin
    offers <= {asked}'d0;
    valid <= 1'b0;
    last <= 1'b0;
  end else begin
    offers <= {{offers[{asked_less}:0], offer}};
    valid <= leaves;
    last <= leaves && beat_out == 2'd3 && at_out == {final_part};
  end
  beats <= {{beats[{beats_less}:0], beat}};
  ats <= {{ats[{ats_less}:0], beat_part}};
  lanes <= {{lanes[{lanes_less}:0], lane}};
  value <= lane_value[1] ? (lane_value[0] ? quad[{v3} +: {v}] : quad[{v2} +: {v}])
    : (lane_value[0] ? quad[{v} +: {v}] : quad[0 +: {v}]);
  {{value2, value1}} <= {{value1, value}};
  shift <= shifts[at_shift];
  moved_z <= doubled_z >>> shift;
  words <= rounded;
  clipped <= clips;
  force_words <= words;
  force_clips <= clipped;
  below <= {threshold};
  presses <= words[95:64] != 32'd0;
  beat_data <= beat_out != 2'd0 ? status : below ? {all}'d0 : force_words;
  if (begin_frame) begin
    counting <= 1'b1;
    contact <= 1'b0;
    force_saturations <= {cap}'d0;
  end else if (leaves) begin
    if (counting) cycles_held <= cycles + {c}'d{UNCOUNTED};
    counting <= 1'b0;
    if (force_leaves && !below && presses) contact <= 1'b1;
    if (force_leaves) force_saturations <= count[{cap}] ? {{{cap}{{1'b1}}}} : count[{cap_end}:0];
  end
end",
            final_part = number_by_case(self._counts.iter().map(|count| count - 1), part),
            case_word = case_word,
            part = part,
            part_end = part - 1,
            asked = ASKED,
            asked_end = ASKED - 1,
            asked_less = ASKED - 2,
            beats_end = 2 * ASKED - 1,
            beats_less = 2 * ASKED - 3,
            ats_end = part * ASKED - 1,
            ats_less = part * (ASKED - 1) - 1,
            lanes_end = 2 * READ_STEPS - 1,
            lanes_less = 2 * READ_STEPS - 3,
            at_value = part * (READ_STEPS - 1),
            at_shift = part * (READ_STEPS + PRODUCT_STEPS - 1),
            last_part = self._parts.len() - 1,
            n_end = n_bits - 1,
            r_end = r_bits - 1,
            n_more = 8 - n_bits,
            r_more = 8 - r_bits,
            word_end = word - 1,
            all = 3 * word,
            all_end = 3 * word - 1,
            cap_end = cap - 1,
            cap_less = cap,
            cap_word = word - cap,
            c = CYCLE_BITS,
            c_end = CYCLE_BITS - 1,
            c_word = word - CYCLE_BITS,
            n_word = word - n_bits,
            r_word = word - r_bits,
            shift_max = FORCE_SHIFT_MAX,
            v_end = v - 1,
            v2 = 2 * v,
            v3 = 3 * v,
            rounding = half_up(product + 1, word, "clips[axis]"),
            z_more = product - v - fraction,
            fraction_one = fraction + 1,
            first_axis = if searched { 0 } else { 2 },
            moved = if searched { "axis == 0 ? moved_x : axis == 1 ? moved_y : moved_z" } else { "moved_z" },
            x_word = if searched { resize("status_x", p, word) } else { format!("{word}'d0") },
            y_word = if searched { resize("status_y", p, word) } else { format!("{word}'d0") },
        ))
    }
}
