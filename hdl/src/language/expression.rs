//! Expressions and their operators.
//!
//! | operator | result | operands |
//! |---|---|---|
//! | `a + b` | one bit more than the wider, exact | same signedness |
//! | `a - b` | one bit more than the wider, signed, exact | same signedness |
//! | `a * b` | the sum of the widths, exact | same signedness |
//! | `a & b`, `a \| b`, `a ^ b`, `!a` | the same width | unsigned, same width |
//! | [`Expr::equals`], [`Expr::less`] … | one bit | same signedness |
//! | [`Expr::mux`] | the wider of both | same signedness |
//! | [`Expr::low`], [`Expr::slice`] | the bits named, unsigned | any |
//! | [`Expr::round_shift`] | (a + 2^(n−1)) >> n, n bits less and one more | any |
//!
//! No operator loses a bit by itself: what is meant to be cut off is cut by [`Expr::low`] or [`Expr::slice`].

use std::cell::RefCell;
use std::fmt::{Display, Formatter};
use std::ops::{Add, BitAnd, BitOr, BitXor, Mul, Not, Sub};

use super::error::KernelError;
use super::kernel::{Binary, Defect, Kernel, Node, NodeId, SignalId, Type, Unary};

/// Widest operand of a sum, product, comparison by size or shift by a signal.
pub const ARITHMETIC_BITS: usize = 127;

/// An expression of a kernel under construction.
#[derive(Clone, Copy, Debug)]
pub struct Expr<'k> {
    pub(super) kernel: &'k RefCell<Kernel>,
    pub(super) id: NodeId,
}

impl Display for Expr<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.kernel.borrow().describe(self.id))
    }
}

impl<'k> Expr<'k> {
    /// Width and signedness.
    pub fn ty(&self) -> Type {
        self.kernel.borrow().ty(self.id)
    }

    /// Width in bits.
    pub fn bits(&self) -> usize {
        self.ty().bits
    }

    /// The expression of `node` in the kernel under construction.
    pub(super) fn of(kernel: &'k RefCell<Kernel>, node: Node, ty: Type) -> Self {
        let id = kernel.borrow_mut().intern(node, ty);
        Expr { kernel, id }
    }

    /// The unsigned constant `value` of `bits` bits in the kernel under construction.
    pub(super) fn constant_of(kernel: &'k RefCell<Kernel>, bits: usize, value: u64) -> Self {
        let mut limbs = vec![0; bits.div_ceil(64)];
        limbs[0] = value;
        let constant = Expr::of(kernel, Node::Constant(limbs), Type::unsigned(bits));
        if bits < 64 && value >> bits != 0 {
            constant.width_error(format!("{value} needs more bits"));
        }
        constant
    }

    fn node(self, node: Node, ty: Type) -> Self {
        Expr::of(self.kernel, node, ty)
    }

    /// The unsigned constant `value` of `bits` bits.
    fn number(self, bits: usize, value: u64) -> Self {
        Expr::constant_of(self.kernel, bits, value)
    }

    fn block(self) -> String {
        self.kernel.borrow().block.clone()
    }

    fn fail(self, error: KernelError) {
        self.kernel.borrow_mut().fail(error);
    }

    /// Records that the expression has an impossible width.
    pub(super) fn width_error(self, reason: String) {
        self.defect(Defect::Width(reason));
    }

    /// Records a defect. The expression stays what it is, so that the signal that takes it can be named.
    fn defect(self, defect: Defect) {
        self.kernel.borrow_mut().defects.push((self.id, defect));
    }

    /// The node, if it is a constant.
    fn constant(self) -> Option<Vec<u64>> {
        match &self.kernel.borrow().nodes[self.id].0 {
            Node::Constant(limbs) => Some(limbs.clone()),
            _ => None,
        }
    }

    /// Whether this is the same expression as `other`, of the same operands.
    pub fn is_same(self, other: Expr<'k>) -> bool {
        self.id == other.id
    }

    /// The same bits as a two's complement number.
    pub fn signed(self) -> Self {
        self.cast(true)
    }

    /// The same bits as an unsigned number.
    pub fn unsigned(self) -> Self {
        self.cast(false)
    }

