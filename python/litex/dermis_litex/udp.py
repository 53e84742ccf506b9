"""Frames from the network to a core, and its results back, in UDP packets; the format is in `packets`.

```text
 UDP port ──> FrameReceiver ──> core ──> ResultSender ──> UDP port
        PacketCheck, frame buffers       a packet at a time, ShortForces before it
              │     └── who sent it, when, by id ──┘           │
              └──────────────── Requests ──────────────────────┘
            who are you; tables, to the core's registers over `bus`
```
"""

from functools import reduce
from operator import and_, or_

from liteeth.common import eth_udp_user_description
from liteeth.mac.crc import LiteEthMACCRC32, LiteEthMACCRCEngine
from litex.gen import Case, Cat, Constant, FSM, If, LiteXModule, Memory, Mux, NextState, NextValue, READ_FIRST, Replicate, Signal
from litex.soc.interconnect import packet as packets
from litex.soc.interconnect import stream, wishbone
from litex.soc.interconnect.csr import CSRStatus

from dermis_litex.core import ID_BITS, WORD_BITS, require_choice, require_forces, require_width
from dermis_litex.packets import (
    ARRAY_AT,
    CHECK_WORDS,
    EXPONENT_AT,
    FRAGMENT_WORDS,
    HEADER_WORDS,
    IDENTITY,
    KIND_FRAME,
    KIND_IDENTIFY,
    KIND_IDENTITY,
    KIND_RESULT,
    KIND_SHORT_RESULT,
    KIND_TABLES,
    KIND_TABLES_TAKEN,
    LATE,
    MANTISSA_BITS,
    RESULT_HEADER_WORDS,
    UDP_PORT,
    VERSION,
    WORD_BYTES,
    code_words,
    fragment_words,
    short_counts,
)

SEQUENCE_BITS = 32
TIME_BITS = 64
REQUESTER = [("ip_address", 32), ("port", 16), ("sequence", SEQUENCE_BITS), ("time", TIME_BITS)]
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


class Cycles(LiteXModule):
    """The cycles since the reset, in `count`. Its halves are apart, so that no carry is longer than one of them."""

    def __init__(self):
        self.count = Signal(TIME_BITS)

        # # #

        half = TIME_BITS // 2
        low, high, wraps = Signal(half), Signal(half), Signal()
        self.comb += self.count.eq(Cat(low, high))
        self.sync += [low.eq(low + 1), wraps.eq(low == 2**half - 2), high.eq(high + wraps)]


class Requesters(LiteXModule):
    """Who sent each frame that is under way: address, port and sequence number, and when it entered the core, by the frame's id."""

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


class WordOfArrays(LiteXModule):
    """A word of each array: `value` is that of array `array`, where it is `known` since the reset; with `sets` it is `given`."""

    def __init__(self, bits, arrays):
        self.array = Signal(max=max(arrays, 2))
        self.given, self.sets = Signal(bits), Signal()
        self.has = Signal(arrays)
        self.word = Signal(bits) if arrays == 1 else Memory(bits, arrays)
        self.value, self.known = self.at(self.array)

        # # #

        self.sync += If(self.sets, self.has.eq(self.has | 1 << self.array))
        if arrays == 1:
            self.sync += If(self.sets, self.word.eq(self.given))
            return
        write = self.word.get_port(write_capable=True)
        self.specials += self.word, write
        self.comb += [write.adr.eq(self.array), write.dat_w.eq(self.given), write.we.eq(self.sets)]

    def at(self, array):
        """The word of an array, and whether it is known: a memory has no reset."""
        known = Signal()
        self.comb += choose(known, array, list(self.has))
        if isinstance(self.word, Signal):
            return self.word, known
        read = self.word.get_port(async_read=True)
        self.specials += read
        self.comb += read.adr.eq(array)
        return read.dat_r, known


