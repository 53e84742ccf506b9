//! Signals whose width the scene decides.
//!
//! rust-hdl's `Signal<D, Bits<N>>` fixes N at compile time, but here a scene file read at run time decides every width.
//! [`Wire`] is a rust-hdl atom like `Signal`, usable in the designs, checks and waveforms of rust-hdl,
//! that carries its width as a value. Its content is a [`Word`], a plain bit vector; the primitives decide whether it
//! is signed.

use std::marker::PhantomData;
use std::sync::Arc;

use rust_hdl::prelude::*;

/// 64-bit limbs in a [`Word`].
const LIMBS: usize = 20;

/// Widest wire: 1280 bits, more than a quad of cubic polynomials takes.
pub const MAX_BITS: usize = 64 * LIMBS;

/// A bit vector, least significant bit first. Bits beyond a wire's width are zero.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Word([u64; LIMBS]);

impl Default for Word {
    fn default() -> Self {
        Word([0; LIMBS])
    }
}

impl std::fmt::Debug for Word {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let top = self.0.iter().rposition(|&limb| limb != 0).unwrap_or(0);
        write!(f, "0x{:x}", self.0[top])?;
        self.0[..top].iter().rev().try_for_each(|limb| write!(f, "{limb:016x}"))
    }
}

impl From<u64> for Word {
    fn from(value: u64) -> Self {
        let mut word = Word::default();
        word.0[0] = value;
        word
    }
}

impl From<bool> for Word {
    fn from(bit: bool) -> Self {
        Word::from(u64::from(bit))
    }
}

impl Word {
    /// The unsigned field of `bits` (1..=64) bits at `offset`.
    pub fn field(&self, offset: usize, bits: usize) -> u64 {
        let (limb, shift) = (offset / 64, offset % 64);
        let mut value = self.0[limb] >> shift;
        if shift + bits > 64 {
            value |= self.0[limb + 1] << (64 - shift);
        }
        value & (u64::MAX >> (64 - bits))
    }

    /// Field `index` of a word of signed fields, each `bits` wide, sign-extended.
    pub fn signed(&self, index: usize, bits: usize) -> i64 {
        (self.field(index * bits, bits) << (64 - bits)) as i64 >> (64 - bits)
    }

    /// Writes the low `bits` bits of `value` at `offset`.
    pub fn set(&mut self, offset: usize, bits: usize, value: u64) {
        let value = value & (u64::MAX >> (64 - bits));
        let mask = u64::MAX >> (64 - bits);
        let (limb, shift) = (offset / 64, offset % 64);
        self.0[limb] = self.0[limb] & !(mask << shift) | value << shift;
        if shift + bits > 64 {
            let over = 64 - shift;
            self.0[limb + 1] = self.0[limb + 1] & !(mask >> over) | value >> over;
        }
    }

    /// The word with its low `bits` bits inverted.
    pub fn complement(&self, bits: usize) -> Self {
        let mut word = *self;
        for offset in (0..bits).step_by(64) {
            let some = (bits - offset).min(64);
            word.set(offset, some, !self.field(offset, some));
        }
        word
    }

    /// A word of signed fields, field 0 in the least significant bits, each truncated to `bits` bits.
    pub fn of_fields(fields: &[i64], bits: usize) -> Self {
        let mut word = Word::default();
        for (index, &field) in fields.iter().enumerate() {
            word.set(index * bits, bits, field as u64);
        }
        word
    }

    /// Sets the word from limbs of 64 bits, least significant first; the others become 0.
    pub fn set_limbs(&mut self, limbs: &[u64]) {
        self.0[..limbs.len()].copy_from_slice(limbs);
        self.0[limbs.len()..].fill(0);
    }

    /// Limbs of 64 bits, least significant first.
    pub fn limbs(&self) -> &[u64] {
        &self.0
    }

    /// The low 64 bits as an unsigned number.
    pub fn number(&self) -> u64 {
        self.0[0]
    }
}

/// What a wire holds: the limbs of a [`Word`], least significant first, without zeros at the end except for that of 0.
///
/// A simulation copies and compares the values of all wires in each of its rounds. Nearly all fit 64 bits, so that these
/// are held in place, and the limbs of a longer one are shared between its copies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// At most 64 bits.
    Short(u64),
    /// More; the last limb is not 0.
    Long(Arc<[u64]>),
}

impl Default for Value {
    fn default() -> Self {
        Value::Short(0)
    }
}

impl From<u64> for Value {
    fn from(value: u64) -> Self {
        Value::Short(value)
    }
}

impl From<bool> for Value {
    fn from(bit: bool) -> Self {
        Value::Short(u64::from(bit))
    }
}

impl From<Word> for Value {
    fn from(word: Word) -> Self {
        let mut value = Value::default();
        value.set_limbs(word.limbs());
        value
    }
}

impl Value {
    /// Limbs of 64 bits, least significant first; those that it lacks are zeros.
    pub fn limbs(&self) -> &[u64] {
        match self {
            Value::Short(limb) => std::slice::from_ref(limb),
            Value::Long(limbs) => limbs,
        }
    }