    fn cast(self, signed: bool) -> Self {
        let ty = self.ty();
        match self.constant() {
            _ if ty.signed == signed => self,
            Some(limbs) => self.node(Node::Constant(limbs), Type { signed, ..ty }),
            None => self.node(Node::Cast(self.id), Type { signed, ..ty }),
        }
    }

    /// The same number with `bits` bits, by zeros or by its sign.
    pub fn extend(self, bits: usize) -> Self {
        let ty = self.ty();
        if bits == ty.bits {
            return self;
        }
        let node = self.node(Node::Extend(self.id), Type { bits, ..ty });
        if bits < ty.bits {
            node.width_error(format!("{} bits cannot be extended to {bits}", ty.bits));
        }
        node
    }

    /// Bits `low` to `low + bits − 1`, unsigned.
    pub fn slice(self, low: usize, bits: usize) -> Self {
        let ty = self.ty();
        if bits == 0 || low + bits > ty.bits {
            let node = self.node(Node::Slice(self.id, low), Type::unsigned(bits.max(1)));
            node.width_error(format!("{bits} bits from bit {low} on, of {}", ty.bits));
            return node;
        }
        let inner = self.kernel.borrow().nodes[self.id].0.clone();
        let at = |id| Expr { kernel: self.kernel, id };
        match inner {
            _ if low == 0 && bits == ty.bits => self.unsigned(),
            Node::Slice(from, offset) => at(from).slice(offset + low, bits),
            Node::Cast(from) => at(from).slice(low, bits),
            Node::Extend(from) if low + bits <= at(from).bits() => at(from).slice(low, bits),
            Node::Binary(op @ (Binary::Add | Binary::Sub), a, b) if low == 0 => {
                let narrow = |id| if at(id).bits() > bits { at(id).low(bits) } else { at(id) };
                let (a, b) = (narrow(a), narrow(b));
                // Without the upper bits the sign of an operand matters only where it is still extended.
                self.node(Node::Binary(op, a.id, b.id), Type::unsigned(bits))
            }
            _ => self.node(Node::Slice(self.id, low), Type::unsigned(bits)),
        }
    }

    /// This unsigned number plus `number`, modulo two to the power of its width.
    pub fn plus(self, number: u64) -> Self {
        (self + self.number(self.bits(), number)).low(self.bits())
    }

    /// This unsigned number minus `number`, modulo two to the power of its width.
    pub fn minus(self, number: u64) -> Self {
        (self - self.number(self.bits(), number)).low(self.bits())
    }

    /// The low `bits` bits, unsigned; of a sum or difference the number modulo 2^bits.
    pub fn low(self, bits: usize) -> Self {
        self.slice(0, bits)
    }

    /// One bit.
    pub fn at(self, bit: usize) -> Self {
        self.slice(bit, 1)
    }

    /// The same number with `bits` bits: extended as by [`Expr::extend`], or modulo 2^bits.
    pub fn resize(self, bits: usize) -> Self {
        match bits < self.bits() {
            true => self.low(bits).cast(self.ty().signed),
            false => self.extend(bits),
        }
    }

    /// These bits `times` times, unsigned.
    pub fn repeat(self, times: usize) -> Self {
        concat(&vec![self; times])
    }

    /// The most significant bit.
    pub fn top(self) -> Self {
        self.at(self.bits() - 1)
    }

    /// Concatenation: this in the more significant bits, `low` below.
    pub fn concat(self, low: Expr<'k>) -> Self {
        concat(&[self, low])
    }

    /// `when` if this bit is 1, else `otherwise`.
    pub fn mux(self, when: Expr<'k>, otherwise: Expr<'k>) -> Self {
        let (a, b) = when.same_width(otherwise);
        let node = self.node(Node::Mux(self.id, a.id, b.id), a.ty());
        if self.bits() != 1 {
            node.width_error(format!("a condition of {} bits", self.bits()));
        }
        when.same_signs(otherwise, node);
        node
    }

