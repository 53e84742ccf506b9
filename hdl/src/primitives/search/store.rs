//! Search memory: every taxel's polynomial, about up to three centres.

use dermis_golden::fixed::plan::cycles::split_latency;
use dermis_golden::fixed::plan::resources::Holds;
use dermis_golden::fixed::words::formats::Formats;
use dermis_golden::spec::quads::Quads;

use crate::block;
use crate::language::{concat, Block, Builder, Contents, Expr, Inside, MemoryPort, Type};
use crate::primitives::address::counter::count_bits;
use crate::primitives::search::polynomial_word::PolynomialWord;
use crate::primitives::search::sweep::{BUFFERS, BUFFER_BITS, START};

block! {
    /// Buffers of quads of polynomials. `fill` writes one coefficient of a quad into buffer `START`; `write` writes
    /// whole polynomials into one of the others. Both take effect one cycle later, through registers beside the memory.
    /// `read_data` follows its address by three cycles: read register and output register of the memory, and the choice
    /// of the memory.
    ///
    /// A step is the part of a quad that the search computes in a cycle: all of it, a half or a quarter. Addresses of
    /// steps are `{quad, step}`. Where a quad takes several steps, `read_data` has one more cycle of latency, and the
    /// memory is written with a quad's last step.
    ///
    /// Where one subarray or frame is filled while another is searched, `START` is a memory of its own; otherwise it is
    /// another name of buffer 0, and `fill` and `write` never coincide.
    ///
    /// Read-during-write data is undefined and unused: a sweep writes quads that it read several cycles earlier, or a
    /// buffer that is not being read. So block RAM needs no bypass. In simulation such a read returns the complement of
    /// the old content, so that using it would show as an error.
    pub struct Store {
        /// Layout of the polynomials of a step.
        step: PolynomialWord,
        quads: usize,
        /// Width of a coefficient of a taxel in bits.
        fill_bits: usize,
        /// One subarray or frame is filled while another is searched.
        apart: bool,
    }
    ports StorePorts {
        clock;
        /// Write coefficient `fill_index` of quad `fill_address` of buffer `START`.
        in fill;
        /// Index of the coefficient; valid with `fill`.
        in fill_index: count_bits(step.widths.len());
        /// Address of the quad; valid with `fill`.
        in fill_address: count_bits(*quads);
        /// The coefficient of four taxels, signed; valid with `fill`.
        in fill_quad: 4 * fill_bits;
        /// Write `write_data` to step `write_address`; the steps of a quad follow one another.
        in write;
        /// Buffer to write; valid one cycle before `write`.
        in write_buffer: BUFFER_BITS;
        /// Address of the step; valid with `write`.
        in write_address: count_bits(quads * steps(step));
        /// The polynomials of a step; valid with `write`.
        in write_data: step.bits();
        /// Buffer to read; valid with `read_address`.
        in read_buffer: BUFFER_BITS;
        /// Address of the step to read, 0 in the cycle after `begins`, then one more after each cycle with `counts`;
        /// taken in every cycle.
        in read_address: count_bits(quads * steps(step));
        /// A buffer is read from the next cycle on; loads `next_base` into the read addresses.
        in begins;
        /// The read addresses advance to the next step.
        in counts;
        /// First address of that buffer in the memory (`base`); valid with `begins`.
        in next_base: base_bits(*quads);
        /// The polynomials of a step; [`latency`] cycles after `read_address`.
        out read_data: step.bits();
    }
}

/// Cycles from `read_address` to `read_data`, where a step is a quad.
const LATENCY: usize = 3;

/// Cycles from `read_address` to `read_data`; `formats` says how many taxels a step has.
pub fn latency(formats: &Formats) -> usize {
    LATENCY + split_latency(formats) as usize
}

/// First address of `buffer` in the memory, where buffers of `quads` quads follow each other without gaps.
pub fn base(buffer: usize, quads: usize) -> usize {
    (buffer % BUFFERS) * quads
}

/// Width of an address in that memory, in bits.
pub fn base_bits(quads: usize) -> usize {
    count_bits(BUFFERS * quads)
}