class Waiting(LiteXModule):
    """Who sent the frame in each bank, until it leaves: `collected` is written to bank `bank` with `sets`, `leaves` is that of bank `first`.

    Of two banks none waits: the frame that is collected leaves at once, or stays where it is.
    """

    def __init__(self, layout, banks):
        self.collected, self.leaves = stream.Endpoint(layout), stream.Endpoint(layout)
        self.bank, self.first = Signal(max=banks), Signal(max=banks)
        self.sets = Signal()

        # # #

        collected, leaves = self.collected.payload.raw_bits(), self.leaves.payload.raw_bits()
        if banks == 2:
            self.comb += leaves.eq(collected)
            return
        memory = Memory(len(collected), banks)
        write, read = memory.get_port(write_capable=True), memory.get_port(async_read=True)
        self.specials += memory, write, read
        self.comb += [
            write.adr.eq(self.bank),
            write.dat_w.eq(collected),
            write.we.eq(self.sets),
            read.adr.eq(self.first),
            leaves.eq(read.dat_r),
        ]


class PacketCounter(LiteXModule):
    """How often `happens` is high: in `all`, and for array `of` in that cycle, asked for by `asked`, in `own`."""

    def __init__(self, arrays):
        self.happens, self.of, self.asked = Signal(), Signal(max=max(arrays, 2)), Signal(max=max(arrays, 2))
        self.all, self.own = Signal(WORD_BITS), Signal(WORD_BITS)

        # # #

        self.sync += If(self.happens, self.all.eq(self.all + 1))
        if arrays == 1:
            self.comb += self.own.eq(self.all)
            return
        self.words = words = WordOfArrays(WORD_BITS, arrays)
        count, known = words.at(self.asked)
        self.comb += [
            words.array.eq(self.of),
            words.given.eq(Mux(words.known, words.value, 0) + 1),
            words.sets.eq(self.happens),
            self.own.eq(Mux(known, count, 0)),
        ]