    /// The value of the first of `arms` whose number equals this, else `default`.
    pub fn case(self, arms: &[(u64, Expr<'k>)], default: Expr<'k>) -> Self {
        arms.iter()
            .rev()
            .fold(default, |other, &(number, value)| self.equals(self.number(self.bits(), number)).mux(value, other))
    }

    /// The entry of `table` at this unsigned index, of `bits` bits, without sign; as many entries as indices.
    pub fn table(self, bits: usize, table: &[u64]) -> Self {
        let mut entries: Vec<Expr<'k>> = table.iter().map(|&entry| self.number(bits, entry)).collect();
        let indices = 1 << self.bits();
        entries.resize(indices, self.number(bits, 0));
        for bit in 0..self.bits() {
            entries = entries
                .chunks(2)
                .map(|pair| if pair[0].id == pair[1].id { pair[0] } else { self.at(bit).mux(pair[1], pair[0]) })
                .collect();
        }
        if table.len() != indices {
            entries[0].width_error(format!("a table of {} entries for {indices} indices", table.len()));
        }
        entries[0]
    }

    /// Whether the numbers are equal.
    pub fn equals(self, other: Expr<'k>) -> Self {
        self.compare(Binary::Equal, other)
    }

    /// Whether the numbers differ.
    pub fn differs(self, other: Expr<'k>) -> Self {
        !self.equals(other)
    }

    /// Whether this unsigned number is `number`.
    pub fn is(self, number: u64) -> Self {
        self.equals(self.number(self.bits(), number))
    }

    /// Whether this number is less than `other`.
    pub fn less(self, other: Expr<'k>) -> Self {
        let node = self.compare(Binary::Less, other);
        node.arithmetic(self.bits().max(other.bits()));
        node
    }

    fn compare(self, operator: Binary, other: Expr<'k>) -> Self {
        let (a, b) = self.same_width(other);
        let node = self.node(Node::Binary(operator, a.id, b.id), Type::unsigned(1));
        self.same_signs(other, node);
        node
    }

    /// 1 if all bits are 1.
    pub fn all(self) -> Self {
        self.unary(Unary::All, 1)
    }

    /// 1 if a bit is 1.
    pub fn any(self) -> Self {
        self.unary(Unary::Any, 1)
    }

    /// 1 if the number of bits that are 1 is odd.
    pub fn parity(self) -> Self {
        self.unary(Unary::Parity, 1)
    }

    fn unary(self, operator: Unary, bits: usize) -> Self {
        self.node(Node::Unary(operator, self.id), Type::unsigned(bits))
    }

    /// This number times 2^`by`, exact.
    pub fn shift_left(self, by: usize) -> Self {
        if by == 0 {
            return self;
        }
        let shifted = self.unsigned().concat(self.number(by, 0));
        shifted.cast(self.ty().signed)
    }

    /// This number divided by 2^`by`, rounded down, `by` bits less.
    pub fn shift_right(self, by: usize) -> Self {
        self.slice(by, self.bits().saturating_sub(by)).cast(self.ty().signed)
    }

    /// This number divided by 2^`by`, rounded to the nearest, halves up.
    pub fn round_shift(self, by: usize) -> Self {
        if by == 0 {
            return self;
        }
        let half = self.number(by + 1, 1 << (by - 1)).cast(self.ty().signed);
        (self + half).shift_right(by)
    }

    /// Shift to the left by an unsigned signal; bits beyond this width are dropped.
    pub fn shift_left_by(self, by: Expr<'k>) -> Self {
        self.shift(Binary::ShiftLeft, by)
    }

    /// Shift to the right by an unsigned signal: by zeros, or by the sign of a signed number.
    pub fn shift_right_by(self, by: Expr<'k>) -> Self {
        self.shift(Binary::ShiftRight, by)
    }

    fn shift(self, operator: Binary, by: Expr<'k>) -> Self {
        let node = self.node(Node::Binary(operator, self.id, by.id), self.ty());
        node.arithmetic(self.bits());
        if by.ty().signed {
            node.defect(Defect::MixedSigns);
        }
        node
    }

    fn same_width(self, other: Expr<'k>) -> (Self, Self) {
        let bits = self.bits().max(other.bits());
        (self.extend(bits), other.extend(bits))
    }

    fn same_signs(self, other: Expr<'k>, node: Expr<'k>) {
        if self.ty().signed != other.ty().signed {
            node.defect(Defect::MixedSigns);
        }
    }

    /// Checks the width of the widest operand of this arithmetic expression.
    fn arithmetic(self, widest: usize) {
        if widest > ARITHMETIC_BITS {
            self.width_error(format!("{widest} bits, at most {ARITHMETIC_BITS} in arithmetic"));
        }
    }

    fn binary(self, operator: Binary, other: Expr<'k>, ty: Type) -> Self {
        let node = self.node(Node::Binary(operator, self.id, other.id), ty);
        node.arithmetic(node.bits());
        self.same_signs(other, node);
        node
    }

    fn bitwise(self, operator: Binary, other: Expr<'k>) -> Self {
        let node = self.node(Node::Binary(operator, self.id, other.id), Type::unsigned(self.bits()));
        if self.bits() != other.bits() {
            node.width_error(format!("operands of {} and {} bits", self.bits(), other.bits()));
        }
        if self.ty().signed || other.ty().signed {
            node.defect(Defect::MixedSigns);
        }
        node
    }

    /// The value with the width of `signal`.
    pub(crate) fn assigned_to(self, signal: SignalId) -> Self {
        let (name, to) = {
            let kernel = self.kernel.borrow();
            (kernel.signals[signal].name.clone(), kernel.signals[signal].ty)
        };
        let ty = self.ty();
        let (block, expression) = (self.block(), self.to_string());
        if ty.signed != to.signed {
            self.fail(KernelError::MixedSigns {
                block,
                signal: name.clone(),
                expression: format!("{name} = {expression}"),
            });
            return self.number(to.bits, 0).cast(to.signed);
        }
        if ty.bits > to.bits {
            let (bits, room) = (ty.bits, to.bits);
            self.fail(KernelError::LostBits { block, signal: name, expression, bits, room });
            return self.number(to.bits, 0).cast(to.signed);
        }
        self.extend(to.bits)
    }
}

/// Concatenation of `parts`, most significant first; unsigned.
///
/// # Panics
/// Without parts: a defect of the caller.
pub fn concat<'k>(parts: &[Expr<'k>]) -> Expr<'k> {
    match parts {
        [one] => one.unsigned(),
        _ => {
            let bits = parts.iter().map(Expr::bits).sum();
            let ids = parts.iter().map(|part| part.unsigned().id).collect();
            parts[0].node(Node::Concat(ids), Type::unsigned(bits))
        }
    }
}

