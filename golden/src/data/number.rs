//! Numbers in the bytes of other programs' files: integers of 1 to 8 bytes, floats of 2, 4 and 8, in both byte orders.

/// What the bits of a number mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberKind {
    /// Two's complement.
    Signed,
    /// Without sign.
    Unsigned,
    /// IEEE 754, of 2, 4 or 8 bytes.
    Float,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NumberFormat {
    /// What its bits mean.
    pub kind: NumberKind,
    /// Bytes, 1 to 8.
    pub width: usize,
    /// Whether the most significant byte comes first.
    pub big_endian: bool,
}

impl NumberFormat {
    /// The number in as many bytes as it has; integers beyond 2⁵³ are rounded.
    pub fn value(self, bytes: &[u8]) -> f64 {
        let NumberFormat { kind, width, big_endian } = self;
        let mut word = 0u64;
        for (k, byte) in bytes.iter().enumerate() {
            let place = if big_endian { width - 1 - k } else { k };
            word |= u64::from(*byte) << (8 * place);
        }
        match (kind, width) {
            (NumberKind::Unsigned, _) => word as f64,
            (NumberKind::Signed, width) => {
                let unused = 64 - 8 * width as u32;
                ((word << unused) as i64 >> unused) as f64
            }
            // The casts keep the word's width.
            (NumberKind::Float, 2) => half(word as u16),
            (NumberKind::Float, 4) => f64::from(f32::from_bits(word as u32)),
            (NumberKind::Float, _) => f64::from_bits(word),
        }
    }
}

/// A float of 16 bits: sign, 5 bits exponent, 10 bits fraction.
fn half(word: u16) -> f64 {
    let (exponent, fraction) = (i32::from(word >> 10 & 31), f64::from(word & 1023));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if word >> 15 == 1 {
        -size
    } else {
        size
    }
}