    /// Takes limbs of 64 bits, least significant first; a value that has them already stays as it is.
    pub fn set_limbs(&mut self, limbs: &[u64]) {
        match limbs.iter().rposition(|&limb| limb != 0) {
            None => *self = Value::Short(0),
            Some(0) => *self = Value::Short(limbs[0]),
            Some(top) if self.limbs() == &limbs[..=top] => {}
            Some(top) => *self = Value::Long(limbs[..=top].into()),
        }
    }

    /// The value as a word.
    pub fn word(&self) -> Word {
        let mut word = Word::default();
        word.set_limbs(self.limbs());
        word
    }
}

/// A signal of direction `D` with a width known at run time.
#[derive(Clone, Debug)]
pub struct Wire<D: Direction> {
    /// The value after the next update.
    pub next: Value,
    value: Value,
    changed: bool,
    claimed: bool,
    id: usize,
    bits: usize,
    direction: PhantomData<D>,
}

impl<D: Direction> Wire<D> {
    /// A wire of `bits` bits, 1..=[`MAX_BITS`].
    ///
    /// # Panics
    /// If `bits` is outside this range: a defect of the caller.
    pub fn new(bits: usize) -> Self {
        assert!((1..=MAX_BITS).contains(&bits), "a wire of {bits} bits");
        Wire {
            next: Value::default(),
            value: Value::default(),
            changed: false,
            claimed: false,
            id: rust_hdl::core::signal::get_signal_id(),
            bits,
            direction: PhantomData,
        }
    }

    /// The current value.
    pub fn val(&self) -> Value {
        self.value.clone()
    }

    /// The limbs of the current value, as [`Value::limbs`].
    pub fn limbs(&self) -> &[u64] {
        self.value.limbs()
    }

    /// The width in bits.
    pub fn width(&self) -> usize {
        self.bits
    }
}

impl<D: Direction> Logic for Wire<D> {
    fn update(&mut self) {}
    fn connect(&mut self) {
        self.claimed = true;
    }
}

impl<D: Direction> Block for Wire<D> {
    fn connect_all(&mut self) {}

    fn update_all(&mut self) {
        self.changed = self.value != self.next;
        if self.changed {
            self.value = self.next.clone();
        }
    }

    fn has_changed(&self) -> bool {
        self.changed
    }

    fn accept(&self, name: &str, probe: &mut dyn rust_hdl::core::probe::Probe) {
        probe.visit_atom(name, self);
    }
}

impl<D: Direction> Atom for Wire<D> {
    fn bits(&self) -> usize {
        self.bits
    }

    fn connected(&self) -> bool {
        self.claimed
    }

    fn changed(&self) -> bool {
        self.changed
    }

    fn kind(&self) -> AtomKind {
        D::KIND
    }

    fn descriptor(&self) -> TypeDescriptor {
        TypeDescriptor { name: format!("Wire::<{}>", self.bits), kind: TypeKind::Bits(self.bits) }
    }

    fn vcd(&self) -> VCDValue {
        // VCD is most significant bit first.
        let word = self.value.word();
        let bit = |at| if word.field(at, 1) == 1 { vcd::Value::V1 } else { vcd::Value::V0 };
        VCDValue::Vector((0..self.bits).rev().map(bit).collect())
    }

    fn id(&self) -> usize {
        self.id
    }

    fn verilog(&self) -> VerilogLiteral {
        // rust-hdl prints this value for constants only; a wire is never constant.
        self.limbs()[0].into()
    }

    fn constraints(&self) -> Vec<PinConstraint> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complement_turns_its_bits_and_no_other() {
        let word = Word::of_fields(&[-3, 5, 0], 40);
        let turned = word.complement(100);
        assert_eq!(
            (0..120).filter(|&at| turned.field(at, 1) == word.field(at, 1)).collect::<Vec<_>>(),
            (100..120).collect::<Vec<_>>()
        );
        assert_eq!(turned.complement(100), word);
    }

    #[test]
    fn a_value_has_one_form_and_gives_its_word_back() {
        let mut value = Value::default();
        for limbs in [&[0, 7, 0][..], &[7, 0, 0], &[0; 20], &[1, 2, 3], &[1, 2, 3, 0], &[9]] {
            value.set_limbs(limbs);
            let mut word = Word::default();
            word.set_limbs(limbs);
            assert_eq!((value.word(), &Value::from(word)), (word, &value));
            assert!(value.limbs().len() == 1 || value.limbs().last() != Some(&0), "{value:?}");
        }
        assert_eq!(value, Value::from(9));
    }

    #[test]
    fn fields_straddle_limbs() {
        let fields: Vec<i64> = (0..40).map(|i| (i * 977 - 15_000) % (1 << 25)).collect();
        let word = Word::of_fields(&fields, 27);
        for (index, &field) in fields.iter().enumerate() {
            assert_eq!(word.signed(index, 27), field);
        }
        assert_eq!(Word::of_fields(&[-1, 0], 48).field(40, 16), 0xff);
    }
}