impl<'k> Add for Expr<'k> {
    type Output = Expr<'k>;

    fn add(self, other: Expr<'k>) -> Expr<'k> {
        let bits = self.bits().max(other.bits()) + 1;
        self.binary(Binary::Add, other, Type { bits, signed: self.ty().signed })
    }
}

impl<'k> Sub for Expr<'k> {
    type Output = Expr<'k>;

    // A difference has one bit more than its operands.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn sub(self, other: Expr<'k>) -> Expr<'k> {
        let bits = self.bits().max(other.bits()) + 1;
        self.binary(Binary::Sub, other, Type::signed(bits))
    }
}

impl<'k> Mul for Expr<'k> {
    type Output = Expr<'k>;

    // A product has the bits of both operands.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Expr<'k>) -> Expr<'k> {
        let bits = self.bits() + other.bits();
        self.binary(Binary::Mul, other, Type { bits, signed: self.ty().signed })
    }
}

impl<'k> BitAnd for Expr<'k> {
    type Output = Expr<'k>;

    fn bitand(self, other: Expr<'k>) -> Expr<'k> {
        self.bitwise(Binary::And, other)
    }
}

impl<'k> BitOr for Expr<'k> {
    type Output = Expr<'k>;

    fn bitor(self, other: Expr<'k>) -> Expr<'k> {
        self.bitwise(Binary::Or, other)
    }
}

impl<'k> BitXor for Expr<'k> {
    type Output = Expr<'k>;

    fn bitxor(self, other: Expr<'k>) -> Expr<'k> {
        self.bitwise(Binary::Xor, other)
    }
}

impl<'k> Not for Expr<'k> {
    type Output = Expr<'k>;

    fn not(self) -> Expr<'k> {
        self.unary(Unary::Not, self.bits())
    }
}