class FrameReceiver(LiteXModule):
    """Packets in, whole frames out: `source` has a code of 32 bits per beat, its `id` the array in the low bits.

    A frame leaves only when all its packets have come; the next is collected meanwhile. With several arrays as many frames as there are
    arrays wait, so that those of all may come at once. Codes of 16 bits are those of the
    converter: they are shifted up to the `code_bits` of the engine. Five numbers count packets: `taken`, `ignored` (late, or come
    before), `refused` (another kind, array, number of fragments or length), `damaged` (`PacketCheck`), `overrun` (there is no room for a frame),
    and one frames: `cut` (given up without a packet). Questions and tables leave by `others`, which counts with `others_refused`.
    `counters` are of all arrays; `own_counters` of array `asked`, but for packets that are damaged or refused, whose array is not known.
    `time` is given to `requester`.
    """

    def __init__(self, taxels, code_bits, code_bytes, arrays=1):
        words = code_words(taxels, code_bytes)
        counts = fragment_words(words)
        array_bits = (arrays - 1).bit_length()
        bank_bits = max(array_bits, 1)
        self.check = check = PacketCheck(HEADER_WORDS + FRAGMENT_WORDS + CHECK_WORDS)
        # What comes from a block RAM comes late in a cycle. Its port is READ_FIRST: of another one the address has the register, and
        # Yosys would take this one into the block RAM.
        self.words = checked = stream.Buffer(check.source.description)
        self.sink = check.sink
        sink, self.others = [stream.Endpoint(check.source.description) for _ in range(2)]
        self.others_refused = Signal()
        self.dispatcher = packets.Dispatcher(checked.source, [sink, self.others])
        self.time = Signal(TIME_BITS)
        self.source = source = stream.Endpoint([("data", WORD_BITS), ("id", array_bits + ID_BITS)])
        self.requester = requester = stream.Endpoint(REQUESTER)
        # A whole frame stays where it is until there is room for the next.
        self.waits = full = Signal()
        # What becomes of a packet is decided now.
        self.decides = Signal()
        of_each = {name: PacketCounter(arrays) for name in ("taken", "ignored", "overrun", "cut")}
        of_all = {name: PacketCounter(1) for name in ("refused", "damaged")}
        self.submodules += [*of_each.values(), *of_all.values()]
        self.asked = Signal(max=max(arrays, 2))
        self.counters = {name: counter.all for name, counter in (of_each | of_all).items()}
        self.own_counters = {name: counter.own for name, counter in (of_each | of_all).items()}

        # # #

        kind = checked.source.data[:BYTE]
        self.comb += [
            check.source.connect(checked.sink),
            self.dispatcher.sel.eq((kind == KIND_IDENTIFY) | (kind == KIND_TABLES)),
        ]
        depth = 2 ** (words - 1).bit_length()
        memory = Memory(WORD_BITS, depth << bank_bits)
        write, read = memory.get_port(write_capable=True), memory.get_port(mode=READ_FIRST)
        self.specials += memory, write, read

        # The frame that is collected.
        bank, collects = Signal(bank_bits), Signal()
        whose = [("ip_address", 32), ("port", 16), ("sequence", SEQUENCE_BITS), ("array", max(array_bits, 1))]
        self.waiting = waiting = Waiting(whose, 2**bank_bits)
        # Sequence number of the newest frame of each array.
        self.newest = newest = WordOfArrays(SEQUENCE_BITS, arrays)
        own = stream.Endpoint(whose)
        come = Signal(len(counts))

        # The packet.
        head = Signal(WORD_BITS)
        index, expected = Signal(BYTE), Signal(max=FRAGMENT_WORDS + 1)
        base, at = Signal(max=2 * depth), Signal(max=FRAGMENT_WORDS + 1)
        array = head[BYTE + ARRAY_AT : 2 * BYTE]
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
                & (array < arrays)
                & (sink.length == WORD_BYTES * (HEADER_WORDS + expected))
            ),
            newest.array.eq(array),
            newest.given.eq(sink.data),
            same.eq(collects & (sink.data == own.sequence) & (array == own.array)),
            age.eq(newest.value - sink.data),
            late.eq(newest.known & (age <= LATE)),
        ]

        refuses = Signal()
        self.comb += [
            *(counter.asked.eq(self.asked) for counter in of_each.values()),
            *(of_each[name].of.eq(array) for name in ("taken", "ignored", "overrun")),
            of_each["cut"].of.eq(own.array),
            of_all["damaged"].happens.eq(check.damaged),
            of_all["refused"].happens.eq(refuses | self.others_refused),
        ]

        def count(name):
            return refuses.eq(1) if name == "refused" else of_each[name].happens.eq(1)

        def skip(name):
            return [count(name), If(sink.last, NextState("HEAD")).Else(NextState("SKIP"))]

        begins = [
            newest.sets.eq(1),
            NextValue(own.sequence, sink.data),
            NextValue(own.array, array),
            NextValue(own.ip_address, sink.ip_address),
            NextValue(own.port, sink.src_port),
            NextValue(collects, 1),
            NextValue(come, 0),
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
            own.connect(waiting.collected, omit={"ready"}),
            waiting.sets.eq(write.we),
            full.eq(collects & reduce(and_, list(come))),
            self.decides.eq(fsm.ongoing("SEQUENCE") & sink.valid),
        ]

        # The frame of another bank leaves, a code per beat; whole ones wait in the banks between.
        per_word = WORD_BYTES // code_bytes
        leaves, taxel = Signal(), Signal(max=taxels)
        first, whole = Signal(bank_bits), Signal(bank_bits)
        place, next_place = Signal(max=depth << bank_bits), Signal(max=depth << bank_bits)
        steps, ends, takes, begins = Signal(), Signal(), Signal(), Signal()
        identifier, of = Signal(ID_BITS), Signal(max(array_bits, 1))
        part = taxel[: per_word.bit_length() - 1] if per_word > 1 else 0
        bits = BYTE * code_bytes
        code = Signal(bits)
        up = max(code_bits - bits, 0)
        extended = Cat(Replicate(0, up), code, Replicate(code[-1], WORD_BITS))[:WORD_BITS]
        last = taxel == taxels - 1
        self.comb += [
            takes.eq(full & (whole != 2**bank_bits - 1)),
            begins.eq(~leaves & ((whole != 0) | takes)),
            steps.eq(source.valid & source.ready),
            ends.eq(steps & last),
            waiting.bank.eq(bank),
            waiting.first.eq(first),
            If(begins, next_place.eq(Cat(Replicate(0, depth.bit_length() - 1), first)))
            .Elif(steps & (part == per_word - 1), next_place.eq(place + 1))
            .Else(next_place.eq(place)),
            read.adr.eq(next_place),
            choose(code, part, [read.dat_r[bits * number :][:bits] for number in range(per_word)]),
            source.valid.eq(leaves),
            source.data.eq(extended),
            source.last.eq(last),
            source.id.eq(Cat(of, identifier) if array_bits else identifier),
            requester.valid.eq(begins),
            waiting.leaves.connect(requester, keep={"ip_address", "port", "sequence"}),
            requester.time.eq(self.time),
        ]
        # The id of the frame that leaves next is that of the requester written.
        self.next_id = Signal(ID_BITS)
        self.comb += self.next_id.eq(identifier + 1)
        self.sync += [
            place.eq(next_place),
            whole.eq(whole + takes - ends),
            If(steps, taxel.eq(taxel + 1), If(last, taxel.eq(0), leaves.eq(0))),
            If(takes, bank.eq(bank + 1), collects.eq(0), come.eq(0)),
            If(begins, leaves.eq(1), first.eq(first + 1), identifier.eq(self.next_id), of.eq(waiting.leaves.array)),
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
        self.packets = fifo = PacketQueue(layout, 2 ** (RESULT_HEADER_WORDS + FRAGMENT_WORDS + CHECK_WORDS - 1).bit_length())
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
            packet.length.eq(WORD_BYTES * (RESULT_HEADER_WORDS + count + CHECK_WORDS)),
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
            If(packet.ready, NextState("TIME_LOW")),
        )
        for state, first, after in (("TIME_LOW", 0, "TIME_HIGH"), ("TIME_HIGH", WORD_BITS, "PAYLOAD")):
            fsm.act(
                state,
                packet.valid.eq(1),
                packet.data.eq(to.time[first:][:WORD_BITS]),
                If(packet.ready, NextState(after)),
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


class TablesWriter(LiteXModule):
    """Bytes of images in, each written into a core's register `tables` once there is room; `last` is the last of an image, `array` the
    array that it is of.

    `register` is that of the core's `registers.json`.
    """

    def __init__(self, register):
        self.sink = sink = stream.Endpoint([("data", BYTE), ("array", BYTE - ARRAY_AT)])
        self.bus = bus = wishbone.Interface(data_width=WORD_BITS, address_width=8, addressing="word")

        # # #

        places = {field["name"]: field["low"] for field in register["fields"]}
        # A core of one array has no field for it.
        fields = [sink.data << places["octet"], sink.last << places["last"]]
        fields += [sink.array << places["array"]] if "array" in places else []
        self.fsm = fsm = FSM(reset_state="ROOM")
        self.comb += [
            bus.adr.eq(register["address"] // WORD_BYTES),
            bus.sel.eq(2**WORD_BYTES - 1),
            bus.dat_w.eq(reduce(or_, fields)),
            bus.cyc.eq(bus.stb),
        ]
        fsm.act("ROOM", bus.stb.eq(sink.valid), If(bus.ack & ~bus.dat_r[places["waiting"]], NextState("WRITE")))
        fsm.act("WRITE", bus.stb.eq(1), bus.we.eq(1), If(bus.ack, sink.ready.eq(1)), If(bus.ack | bus.err, NextState("ROOM")))


class Requests(LiteXModule):
    """Questions for the identity and images of tables in; their answers out, each a packet without a pause.

    `identity` has what answers each name of `IDENTITY`, but the time. `tables` is the `sink` of a `TablesWriter`; None for a core
    whose tables are not written. `refused`: a packet is not answered.
    """

    def __init__(self, identity, time, udp_port, tables=None, arrays=1):
        layout = eth_udp_user_description(WORD_BITS)
        self.sink = sink = stream.Endpoint(layout)
        self.source = source = stream.Endpoint(layout)
        self.refused = Signal()
        # That of the question which is answered.
        self.array = Signal(BYTE - ARRAY_AT)

        # # #

        head, sequence, request_time = Signal(WORD_BITS), Signal(SEQUENCE_BITS), Signal(TIME_BITS)
        ip_address, port = Signal(32), Signal(16)
        is_question = Signal()
        at, words, content = Signal(max=len(IDENTITY) + 1), Signal(max=len(IDENTITY) + 1), Signal(WORD_BITS)
        identity = {**identity, "time_low": request_time[:WORD_BITS], "time_high": request_time[WORD_BITS:]}
        self.crc = crc = CRC32()
        self.comb += [
            is_question.eq(head[:BYTE] == KIND_IDENTIFY),
            self.array.eq(head[BYTE + ARRAY_AT : 2 * BYTE]),
            words.eq(Mux(is_question, len(IDENTITY), 0)),
            choose(content, at, [identity[name] for name in IDENTITY]),
            crc.data.eq(source.data),
            crc.ce.eq(source.valid & source.ready),
            crc.last.eq(source.last),
            source.src_port.eq(udp_port),
            source.dst_port.eq(port),
            source.ip_address.eq(ip_address),
            source.length.eq(WORD_BYTES * (HEADER_WORDS + words + CHECK_WORDS)),
        ]
        refuse = [self.refused.eq(1), If(sink.last, NextState("HEAD")).Else(NextState("SKIP"))]
        self.fsm = fsm = FSM(reset_state="HEAD")
        fsm.act("HEAD", sink.ready.eq(1), NextValue(head, sink.data), If(sink.valid, NextState("SEQUENCE"), If(sink.last, *refuse)))
        takes_tables = self.take_tables(tables, head, arrays) if tables else refuse
        fsm.act(
            "SEQUENCE",
            sink.ready.eq(1),
            NextValue(sequence, sink.data),
            NextValue(ip_address, sink.ip_address),
            NextValue(port, sink.src_port),
            NextValue(request_time, time),
            NextValue(at, 0),
            If(
                sink.valid,
                If(is_question != sink.last, *refuse).Elif(is_question, NextState("ANSWER")).Else(*takes_tables),
            ),
        )
        fsm.act("SKIP", sink.ready.eq(1), If(sink.valid & sink.last, NextState("HEAD")))
        fsm.act("AGAIN", sink.ready.eq(1), If(sink.valid & sink.last, NextState("ANSWER")))
        kind = Mux(is_question, Constant(KIND_IDENTITY, BYTE), Constant(KIND_TABLES_TAKEN, BYTE))
        answer = {
            "ANSWER": (Cat(kind, Constant(0, BYTE), head[16:]), NextState("ANSWER_SEQUENCE")),
            "ANSWER_SEQUENCE": (sequence, If(is_question, NextState("ANSWER_WORDS")).Else(NextState("ANSWER_CHECK"))),
            "ANSWER_WORDS": (content, [NextValue(at, at + 1), If(at + 1 == words, NextState("ANSWER_CHECK"))]),
            "ANSWER_CHECK": (crc.value, NextState("HEAD")),
        }
        for state, (data, after) in answer.items():
            ends = state == "ANSWER_CHECK"
            last = [source.last.eq(ends), source.last_be.eq(ends << (WORD_BYTES - 1))]
            fsm.act(state, source.valid.eq(1), source.data.eq(data), *last, If(source.ready, after))

    def take_tables(self, tables, head, arrays):
        """What becomes of a packet of tables with this head and, in this cycle, sequence number.

        A fragment is the next of its image, or the one before once more, whose answer was lost, or the first of another image.
        """
        sink = self.sink
        empty, index, count = head[BYTE:][:2], head[16:24], head[24:]
        array = self.array
        image, of, taken, has_image, is_open = Signal(SEQUENCE_BITS), Signal(len(array)), Signal(BYTE), Signal(), Signal()
        octet, is_last_word, ends = Signal(max=WORD_BYTES), Signal(), Signal()
        self.comb += [
            is_last_word.eq(sink.last & (index + 1 == count)),
            ends.eq(octet == WORD_BYTES - 1 - Mux(is_last_word, empty, 0)),
            tables.array.eq(of),
        ]
        self.fsm.act(
            "TABLES",
            tables.valid.eq(sink.valid),
            choose(tables.data, octet, [sink.data[BYTE * at :][:BYTE] for at in range(WORD_BYTES)]),
            tables.last.eq(is_last_word & ends),
            If(
                tables.valid & tables.ready,
                NextValue(is_open, ~tables.last),
                NextValue(octet, octet + 1),
                If(
                    ends,
                    sink.ready.eq(1),
                    NextValue(octet, 0),
                    If(sink.last, NextValue(taken, taken + 1), NextState("ANSWER")),
                ),
            ),
        )
        # An image that was given up ends, so that the core refuses it.
        self.fsm.act(
            "CLOSE",
            tables.valid.eq(1),
            tables.last.eq(1),
            If(tables.ready, NextValue(is_open, 0), NextState("TABLES")),
        )
        is_same = has_image & (image == sink.data) & (of == array)
        begins = [
            NextValue(image, sink.data),
            NextValue(of, array),
            NextValue(has_image, 1),
            NextValue(taken, 0),
            If(is_open, NextState("CLOSE")).Else(NextState("TABLES")),
        ]
        refuse = [self.refused.eq(1), NextState("SKIP")]
        return [
            If((index >= count) | (array >= arrays), *refuse)
            .Elif(is_same & (index == taken), NextState("TABLES"))
            .Elif(is_same & (index + 1 == taken), NextState("AGAIN"))
            .Elif(~is_same & (index == 0), *begins)
            .Else(*refuse)
        ]


class DermisUDP(LiteXModule):
    """A core between the two directions of a UDP port of LiteEth with words of 32 bits.

    Codes in packets have 2 or 4 bytes, forces 32 bits, or 16 with an exponent per packet. The counters of `FrameReceiver` are CSRs.
    `bus` is a master for the registers of a core whose tables are written, else None; without a processor it is connected to
    `core.bus`.

    Raises `CoreError` for what the core has not, with field, value and what would be right.
    """

    def __init__(self, core, port, code_bytes=2, force_bits=WORD_BITS, udp_port=UDP_PORT):
        require_width(core, WORD_BITS)
        require_choice("code_bytes", code_bytes, (2, 4))
        require_choice("force_bits", force_bits, (MANTISSA_BITS, WORD_BITS))
        self.cycles = Cycles()
        self.requesters = Requesters()
        self.receiver = FrameReceiver(core.taxels, core.code_bits, code_bytes, core.arrays)
        if force_bits == MANTISSA_BITS:
            require_forces(core)
            counts, _ = short_counts(core.force_words, core.words - core.force_words)
            self.short_forces = ShortForces(core.force_words, FRAGMENT_WORDS)
        else:
            counts = fragment_words(core.words)
        self.sender = ResultSender(counts, self.requesters, udp_port)
        identity = {
            "version": VERSION,
            **{name: core.constants[name] for name in ("scene", "array", "clock_Hz", "force_triples", "status_triples")},
            "arrays": core.arrays,
            "code_bytes": code_bytes,
            "force_bits": force_bits,
            "fragment_words": FRAGMENT_WORDS,
            "writable_tables": core.writable_tables,
            **self.receiver.own_counters,
        }
        self.writer = TablesWriter(core.tables_register) if core.writable_tables else None
        self.bus = self.writer and self.writer.bus
        self.requests = Requests(identity, self.cycles.count, udp_port, self.writer and self.writer.sink, core.arrays)
        # The longest paths of LiteEth and of block RAMs end here.
        self.arriving = stream.Buffer(self.receiver.sink.description)
        self.codes = stream.Buffer(self.receiver.source.description)
        self.leaving = stream.Buffer(self.sender.source.description, pipe_ready=True)
        self.arbiter = packets.Arbiter([self.sender.source, self.requests.source], self.leaving.sink)

        # # #

        # Behind the engine a frame is known by what is above the number of its array.
        if force_bits == MANTISSA_BITS:
            results = self.short_forces.sink
            self.comb += [results.user.eq(core.source.user), self.short_forces.source.connect(self.sender.sink)]
        else:
            results = self.sender.sink
            self.comb += results.clipped.eq(core.source.user[1])
        self.comb += [
            core.source.connect(results, keep={"valid", "ready", "last", "data"}),
            results.id.eq(core.source.id[core.array_bits :]),
            port.source.connect(self.arriving.sink),
            self.arriving.source.connect(self.receiver.sink),
            self.receiver.source.connect(self.codes.sink),
            self.codes.source.connect(core.sink),
            self.receiver.requester.connect(self.requesters.written, omit={"ready"}),
            self.requesters.write_id.eq(self.receiver.next_id),
            self.receiver.time.eq(self.cycles.count),
            self.receiver.others.connect(self.requests.sink),
            self.receiver.others_refused.eq(self.requests.refused),
            self.receiver.asked.eq(self.requests.array),
            self.leaving.source.connect(port.sink),
        ]
        for name, counter in self.receiver.counters.items():
            status = CSRStatus(32, name=name, description=f"Packets or frames: {name}.")
            setattr(self, f"_{name}", status)
            self.comb += status.status.eq(counter)
