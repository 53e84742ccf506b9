//! What a core has outside and between its blocks: streams of whole bytes, the pins of each bus, accesses of its registers.

use dermis_golden::wire::registers::{ADDRESS_BITS, REGISTER_BITS};

use crate::bundle;
use crate::primitives::Arrays;

/// Bytes of a word of the input.
pub const WORD_BYTES: usize = 4;
/// Bits of a frame's identifier, `tid`, which its sender chooses; of several arrays the number of the frame's is below them.
pub const ID_BITS: usize = 4;

/// Bits of `tid`.
pub(crate) fn id_bits(arrays: Arrays) -> usize {
    ID_BITS + arrays.bits
}

bundle! {
    /// A stream of whole bytes whose frames have identifiers.
    pub struct CoreStream {
        bits: usize,
        user_bits: usize,
        id_bits: usize,
    }
    signals CoreStreamSignals: true => {
        out data "tdata": bits;
        /// Bytes of the beat that are there; valid with `{}_tvalid`.
        out keep "tkeep": bits / 8;
        /// A bit per word that is no force, and above them whether the frame is spoiled; valid with `{}_tvalid`.
        out user "tuser": user_bits;
        /// Identifier of the frame, the same in all its beats; of several arrays the low bits are the number of the frame's. Valid
        /// with `{}_tvalid`.
        out id "tid": id_bits;
        /// A beat is offered on `{}_tdata`; it is held until `{}_tready`.
        out valid "tvalid";
        /// The beat is accepted in this cycle.
        in ready "tready";
        /// The beat is the last of its frame; valid with `{}_tvalid`.
        out last "tlast";
    }
}

impl CoreStream {
    /// Codes, one in each beat.
    pub(super) fn of_codes(arrays: Arrays) -> Self {
        CoreStream { bits: 8 * WORD_BYTES, user_bits: 0, id_bits: id_bits(arrays) }
    }

    /// Forces and statuses, so many words in a beat.
    pub(super) fn of_words(words: usize, arrays: Arrays) -> Self {
        CoreStream { bits: REGISTER_BITS * words, user_bits: words + 1, id_bits: id_bits(arrays) }
    }
}

bundle! {
    /// AXI4-Lite.
    pub struct AxiLitePins {
        /// The block has this bus.
        pub(super) there: bool,
    }
    signals AxiLiteSignals: *there => {
        /// Address of a write in bytes; valid with `{}_awvalid`.
        out awaddr "awaddr": ADDRESS_BITS;
        /// An address is offered; the sender holds it until `{}_awready`.
        out awvalid "awvalid";
        /// The address is accepted in this cycle.
        in awready "awready";
        /// Data of a write; valid with `{}_wvalid`.
        out wdata "wdata": REGISTER_BITS;
        /// Bytes of a write that count; valid with `{}_wvalid`.
        out wstrb "wstrb": REGISTER_BITS / 8;
        /// Data are offered; the sender holds them until `{}_wready`.
        out wvalid "wvalid";
        /// The data are accepted in this cycle.
        in wready "wready";
        /// 0 or SLVERR; valid with `{}_bvalid`.
        in bresp "bresp": 2;
        /// The answer of a write; it is held until `{}_bready`.
        in bvalid "bvalid";
        /// The answer is accepted in this cycle.
        out bready "bready";
        /// Address of a read in bytes; valid with `{}_arvalid`.
        out araddr "araddr": ADDRESS_BITS;
        /// An address is offered; the sender holds it until `{}_arready`.
        out arvalid "arvalid";
        /// The address is accepted in this cycle.
        in arready "arready";
        /// Content of the register; valid with `{}_rvalid`.
        in rdata "rdata": REGISTER_BITS;
        /// 0 or SLVERR; valid with `{}_rvalid`.
        in rresp "rresp": 2;
        /// The answer of a read; it is held until `{}_rready`.
        in rvalid "rvalid";
        /// The answer is accepted in this cycle.
        out rready "rready";
    }
}

bundle! {
    /// Wishbone B4, classic, with addresses of words.
    pub struct WishbonePins {
        /// The block has this bus.
        pub(super) there: bool,
    }
    signals WishboneSignals: *there => {
        /// A cycle of the bus.
        out cyc "cyc";
        /// An access, held with all that belongs to it until the answer; valid with `{}_cyc`.
        out stb "stb";
        /// The access is a write; valid with `{}_stb`.
        out we "we";
        /// Number of the register; valid with `{}_stb`.
        out adr "adr": ADDRESS_BITS - 2;
        /// Data of a write; valid with `{}_stb` and `{}_we`.
        out dat_w "dat_w": REGISTER_BITS;
        /// Bytes of a write that count; valid with `{}_stb` and `{}_we`.
        out sel "sel": REGISTER_BITS / 8;
        /// Content of the register; valid with `{}_ack`.
        in dat_r "dat_r": REGISTER_BITS;
        /// The access is done.
        in ack "ack";
        /// The access is refused.
        in err "err";
    }
}

bundle! {
    /// Accesses of the registers, from a bus.
    pub struct Accesses {}
    signals AccessSignals: true => {
        /// An access in this cycle.
        out select "select";
        /// The access is a write; valid with `{}_select`.
        out write "write";
        /// Address in bytes; valid with `{}_select`.
        out address "address": ADDRESS_BITS;
        /// Data of a write; valid with `{}_select` and `{}_write`.
        out data "data": REGISTER_BITS;
        /// Bytes of a write that count; valid with `{}_select` and `{}_write`.
        out strobe "strobe": REGISTER_BITS / 8;
        /// Content of the register; valid in the cycle after `{}_select`.
        in content "content": REGISTER_BITS;
        /// The access is an error; valid in the cycle after `{}_select`.
        in refused "refused";
    }
}
