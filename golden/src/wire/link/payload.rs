//! Payloads with fields. Each is defined once, as structure, bytes, and rows of the documentation and the C header.

use serde::Serialize;

/// A field of a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// Rust type: `u8`, `i32`, …
    pub kind: &'static str,
    /// Size in bytes.
    pub bytes: usize,
    /// Meaning, in words.
    pub about: &'static str,
}

/// Defines a payload: structure, fields as data, little-endian bytes.
macro_rules! payload {
    ($(#[doc = $about:literal])* $name:ident { $($(#[doc = $doc:literal])* $field:ident: $kind:ident,)* }) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
        pub struct $name {
            $($(#[doc = $doc])* pub $field: $kind,)*
        }

        impl $name {
            /// The fields in order; there are no gaps between them.
            pub const FIELDS: &'static [Field] = &[$(Field {
                name: stringify!($field),
                kind: stringify!($kind),
                bytes: size_of::<$kind>(),
                about: concat!($($doc),*),
            }),*];
            /// Size in bytes.
            pub const BYTES: usize = 0 $(+ size_of::<$kind>())*;

            /// The payload as little-endian bytes.
            pub fn to_bytes(&self) -> Vec<u8> {
                let mut bytes = Vec::with_capacity(Self::BYTES);
                $(bytes.extend(self.$field.to_le_bytes());)*
                bytes
            }

            /// Reads the payload from its bytes; `None` if their number is wrong.
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
        /// Packet type.
        kind: u8,
        /// Sequence number: chosen by the host, repeated in the answer.
        sequence: u8,
        /// Length of the payload in bytes.
        length: u16,
    }
}

payload! {
    /// What a board is and which scene it implements.
    Identity {
        /// Version of the packet format.
        version: u16,
        /// Rows of the array.
        rows: u16,
        /// Columns of the array.
        cols: u16,
        /// Width of a code in bits.
        input_bits: u8,
        /// Beats of a status.
        status_beats: u8,
        /// CRC-32 of everything in the scene that determines the bits of the answers.
        scene: u32,
        /// Clock of the engine, Hz.
        clock_hz: u32,
        /// Bit rate of the link, bit/s: that of the UART, or the highest clock of the SPI.
        bit_rate: u32,
        /// Statuses of a frame: one per subarray, or one per contact that may have a μ of its own.
        statuses: u16,
        /// Requests that the board does not support and counts as of unknown type: bit k − 1 for type k. Bit 7: the board scans its array, so a request for a frame has no payload, and its answer ends with the codes.
        left_out: u8,
        /// Width of the label of a taxel's contact in the labels before the statuses; 0: there are no labels.
        label_bits: u8,
    }
}

payload! {
    /// Packets that the board accepted and dropped since reset, modulo 65536; each dropped packet is counted once.
    Counters {
        /// Accepted packets.
        taken: u16,
        /// Dropped: a UART byte without stop bit, or a SLIP escape followed by a byte that is not allowed there.
        framing: u16,
        /// Dropped: the CRC is wrong or missing.
        crc: u16,
        /// Dropped: the board does not know the type.
        unknown_type: u16,
        /// Dropped: the length does not match the length field or the type.
        length: u16,
        /// Dropped: earlier requests had not been answered yet.
        overrun: u16,
    }
}

payload! {
    /// Resultants: exact sums over all taxels.
    Sums {
        /// Σ fx in LSBs of a force word.
        fx: i64,
        /// Σ fy in LSBs of a force word.
        fy: i64,
        /// Σ fz in LSBs of a force word.
        fz: i64,
        /// Σ column · fz in LSBs of a force word.
        moment_x: i64,
        /// Σ row · fz in LSBs of a force word.
        moment_y: i64,
        /// Number of taxels with fz ≠ 0.
        loaded: u64,
    }
}

payload! {
    /// One output beat of the engine, three words.
    Beat {
        /// Force along x in LSBs, or a status word.
        fx: i32,
        /// Force along y in LSBs, or a status word.
        fy: i32,
        /// Normal force in LSBs, or a status word.
        fz: i32,
    }
}
