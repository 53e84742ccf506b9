//! The payloads with fields, each defined once: structure, bytes, and the rows of the documentation and the C header.

use serde::Serialize;

/// A field of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its Rust type: `u8`, `i32`, …
    pub kind: &'static str,
    /// Its size in bytes.
    pub bytes: usize,
    /// What it means.
    pub about: &'static str,
}

/// Defines a payload: its structure, its fields as data, and its little-endian bytes.
macro_rules! payload {
    ($(#[doc = $about:literal])* $name:ident { $($(#[doc = $doc:literal])* $field:ident: $kind:ident,)* }) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct $name {
            $($(#[doc = $doc])* pub $field: $kind,)*
        }

        impl $name {
            /// The fields in order, without gaps.
            pub const FIELDS: &'static [Field] = &[$(Field {
                name: stringify!($field),
                kind: stringify!($kind),
                bytes: size_of::<$kind>(),
                about: concat!($($doc),*),
            }),*];
            /// Size in bytes.
            pub const BYTES: usize = 0 $(+ size_of::<$kind>())*;

            /// The bytes, little-endian.
            pub fn to_bytes(&self) -> Vec<u8> {
                let mut bytes = Vec::with_capacity(Self::BYTES);
                $(bytes.extend(self.$field.to_le_bytes());)*
                bytes
            }

            /// Reads the bytes back; `None` when their number is wrong.
            pub fn of_bytes(bytes: &[u8]) -> Option<Self> {
                let rest = bytes;
                $(let ($field, rest) = rest.split_first_chunk()?;)*
                rest.is_empty().then(|| $name { $($field: <$kind>::from_le_bytes(*$field)),* })
            }
        }
    };
}

payload! {
    /// The first bytes of every packet.
    Header {
        /// Type.
        kind: u8,
        /// Sequence number: chosen by the host, repeated in the answer.
        sequence: u8,
        /// Bytes of payload.
        length: u16,
    }
}

payload! {
    /// Who a board is.
    Identity {
        /// Version of the packets' meaning.
        version: u16,
        /// Rows of the array.
        rows: u16,
        /// Columns of the array.
        cols: u16,
        /// Bits of a code.
        input_bits: u8,
        /// Status beats per subarray.
        status_beats: u8,
        /// CRC-32 of everything in the scene that decides the answers' bits.
        scene: u32,
        /// The engine's clock, Hz.
        clock_hz: u32,
        /// Bit rate of the link, bit/s: the UART's, or the highest of the SPI's clock.
        bit_rate: u32,
        /// Subarrays.
        subarrays: u16,
        /// Requests that the board leaves out and counts as of unknown type: bit k − 1 for type k.
        left_out: u16,
    }
}

payload! {
    /// Packets that the board took and dropped since reset, modulo 65536; each dropped packet is counted once.
    Counters {
        /// Taken.
        taken: u16,
        /// Dropped: a byte without stop bit on a UART, or a SLIP escape before any other byte than the two allowed.
        framing: u16,
        /// Dropped: the CRC is wrong, or there is none.
        crc: u16,
        /// Dropped: of a type that the board does not know.
        unknown_type: u16,
        /// Dropped: of another length than it says, or than its type has.
        length: u16,
        /// Dropped: came while earlier requests were not answered yet.
        overrun: u16,
    }
}

payload! {
    /// Sums over all taxels, in LSBs of a force word; exact.
    Sums {
        /// Σ fx.
        fx: i64,
        /// Σ fy.
        fy: i64,
        /// Σ fz.
        fz: i64,
        /// Σ column · fz.
        moment_x: i64,
        /// Σ row · fz.
        moment_y: i64,
        /// Taxels with fz ≠ 0.
        loaded: u64,
    }
}

payload! {
    /// Three words, an output beat of the engine.
    Beat {
        /// Along x, or a status word.
        fx: i32,
        /// Along y, or a status word.
        fy: i32,
        /// Normal, or a status word.
        fz: i32,
    }
}
