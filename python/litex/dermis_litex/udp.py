"""Frames from the network to a core, and its results back, in UDP packets; the format is in `packets`.

```text
 UDP port ──> FrameReceiver ──> core ──> ResultSender ──> UDP port
        PacketCheck, two frame buffers   a packet at a time, ShortForces before it
                    └── who asked, by id ──┘
```
"""

from functools import reduce
from operator import and_

from liteeth.common import eth_udp_user_description
from liteeth.mac.crc import LiteEthMACCRC32, LiteEthMACCRCEngine
from litex.gen import Case, Cat, Constant, FSM, If, LiteXModule, Memory, Mux, NextState, NextValue, READ_FIRST, Replicate, Signal
from litex.soc.interconnect import stream
from litex.soc.interconnect.csr import CSRStatus

from dermis_litex.core import ID_BITS, WORD_BITS, require_choice, require_forces, require_one_array, require_width
from dermis_litex.packets import (
    CHECK_WORDS,
    EXPONENT_AT,
    FRAGMENT_WORDS,
    HEADER_WORDS,
    KIND_FRAME,
    KIND_RESULT,
    KIND_SHORT_RESULT,
    LATE,
    MANTISSA_BITS,
    UDP_PORT,
    WORD_BYTES,
    code_words,
    fragment_words,
    short_counts,
)

SEQUENCE_BITS = 32
REQUESTER = [("ip_address", 32), ("port", 16), ("sequence", SEQUENCE_BITS)]
BYTE = 8
# Exponents are 0 to 17.
EXPONENT_BITS = 5
# The words of results: each with what the packet says that begins with it.
RESULT = [
    ("data", WORD_BITS),
    ("clipped", 1),
    ("short", 1),
    ("padded", 1),
    ("exponent", EXPONENT_BITS),
    ("id", ID_BITS),
]


def choose(target, index, values):
    """`target` is the value at `index`."""
    return Case(index, {**{key: target.eq(value) for key, value in enumerate(values)}, "default": target.eq(0)})


class Requesters(LiteXModule):
    """Who sent each frame that is under way: address, port and sequence number, by the frame's id."""

    def __init__(self):
        self.written = stream.Endpoint(REQUESTER)
        self.read = stream.Endpoint(REQUESTER)
        self.write_id = Signal(ID_BITS)
        self.read_id = Signal(ID_BITS)

        # # #

        memory = Memory(sum(width for _, width in REQUESTER), 2**ID_BITS)
        write, read = memory.get_port(write_capable=True), memory.get_port()
        self.specials += memory, write, read
        self.comb += [
            write.adr.eq(self.write_id),
            write.dat_w.eq(self.written.payload.raw_bits()),
            write.we.eq(self.written.valid),
            read.adr.eq(self.read_id),
            self.read.payload.raw_bits().eq(read.dat_r),
        ]


class CRC32(LiteXModule):
    """CRC-32 of the words of a packet, as of Ethernet.

    `ce`: the packet's next word is `data`, its last one with `last`. `value` is the CRC-32 of the words before; `is_right`: `data`
    is the CRC-32 of the words before.
    """

    def __init__(self):
        self.data, self.ce, self.last = Signal(WORD_BITS), Signal(), Signal()
        self.value, self.is_right = Signal(WORD_BITS), Signal()

        # # #

        form = LiteEthMACCRC32
        state = Signal(form.width, reset=form.init)
        self.engine = engine = LiteEthMACCRCEngine(WORD_BITS, form.width, form.polynom)
        self.comb += [
            engine.data.eq(self.data),
            engine.crc_prev.eq(state),
            self.value.eq(state[::-1] ^ form.init),
            self.is_right.eq(self.data == self.value),
        ]
        self.sync += If(self.ce, state.eq(engine.crc_next), If(self.last, state.eq(form.init)))