impl Store {
    /// `quads` quads of polynomials, filled with coefficients of `fill_bits` bits; `step` is the layout of the
    /// polynomials of a step, `apart` says whether one subarray or frame is filled while another is searched.
    pub fn new(step: PolynomialWord, quads: usize, fill_bits: usize, apart: bool) -> Self {
        Store { step, quads, fill_bits, apart }
    }
}

/// Steps of a quad.
fn steps(step: &PolynomialWord) -> usize {
    Quads::LANES / step.lanes
}

/// Address of the quad and index of the step, where a quad has several, of a step's `address`.
fn split<'k>(address: Expr<'k>, steps: usize) -> (Expr<'k>, Option<Expr<'k>>) {
    match steps.trailing_zeros() as usize {
        0 => (address, None),
        bits => (address.slice(bits, address.bits() - bits), Some(address.low(bits))),
    }
}

impl Block for Store {
    fn build<'k>(&self, k: &'k Builder, io: StorePorts<Inside<'k>>) {
        let Store { ref step, quads, fill_bits, apart } = *self;
        let layout = &PolynomialWord { lanes: Quads::LANES, widths: step.widths.clone() };
        let bits = base_bits(quads);
        let (write_address, written) = split(io.write_address, steps(step));
        let (read_address, shows) = split(io.read_address, steps(step));
        let (counts, whole) = match (shows, written) {
            (Some(shows), Some(written)) => (io.counts & shows.all(), io.write & written.all()),
            _ => (io.counts, io.write),
        };
        let shows = shows.map(|shows| (0..LATENCY).fold(shows, |shows, n| k.delay(&format!("shows_{n}"), shows)));

        let bases: Vec<(u64, Expr)> =
            (1..BUFFERS).map(|b| (b as u64, k.constant(bits, base(b, quads) as u64))).collect();
        let write_base = k.delay("write_base", io.write_buffer.case(&bases, k.constant(bits, 0)));
        let to_buffer = k.wire("to_buffer", (write_base + write_address).low(bits));
        let write_to = if apart { to_buffer } else { io.fill.mux(io.fill_address, to_buffer) };
        let write_to = k.wire("write_to", write_to);
        let from_start = apart.then(|| k.delay("from_start", k.delay("from_start_1", io.read_buffer.is(START as u64))));
        k.comment("Read and write addresses are registers of each coefficient, because the memories are placed far");
        k.comment("apart; the attribute keeps synthesis from merging them.");
        let coefficient = |index: usize| {
            let (width, all) = (layout.widths[index], 4 * layout.widths[index]);
            let memory = format!("memory{index}");
            let place = k.memory(&memory, BUFFERS * quads, all, Contents::Undefined).unchecked();
            let place = place.holds(Holds::Polynomials(index));
            let from = k.register(&format!("from{index}"), Type::unsigned(bits)).keep();
            k.when(counts, || from.set(from.plus(1)));
            k.when(io.begins, || from.set(io.next_base));
            let filled =
                |lane: usize| io.fill_quad.slice(lane * fill_bits, fill_bits).signed().resize(width).unsigned();
            let filled = concat(&[3, 2, 1, 0].map(filled));
            let fills = io.fill_index.is(index as u64);
            let last = io.write_data.slice(step.offset(index), step.lanes * width);
            let before = |at: usize| {
                let part = k.register(&format!("part{index}_{at}"), last.ty());
                if let Some(written) = written {
                    k.when(io.write & written.is(at as u64), || part.set(last));
                }
                *part
            };
            let mut quad: Vec<Expr> = (0..steps(step) - 1).map(before).collect();
            quad.push(last);
            let quad = concat(&quad.into_iter().rev().collect::<Vec<_>>());
            let read = registered(k, &format!("read{index}"), place.read(*from));
            let shown = match from_start {
                Some(from_start) => {
                    let start = format!("start{index}");
                    let own = k.memory(&start, quads, all, Contents::Undefined).unchecked();
                    let own = own.holds(Holds::Start(index));
                    write_port(k, (&start, own), [io.fill & fills, io.fill_address, filled]);
                    write_port(k, (&memory, place), [whole, write_to, quad]);
                    from_start.mux(registered(k, &format!("read_start{index}"), own.read(read_address)), read)
                }
                None => {
                    write_port(k, (&memory, place), [io.fill.mux(fills, whole), write_to, io.fill.mux(filled, quad)]);
                    read
                }
            };
            let shown = k.delay(&format!("shown{index}"), shown);
            match shows {
                None => shown,
                Some(shows) => {
                    let part = |at: usize| shown.slice(at * step.lanes * width, step.lanes * width);
                    let later: Vec<(u64, Expr)> = (1..steps(step)).map(|at| (at as u64, part(at))).collect();
                    k.delay(&format!("step{index}"), shows.case(&later, part(0)))
                }
            }
        };
        let shown: Vec<Expr> = (0..layout.widths.len()).map(coefficient).collect();
        io.read_data.set(concat(&shown.into_iter().rev().collect::<Vec<_>>()));
    }
}