class PacketCheck(LiteXModule):
    """Packets of the network in; those that are whole leave, without their CRC-32, a word per cycle.

    A packet is whole if its CRC-32 is right, no layer below has found an error, and its length is that of its words. Others, and
    those for which there is no room, have no effect but a cycle of `damaged`. The network cannot wait: `sink` is always ready.
    """

    def __init__(self, words):
        layout = eth_udp_user_description(WORD_BITS)
        self.sink = sink = stream.Endpoint(layout)
        self.source = source = stream.Endpoint(layout)
        self.damaged = Signal()

        # # #

        # Two of the longest packets: one comes while the other leaves.
        bits = (2 * words).bit_length()
        memory = Memory(WORD_BITS, 2**bits)
        write, read = memory.get_port(write_capable=True), memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read
        self.params = params = stream.SyncFIFO(layout.param_layout, 4)
        self.crc = crc = CRC32()

        # Places of the next word, of the packet's first, and of the word that leaves; one bit more tells full from empty.
        place, begin, leaves = Signal(bits + 1), Signal(bits + 1), Signal(bits + 1)
        has_room, had_room, is_whole, count = Signal(), Signal(reset=1), Signal(), Signal(bits + 1)
        self.comb += [
            sink.ready.eq(1),
            crc.data.eq(sink.data),
            crc.ce.eq(sink.valid),
            crc.last.eq(sink.last),
            count.eq(place - begin),
            has_room.eq((place - leaves)[: bits + 1] != 2**bits),
            write.adr.eq(place[:bits]),
            write.dat_w.eq(sink.data),
            write.we.eq(sink.valid & has_room),
            is_whole.eq(
                had_room
                & has_room
                & params.sink.ready
                & crc.is_right
                & (sink.error == 0)
                & (count != 0)
                & (sink.length == WORD_BYTES * (count + CHECK_WORDS))
            ),
            params.sink.valid.eq(sink.valid & sink.last & is_whole),
            params.sink.payload.raw_bits().eq(sink.param.raw_bits()),
            self.damaged.eq(sink.valid & sink.last & ~is_whole),
        ]
        self.sync += If(
            sink.valid,
            place.eq(place + has_room),
            had_room.eq(had_room & has_room),
            If(
                sink.last,
                had_room.eq(1),
                # The CRC-32 does not leave.
                If(is_whole, place.eq(place), begin.eq(place)).Else(place.eq(begin)),
            ),
        )

        at, steps, next_leaves = Signal(bits + 1), Signal(), Signal(bits + 1)
        self.comb += [
            steps.eq(source.valid & source.ready),
            next_leaves.eq(leaves + steps),
            read.adr.eq(next_leaves[:bits]),
            source.valid.eq(params.source.valid),
            source.param.raw_bits().eq(params.source.payload.raw_bits()),
            source.length.eq(params.source.length - WORD_BYTES * CHECK_WORDS),
            source.data.eq(read.dat_r),
            source.last.eq(WORD_BYTES * (at + 1) == source.length),
            params.source.ready.eq(steps & source.last),
        ]
        self.sync += [leaves.eq(next_leaves), If(steps, at.eq(at + 1), If(source.last, at.eq(0)))]


class FrameReceiver(LiteXModule):
    """Packets in, whole frames out: `source` has a code of 32 bits per beat.

    A frame leaves only when all its packets have come; the next is collected meanwhile. Codes of 16 bits are those of the
    converter: they are shifted up to the `code_bits` of the engine. Five numbers count packets: `taken`, `ignored` (late, or come
    before), `refused` (another kind, number of fragments or length), `damaged` (`PacketCheck`), `overrun` (two frames wait already),
    and one frames: `cut` (given up without a packet).
    """

    def __init__(self, taxels, code_bits, code_bytes):
        words = code_words(taxels, code_bytes)
        counts = fragment_words(words)
        self.check = check = PacketCheck(HEADER_WORDS + FRAGMENT_WORDS + CHECK_WORDS)
        # What comes from a block RAM comes late in a cycle. Its port is READ_FIRST: of another one the address has the register, and
        # Yosys would take this one into the block RAM.
        self.words = checked = stream.Buffer(check.source.description)
        self.sink, sink = check.sink, checked.source
        self.source = source = stream.Endpoint([("data", WORD_BITS), ("id", ID_BITS)])
        self.requester = requester = stream.Endpoint(REQUESTER)
        # A whole frame waits until the one before has left.
        self.waits = full = Signal()
        # What becomes of a packet is decided now.
        self.decides = Signal()
        self.counters = {name: Signal(32) for name in ("taken", "ignored", "refused", "damaged", "overrun", "cut")}

        # # #

        self.comb += check.source.connect(checked.sink)
        depth = 2 ** (words - 1).bit_length()
        memory = Memory(WORD_BITS, 2 * depth)
        write, read = memory.get_port(write_capable=True), memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read

        # The frame that is collected, and the newest before it.
        bank, collects = Signal(), Signal()
        sequence, newest, has_newest = Signal(SEQUENCE_BITS), Signal(SEQUENCE_BITS), Signal()
        come = Signal(len(counts))
        ip_address, port = Signal(32), Signal(16)

        # The packet.
        head = Signal(WORD_BITS)
        index, expected = Signal(BYTE), Signal(max=FRAGMENT_WORDS + 1)
        base, at = Signal(max=2 * depth), Signal(max=FRAGMENT_WORDS + 1)
        has_come, is_right = Signal(), Signal()
        age = Signal(SEQUENCE_BITS)
        same, late = Signal(), Signal()
        self.comb += [
            index.eq(head[16:24]),
            choose(expected, index, counts),
            choose(base, index, [number * FRAGMENT_WORDS for number in range(len(counts))]),
            choose(has_come, index, list(come)),
            is_right.eq(
                (head[:8] == KIND_FRAME)
                & (head[24:] == len(counts))
                & (index < len(counts))
                & (sink.length == WORD_BYTES * (HEADER_WORDS + expected))
            ),
            same.eq(collects & (sink.data == sequence)),
            age.eq(newest - sink.data),
            late.eq(has_newest & (age <= LATE)),
        ]

        def count(name):
            return NextValue(self.counters[name], self.counters[name] + 1)

        def skip(name):
            return [count(name), If(sink.last, NextState("HEAD")).Else(NextState("SKIP"))]

        begins = [
            NextValue(sequence, sink.data),
            NextValue(newest, sink.data),
            NextValue(has_newest, 1),
            NextValue(collects, 1),
            NextValue(come, 0),
            NextValue(ip_address, sink.ip_address),
            NextValue(port, sink.src_port),
            NextValue(at, 0),
            If(collects & (come != 0), count("cut")),
            NextState("PAYLOAD"),
        ]
        self.fsm = fsm = FSM(reset_state="HEAD")
        fsm.act(
            "HEAD",
            sink.ready.eq(1),
            NextValue(head, sink.data),
            If(sink.valid, If(sink.last, count("refused")).Else(NextState("SEQUENCE"))),
        )
        fsm.act(
            "SEQUENCE",
            sink.ready.eq(1),
            If(
                sink.valid,
                If(~is_right | sink.last, *skip("refused"))
                .Elif(same & ~full & ~has_come, NextValue(at, 0), NextState("PAYLOAD"))
                .Elif(same | late, *skip("ignored"))
                .Elif(full, *skip("overrun"))
                .Else(*begins),
            ),
        )
        fsm.act(
            "PAYLOAD",
            sink.ready.eq(1),
            write.we.eq(sink.valid),
            If(
                sink.valid,
                NextValue(at, at + 1),
                If(sink.last, count("taken"), NextValue(come, come | (1 << index)), NextState("HEAD")),
            ),
        )
        fsm.act("SKIP", sink.ready.eq(1), If(sink.valid & sink.last, NextState("HEAD")))
        self.comb += [
            write.adr.eq(Cat((base + at)[: depth.bit_length() - 1], bank)),
            write.dat_w.eq(sink.data),
            full.eq(collects & reduce(and_, list(come))),
            self.decides.eq(fsm.ongoing("SEQUENCE") & sink.valid),
        ]
        self.sync += If(check.damaged, self.counters["damaged"].eq(self.counters["damaged"] + 1))

        # The other bank leaves, a code per beat.
        per_word = WORD_BYTES // code_bytes
        leaves, taxel = Signal(), Signal(max=taxels)
        place, next_place = Signal(max=2 * depth), Signal(max=2 * depth)
        steps, swap = Signal(), Signal()
        identifier = Signal(ID_BITS)
        part = taxel[: per_word.bit_length() - 1] if per_word > 1 else 0
        bits = BYTE * code_bytes
        code = Signal(bits)
        up = max(code_bits - bits, 0)
        extended = Cat(Replicate(0, up), code, Replicate(code[-1], WORD_BITS))[:WORD_BITS]
        last = taxel == taxels - 1
        self.comb += [
            swap.eq(full & ~leaves),
            steps.eq(source.valid & source.ready),
            If(swap, next_place.eq(Cat(Replicate(0, depth.bit_length() - 1), bank)))
            .Elif(steps & (part == per_word - 1), next_place.eq(place + 1))
            .Else(next_place.eq(place)),
            read.adr.eq(next_place),
            choose(code, part, [read.dat_r[bits * number :][:bits] for number in range(per_word)]),
            source.valid.eq(leaves),
            source.data.eq(extended),
            source.last.eq(last),
            source.id.eq(identifier),
            requester.valid.eq(swap),
            requester.ip_address.eq(ip_address),
            requester.port.eq(port),
            requester.sequence.eq(sequence),
        ]
        # The id of the frame that leaves next is that of the requester written.
        self.next_id = Signal(ID_BITS)
        self.comb += self.next_id.eq(identifier + 1)
        self.sync += [
            place.eq(next_place),
            If(steps, taxel.eq(taxel + 1), If(last, taxel.eq(0), leaves.eq(0))),
            If(swap, leaves.eq(1), bank.eq(~bank), identifier.eq(self.next_id), collects.eq(0), come.eq(0)),
        ]