/// Read register of a memory and its output register.
fn registered<'k>(k: &'k Builder, name: &str, read: Expr<'k>) -> Expr<'k> {
    k.delay(&format!("{name}_out"), k.delay(name, read))
}

/// Writes the memory of this name one cycle after it is asked to: enable, address, data.
fn write_port<'k>(k: &'k Builder, (name, memory): (&str, MemoryPort<'k>), [asks, to, data]: [Expr<'k>; 3]) {
    let kept = |what: &str, value: Expr<'k>| {
        let register = k.register(&format!("{name}_{what}"), value.ty()).keep();
        register.set(value);
        *register
    };
    let (writes, to) = (kept("writes", asks), kept("to", to));
    memory.write(writes, to, k.delay(&format!("{name}_data"), data));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::kernel_of;
    use crate::language::testbench::{check, random_words, Reference, Subject};
    use crate::wire::Word;

    const BITS: usize = 5;

    /// Writes `data` to quad 1 of buffer 0 and reads quad `at`, `late` cycles after `write`.
    fn read(store: &mut Subject, data: u64, at: u64, late: usize) -> u64 {
        let cycle = |cycle: usize| {
            // Reads another quad in all cycles but the tested one.
            let next_base = if cycle == late { at } else { 2 };
            store.cycle(&[0, 0, 0, 0, u64::from(cycle == 1), 0, 1, data, 0, 0, 1, 0, next_base].map(Word::from))
        };
        (0..=late + LATENCY + 1).map(cycle).last().unwrap()[0].number()
    }

    #[test]
    fn what_is_read_where_and_when_it_is_written_is_the_complement() {
        let layout = PolynomialWord { lanes: 4, widths: vec![BITS] };
        let kernel = kernel_of(&Store::new(layout, 3, BITS, false));
        let mut store = Subject::from(&kernel);
        assert_eq!(read(&mut store, 0x12345, 1, 2), 0x12345);
        // The write takes effect one cycle after `write`.
        assert_eq!(read(&mut store, 0xabcde, 1, 1), !0x12345 & 0xfffff);
        assert_eq!(read(&mut store, 0x00001, 1, 0), 0xabcde);
        assert_eq!(read(&mut store, 0x00002, 0, 1), 0);
    }

    const WIDTHS: [usize; 2] = [5, 9];
    const QUADS: usize = 3;
    const FILL: usize = 7;

    /// Memory by name (that of the buffers, `START`) and coefficient; what is undefined is `None`.
    struct Buffers {
        apart: bool,
        /// Lanes of a step.
        lanes: usize,
        content: [[Vec<Option<u64>>; 2]; 2],
        /// Memory, coefficient, address, data of the writes asked for.
        asked: Vec<(usize, usize, usize, u64)>,
        from: Option<usize>,
        write_base: usize,
        from_start: [bool; 2],
        read: [[Option<u64>; 2]; 2],
        out: [[Option<u64>; 2]; 2],
        shown: [Option<u64>; 2],
        /// Steps of a quad that were written last, by coefficient.
        parts: [[Option<u64>; 4]; 2],
        /// Indices of the steps read, and the step chosen last.
        shows: [usize; LATENCY],
        step: [Option<u64>; 2],
    }

    impl Reference for Buffers {
        fn outputs(&mut self, _: &[Word]) -> Vec<Option<Word>> {
            let lanes = self.lanes;
            let word = |low: u64, high: u64| {
                let mut word = Word::default();
                word.set(0, lanes * WIDTHS[0], low);
                word.set(lanes * WIDTHS[0], lanes * WIDTHS[1], high);
                word
            };
            let shown = if lanes == 4 { self.shown } else { self.step };
            vec![shown[0].zip(shown[1]).map(|(low, high)| word(low, high))]
        }

        fn clock(&mut self, inputs: &[Word]) {
            let number = |k: usize| inputs[k].number() as usize;
            let bit = |k: usize| number(k) == 1;
            let (lanes, steps) = (self.lanes, 4 / self.lanes);
            self.step = std::array::from_fn(|k| {
                let bits = lanes * WIDTHS[k];
                self.shown[k].map(|quad| quad >> (self.shows[LATENCY - 1] * bits) & ((1 << bits) - 1))
            });
            self.shown = self.out[usize::from(self.apart && self.from_start[1])];
            self.out = self.read;
            let from = [self.from, Some(number(9) / steps)];
            for (memory, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let collides =
                    |&(m, c, at, _): &(usize, usize, usize, u64)| (m, c, Some(at)) == (memory, k, from[memory]);
                let place = from[memory].filter(|_| !self.asked.iter().any(collides));
                self.read[memory][k] = place.and_then(|at| self.content[memory][k].get(at).copied().flatten());
            }
            for (memory, k, at, data) in std::mem::take(&mut self.asked) {
                if let Some(word) = self.content[memory][k].get_mut(at) {
                    *word = Some(data);
                }
            }
            let end = 1 << base_bits(QUADS);
            for (k, width) in WIDTHS.into_iter().enumerate() {
                if bit(0) && number(1) == k {
                    let lanes: [i64; 4] = std::array::from_fn(|lane| inputs[3].signed(lane, FILL));
                    let data = Word::of_fields(&lanes, width).field(0, 4 * width);
                    self.asked.push((usize::from(self.apart), k, number(2), data));
                }
                if bit(4) {
                    self.parts[k][number(6) % steps] = Some(inputs[7].field(k * lanes * WIDTHS[0], lanes * width));
                }
                if bit(4) && number(6) % steps == steps - 1 && (self.apart || !bit(0)) {
                    let of_step = |at: usize| self.parts[k][at].map(|part| part << (at * lanes * width));
                    // The test writes every step before the last one first.
                    let data = (0..steps).map(|at| of_step(at).unwrap_or(0)).sum();
                    self.asked.push((0, k, (self.write_base + number(6) / steps) % end, data));
                }
            }
            let advances = bit(11) && number(9) % steps == steps - 1;
            self.from = match bit(10) {
                true => Some(number(12)),
                false => self.from.map(|at| (at + usize::from(advances)) % end),
            };
            self.shows = [number(9) % steps, self.shows[0], self.shows[1]];
            self.write_base = base(number(5), QUADS);
            self.from_start = [number(8) == START, self.from_start[0]];
        }
    }

    #[test]
    fn quads_are_read_where_they_were_written() {
        for (lanes, apart) in [(4, false), (4, true), (2, true), (1, false), (1, true)] {
            let layout = PolynomialWord { lanes, widths: WIDTHS.into() };
            let (quad, step, bits) = (count_bits(QUADS), count_bits(QUADS * (4 / lanes)), base_bits(QUADS));
            let widths = [1, 1, quad, 4 * FILL, 1, BUFFER_BITS, step, layout.bits(), BUFFER_BITS, step, 1, 1, bits];
            let mut stimulus = random_words(20000, &widths);
            for (cycle, inputs) in stimulus.iter_mut().enumerate().take(4) {
                // The base of the first write is not yet known; every step of a quad is written before the last one.
                inputs[4] = Word::from(cycle > 0 && lanes < 4);
                inputs[6] = Word::from(cycle.saturating_sub(1) as u64 % (4 / lanes as u64));
            }
            let store = Store::new(layout.clone(), QUADS, FILL, apart);
            let mut buffers = Buffers {
                apart,
                lanes,
                content: [BUFFERS * QUADS, QUADS].map(|quads| [vec![None; quads], vec![None; quads]]),
                asked: Vec::new(),
                from: None,
                write_base: 0,
                from_start: Default::default(),
                read: Default::default(),
                out: Default::default(),
                shown: Default::default(),
                parts: Default::default(),
                shows: Default::default(),
                step: Default::default(),
            };
            check(&kernel_of(&store), &stimulus, &mut buffers);
        }
    }
}