class PacketQueue(LiteXModule):
    """Packets of at most `words` words in; each leaves when it is whole.

    LiteX's PacketFIFO (2024.12) takes the parameters of a packet once more in each cycle in which its last word waits for room.
    """

    def __init__(self, layout, words):
        self.sink = sink = stream.Endpoint(layout)
        self.source = source = stream.Endpoint(layout)

        # # #

        # `buffered` is block RAM with a register behind it: when a packet of three words or more is whole, its first one is there.
        words_layout = stream.EndpointDescription(layout.payload_layout)
        self.payload = payload = stream.SyncFIFO(words_layout, words, buffered=True)
        self.params = params = stream.SyncFIFO(layout.param_layout, 2)
        names = {name for name, *_ in layout.payload_layout} | {"last"}
        self.comb += [
            sink.connect(payload.sink, keep=names),
            params.sink.payload.raw_bits().eq(sink.param.raw_bits()),
            payload.sink.valid.eq(sink.valid & params.sink.ready),
            params.sink.valid.eq(sink.valid & sink.last & payload.sink.ready),
            sink.ready.eq(payload.sink.ready & params.sink.ready),
            payload.source.connect(source, keep=names),
            source.param.raw_bits().eq(params.source.payload.raw_bits()),
            source.valid.eq(params.source.valid & payload.source.valid),
            payload.source.ready.eq(source.valid & source.ready),
            params.source.ready.eq(source.valid & source.last & source.ready),
        ]


class Mantissa(LiteXModule):
    """`mantissa_of` for the exponents that `exponent_of` gives."""

    def __init__(self):
        self.force, self.exponent, self.mantissa = Signal((WORD_BITS, True)), Signal(EXPONENT_BITS), Signal(MANTISSA_BITS)

        # # #

        # Without the bit that rounds, and with it below.
        shifted = Signal((WORD_BITS + 1, True))
        doubled = Signal((WORD_BITS + 1, True))
        self.comb += [
            doubled.eq(Cat(0, self.force)),
            shifted.eq(doubled >> self.exponent),
            self.mantissa.eq(shifted[1:] + shifted[0]),
        ]


class ShortForces(LiteXModule):
    """The words of results in, forces as mantissas of 16 bits with an exponent per packet out, then the other words.

    The forces of a packet wait until the largest is known; `source` is what `ResultSender` takes.
    """

    def __init__(self, force_words, fragment):
        most = 2 * fragment
        counts = [most] * (force_words // most) + ([force_words % most] if force_words % most else [])
        self.sink = sink = stream.Endpoint([("data", WORD_BITS), ("user", 2), ("id", ID_BITS)])
        self.source = source = stream.Endpoint(RESULT)

        # # #

        memory = Memory(WORD_BITS, 2 ** (most - 1).bit_length())
        write, read = memory.get_port(write_capable=True), memory.get_port()
        self.specials += memory, write, read
        at, count, block = Signal(max=most + 2), Signal(max=most + 1), Signal(max=len(counts) + 1)
        size, grown, sizes = Signal(WORD_BITS), Signal(WORD_BITS), Signal(WORD_BITS)
        exponent, clipped, identifier = Signal(EXPONENT_BITS), Signal(), Signal(ID_BITS)
        self.mantissa = mantissa = Mantissa()
        halves = [Signal(MANTISSA_BITS), Signal(MANTISSA_BITS)]
        is_last_block = Signal()
        self.comb += [
            choose(count, block, counts),
            is_last_block.eq(block == len(counts) - 1),
            size.eq(sink.data ^ Replicate(sink.data[-1], WORD_BITS)),
            grown.eq(size + (size >> MANTISSA_BITS - 1)),
            write.adr.eq(at),
            write.dat_w.eq(sink.data),
            read.adr.eq(at),
            mantissa.force.eq(read.dat_r),
            mantissa.exponent.eq(exponent),
        ]
        self.fsm = fsm = FSM(reset_state="FILL")
        fsm.act(
            "FILL",
            sink.ready.eq(1),
            write.we.eq(sink.valid),
            If(
                sink.valid,
                NextValue(clipped, sink.user[1]),
                NextValue(identifier, sink.id),
                NextValue(sizes, sizes | grown),
                NextValue(at, at + 1),
                If(at + 1 == count, NextValue(at, 0), NextState("SCALE")),
            ),
        )
        # The largest size decides: the last assignment holds.
        scale = [If(sizes[bit], NextValue(exponent, bit + 2 - MANTISSA_BITS)) for bit in range(MANTISSA_BITS - 1, WORD_BITS)]
        fsm.act("SCALE", NextValue(exponent, 0), *scale, NextValue(sizes, 0), NextValue(at, 1), NextState("LOW"))
        # `read` has the word before `at`.
        fsm.act("LOW", NextValue(halves[0], mantissa.mantissa), NextState("HIGH"))
        fsm.act(
            "HIGH",
            NextValue(halves[1], Mux(at == count, 0, mantissa.mantissa)),
            NextValue(at, at + 1),
            NextState("PUT"),
        )
        fsm.act(
            "PUT",
            source.valid.eq(1),
            source.short.eq(1),
            source.padded.eq(count[0]),
            source.data.eq(Cat(*halves)),
            source.clipped.eq(clipped),
            source.exponent.eq(exponent),
            source.id.eq(identifier),
            If(
                source.ready,
                NextValue(at, at + 1),
                NextState("LOW"),
                If(
                    at >= count,
                    NextValue(at, 0),
                    NextValue(block, block + 1),
                    If(is_last_block, NextValue(block, 0), NextState("PASS")).Else(NextState("FILL")),
                ),
            ),
        )
        fsm.act(
            "PASS",
            source.valid.eq(sink.valid),
            sink.ready.eq(source.ready),
            source.data.eq(sink.data),
            source.clipped.eq(sink.user[1]),
            source.id.eq(sink.id),
            source.last.eq(sink.last),
            If(sink.valid & source.ready & sink.last, NextState("FILL")),
        )


class ResultSender(LiteXModule):
    """The words of results in, packets out, each as a whole: a network has no pauses within a packet.

    `counts` has the words of each packet of a result.
    """

    def __init__(self, counts, requesters, udp_port):
        self.sink = sink = stream.Endpoint(RESULT)

        # # #

        layout = eth_udp_user_description(WORD_BITS)
        self.packets = fifo = PacketQueue(layout, 2 ** (HEADER_WORDS + FRAGMENT_WORDS + CHECK_WORDS - 1).bit_length())
        self.source = fifo.source
        packet = fifo.sink
        fragment, at = Signal(BYTE), Signal(max=FRAGMENT_WORDS + 1)
        count = Signal(max=FRAGMENT_WORDS + 1)
        kind, flags, ends = Signal(BYTE), Signal(BYTE), Signal()
        self.crc = crc = CRC32()
        is_over = Signal()
        # The next result can be on `sink` when the CRC-32 of this one leaves.
        to = stream.Endpoint(REQUESTER)
        self.comb += [
            choose(count, fragment, counts),
            ends.eq((at + 1 == count) | sink.last),
            kind.eq(Mux(sink.short, KIND_SHORT_RESULT, KIND_RESULT)),
            flags.eq(Cat(sink.clipped, sink.padded)),
            flags[EXPONENT_AT:].eq(sink.exponent),
            crc.data.eq(packet.data),
            crc.ce.eq(packet.valid & packet.ready),
            crc.last.eq(packet.last),
            requesters.read_id.eq(sink.id),
            packet.src_port.eq(udp_port),
            packet.dst_port.eq(to.port),
            packet.ip_address.eq(to.ip_address),
            packet.length.eq(WORD_BYTES * (HEADER_WORDS + count + CHECK_WORDS)),
        ]
        self.fsm = fsm = FSM(reset_state="WAIT")
        fsm.act("WAIT", NextValue(fragment, 0), NextValue(at, 0), If(sink.valid, NextState("HEAD")))
        fsm.act(
            "HEAD",
            packet.valid.eq(1),
            packet.data.eq(Cat(kind, flags, fragment, Constant(len(counts), BYTE))),
            If(packet.ready, NextState("SEQUENCE")),
        )
        fsm.act(
            "SEQUENCE",
            packet.valid.eq(1),
            packet.data.eq(requesters.read.sequence),
            NextValue(to.payload.raw_bits(), requesters.read.payload.raw_bits()),
            If(packet.ready, NextState("PAYLOAD")),
        )
        fsm.act(
            "PAYLOAD",
            packet.valid.eq(sink.valid),
            sink.ready.eq(packet.ready),
            packet.data.eq(sink.data),
            If(
                sink.valid & packet.ready,
                NextValue(at, at + 1),
                If(ends, NextValue(is_over, sink.last), NextState("CHECK")),
            ),
        )
        fsm.act(
            "CHECK",
            packet.valid.eq(1),
            packet.data.eq(crc.value),
            packet.last.eq(1),
            packet.last_be.eq(1 << (WORD_BYTES - 1)),
            NextValue(at, 0),
            If(packet.ready, If(is_over, NextState("WAIT")).Else(NextValue(fragment, fragment + 1), NextState("NEXT"))),
        )
        # The next fragment's id is on `sink` once its first word is offered.
        fsm.act("NEXT", If(sink.valid, NextState("HEAD")))


class DermisUDP(LiteXModule):
    """A core between the two directions of a UDP port of LiteEth with words of 32 bits.

    Codes in packets have 2 or 4 bytes, forces 32 bits, or 16 with an exponent per packet. The counters of `FrameReceiver` are CSRs.

    Raises `CoreError` for what the core has not, with field, value and what would be right.
    """

    def __init__(self, core, port, code_bytes=2, force_bits=WORD_BITS, udp_port=UDP_PORT):
        require_width(core, WORD_BITS)
        require_one_array(core)
        require_choice("code_bytes", code_bytes, (2, 4))
        require_choice("force_bits", force_bits, (MANTISSA_BITS, WORD_BITS))
        self.requesters = Requesters()
        self.receiver = FrameReceiver(core.taxels, core.code_bits, code_bytes)
        if force_bits == MANTISSA_BITS:
            require_forces(core)
            counts, _ = short_counts(core.force_words, core.words - core.force_words)
            self.short_forces = ShortForces(core.force_words, FRAGMENT_WORDS)
        else:
            counts = fragment_words(core.words)
        self.sender = ResultSender(counts, self.requesters, udp_port)
        # The longest paths of LiteEth and of block RAMs end here.
        self.arriving = stream.Buffer(self.receiver.sink.description)
        self.codes = stream.Buffer(self.receiver.source.description)
        self.leaving = stream.Buffer(self.sender.source.description, pipe_ready=True)

        # # #

        if force_bits == MANTISSA_BITS:
            self.comb += [
                core.source.connect(self.short_forces.sink, omit={"keep"}),
                self.short_forces.source.connect(self.sender.sink),
            ]
        else:
            self.comb += [
                core.source.connect(self.sender.sink, keep={"valid", "ready", "last", "data", "id"}),
                self.sender.sink.clipped.eq(core.source.user[1]),
            ]
        self.comb += [
            port.source.connect(self.arriving.sink),
            self.arriving.source.connect(self.receiver.sink),
            self.receiver.source.connect(self.codes.sink),
            self.codes.source.connect(core.sink),
            self.receiver.requester.connect(self.requesters.written, omit={"ready"}),
            self.requesters.write_id.eq(self.receiver.next_id),
            self.sender.source.connect(self.leaving.sink),
            self.leaving.source.connect(port.sink),
        ]
        for name, counter in self.receiver.counters.items():
            status = CSRStatus(32, name=name, description=f"Packets or frames: {name}.")
            setattr(self, f"_{name}", status)
            self.comb += status.status.eq(counter)
