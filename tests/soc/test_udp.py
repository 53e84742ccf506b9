"""Frames and results in UDP packets: lost, doubled, reordered, damaged and wrong packets, in Migen's simulation."""

import os
import random
import struct
import zlib
from bisect import bisect_left
from collections import Counter

import pytest
from dermis_litex import CoreError
from dermis_litex.core import ID_BITS
from dermis_litex.packets import (
    FRAGMENT_WORDS,
    KIND_FRAME,
    LATE,
    Results,
    code_words,
    exponent_of,
    forces_of,
    fragment_words,
    frame_packets,
    mantissa_of,
    unchecked,
)
from dermis_litex.udp import DermisUDP, FrameReceiver, PacketCounter, Requesters, ResultSender, ShortForces, Waiting, WordOfArrays
from gateware import Packets, Port, write_verilog
from litex.gen import LiteXModule, Signal
from litex.gen.sim import passive, run_simulation
from test_cores import BUILD, NIGHTLY, environment, generate, icarus

# Of both words of a time.
TIMES = [7, 0x0123456789ABCDEF]
CYCLES = 20_000 if "DERMIS_NIGHTLY" in os.environ else 3_000


class CRC32InPython(LiteXModule):
    """In the place of `CRC32`, whose gates take Migen's simulator 20 ms per cycle; they are in the tests with other simulators."""

    def __init__(self):
        self.data, self.ce, self.last = Signal(32), Signal(), Signal()
        self.value, self.is_right = Signal(32), Signal()
        self.comb += self.is_right.eq(self.data == self.value)

    @passive
    def run(self):
        crc = 0
        while True:
            yield
            if (yield self.ce):
                crc = 0 if (yield self.last) else zlib.crc32((yield self.data).to_bytes(4, "little"), crc)
            yield self.value.eq(crc)


@pytest.fixture
def crc_in_python(monkeypatch):
    monkeypatch.setattr("dermis_litex.udp.CRC32", CRC32InPython)


class Received:
    """What a receiver does with packets that come one after the other, each once it is whole."""

    def __init__(self, words, arrays=1):
        self.counts, self.arrays = fragment_words(words), arrays
        # Sequence number of each array; array and sequence number.
        self.newest, self.collected, self.come = {}, None, {}
        self.counters, self.own = Counter(), Counter()

    def add(self, words, length, damaged, waits):
        """Takes a packet; the payload of a frame that is whole now.

        `waits` tells, once for each packet of which it matters, whether a whole frame waits for the one that leaves.
        """
        packet = unchecked(struct.pack(f"<{len(words)}I", *words))
        if not packet or damaged or length != 4 * len(words):
            return self.tell("damaged")
        head, *rest = words[:-1]
        if not rest:
            return self.tell("refused")
        waits = next(waits)
        sequence, *payload = rest
        kind, array, index, count = head & 255, head >> 12 & 15, head >> 16 & 255, head >> 24
        expected = self.counts[index] if index < len(self.counts) else 0
        if kind != KIND_FRAME or array >= self.arrays or count != len(self.counts) or not expected or len(payload) != expected:
            return self.tell("refused")
        own = (array, sequence)
        if own != self.collected or waits or index in self.come:
            late = array in self.newest and (self.newest[array] - sequence) % 2**32 <= LATE
            if own == self.collected or late:
                return self.tell("ignored", array)
            if waits:
                return self.tell("overrun", array)
            if self.collected is not None and self.come:
                self.tell("cut", self.collected[0])
            self.newest[array], self.collected, self.come = sequence, own, {}
        self.tell("taken", array)
        self.come[index] = payload
        if len(self.come) < len(self.counts):
            return None
        whole = [word for index in range(len(self.counts)) for word in self.come[index]]
        self.collected, self.come = None, {}
        return whole

    def tell(self, name, array=None):
        self.counters[name] += 1
        self.own[name, array] += 1


def codes_of(words, taxels, code_bits, code_bytes):
    data = b"".join(word.to_bytes(4, "little") for word in words)
    codes = [int.from_bytes(data[code_bytes * k :][:code_bytes], "little", signed=True) for k in range(taxels)]
    return [code << max(code_bits - 8 * code_bytes, 0) for code in codes]


def traffic(draw, taxels, code_bytes, arrays):
    """Packets of frames, some lost, doubled, swapped, wrong or damaged: (words, length, damaged)."""
    sequences = [draw.randrange(2**32) for _ in range(arrays)]
    waiting = []
    while True:
        # Now and then there is no such array.
        array = draw.randrange(arrays)
        named = draw.randrange(16) if draw.random() < 0.02 else array
        # Now and then a host begins anew.
        sequence = sequences[array]
        sequence = draw.randrange(2**32) if draw.random() < 0.02 else (sequence + draw.choice([1, 1, 1, 2, 90])) % 2**32
        sequences[array] = sequence
        codes = [draw.randrange(-(2 ** (8 * code_bytes - 1)), 2 ** (8 * code_bytes - 1)) for _ in range(taxels)]
        for data in frame_packets(sequence, codes, code_bytes, named):
            words = [int.from_bytes(data[k : k + 4], "little") for k in range(0, len(data), 4)]
            form = draw.random()
            if form < 0.03:
                continue
            length, damaged = 4 * len(words), False
            if form < 0.06:
                damaged = True
            elif form < 0.08:
                words = words[: draw.randrange(1, len(words))]
            elif form < 0.10:
                words = words + [draw.randrange(2**32)] * draw.randrange(1, 4)
            elif form < 0.11:
                words[draw.randrange(len(words))] ^= 1 << draw.randrange(32)
            elif form < 0.13:
                # Whole, of another kind, number of fragments or length.
                words[0] ^= draw.choice([1 << draw.randrange(32), 0]) & 0xFF0000FF
                words = words[: draw.randrange(1, len(words))]
                words.append(zlib.crc32(struct.pack(f"<{len(words)}I", *words)))
                length = 4 * len(words)
            elif form < 0.14:
                length += draw.choice([-4, 4])
            waiting += [(words, length, damaged)] * (2 if draw.random() < 0.05 else 1)
        if draw.random() < 0.1:
            draw.shuffle(waiting)
        # A packet of a frame may come with the next frame's.
        while len(waiting) > (3 if draw.random() < 0.3 else 0):
            yield waiting.pop(0)


@pytest.mark.parametrize(
    "taxels, code_bits, code_bytes, arrays",
    [
        (12, 20, 2, 1),
        (12, 20, 2, 5),
        *(pytest.param(*own, marks=NIGHTLY) for own in [(7, 20, 4, 1), (15, 14, 2, 16), (730, 20, 2, 1), (730, 20, 2, 2)]),
    ],
)
def test_only_whole_frames_leave(crc_in_python, taxels, code_bits, code_bytes, arrays):
    only_whole_frames_leave(taxels, code_bits, code_bytes, arrays)


def test_a_receiver_that_takes_late_packets_is_found(crc_in_python, monkeypatch):
    monkeypatch.setattr("dermis_litex.udp.LATE", 0)
    with pytest.raises(AssertionError):
        only_whole_frames_leave(12, 20, 2, 1)


@pytest.mark.parametrize(
    "part, one",
    # Numbers, and counters, of all arrays are those of one; who sent the frame that leaves is who sent the one that is collected.
    [
        (WordOfArrays, lambda init: lambda self, bits, arrays: init(self, bits, 1)),
        (PacketCounter, lambda init: lambda self, arrays: init(self, 1)),
        (Waiting, lambda init: lambda self, layout, banks: init(self, layout, 2)),
    ],
)
def test_a_receiver_that_takes_several_arrays_for_one_is_found(crc_in_python, monkeypatch, part, one):
    monkeypatch.setattr(part, "__init__", one(part.__init__))
    with pytest.raises(AssertionError):
        only_whole_frames_leave(12, 20, 2, 5)


def only_whole_frames_leave(taxels, code_bits, code_bytes, arrays):
    dut = FrameReceiver(taxels, code_bits, code_bytes, arrays)
    array_bits = (arrays - 1).bit_length()
    draw = random.Random(taxels)
    reference = Received(code_words(taxels, code_bytes), arrays)
    expected, left, requesters, counters, own_counters, packets, waits = [], [], [], {}, {}, [], []
    sent = 0

    def send():
        nonlocal sent
        yield dut.sink.ip_address.eq(1)
        for words, length, damaged in traffic(draw, taxels, code_bytes, arrays):
            if sent >= CYCLES + 10 * taxels:
                break
            sent += len(words)
            yield dut.sink.length.eq(length)
            for at, word in enumerate(words):
                yield dut.sink.valid.eq(1)
                yield dut.sink.data.eq(word)
                yield dut.sink.last.eq(at == len(words) - 1)
                yield dut.sink.error.eq(damaged and at == len(words) - 1)
                yield dut.sink.src_port.eq(words[1] & 0xFFFF if len(words) > 1 else 0)
                yield
                while not (yield dut.sink.ready):
                    yield
            yield dut.sink.valid.eq(0)
            packets.append((words, length, damaged))
            for _ in range(draw.choice([0, 0, 1, taxels])):
                yield
        # What has come whole leaves.
        for _ in range(8 * (arrays + 1) * taxels):
            yield
        for name, counter in dut.counters.items():
            counters[name] = yield counter
        for array in range(arrays):
            yield dut.asked.eq(array)
            yield
            yield
            for name, counter in dut.own_counters.items():
                own_counters[name, array] = yield counter

    @passive
    def take():
        frame, pace = [], 1.0
        while True:
            yield dut.source.ready.eq(draw.random() < pace)
            yield
            if (yield dut.requester.valid):
                requesters.append((yield dut.requester.sequence))
            if (yield dut.source.valid) and (yield dut.source.ready):
                code = yield dut.source.data
                frame.append(code - 2**32 if code >> 31 else code)
                if (yield dut.source.last):
                    left.append((frame, (yield dut.source.id)))
                    frame, pace = [], draw.choice([1.0, 0.5, 0.3])

    @passive
    def decide():
        while True:
            yield
            if (yield dut.decides):
                waits.append((yield dut.waits))

    run_simulation(dut, [send(), take(), decide(), dut.check.crc.run()])
    waits = iter(waits)
    for words, length, damaged in packets:
        if whole := reference.add(words, length, damaged, waits):
            expected.append((codes_of(whole, taxels, code_bits, code_bytes), words[0] >> 12 & 15, words[1]))
    assert next(waits, None) is None
    assert left == [
        (frame, (k + 1) % 2**ID_BITS << array_bits | array) for k, (frame, array, _) in enumerate(expected)
    ]
    assert requesters == [sequence for *_, sequence in expected]
    assert counters == {name: reference.counters[name] for name in counters}
    of_all = ("refused", "damaged")
    assert own_counters == {
        (name, array): reference.counters[name] if name in of_all else reference.own[name, array] for name, array in own_counters
    }
    # Only a frame of several packets can lack one; of the long ones few are sent.
    rare = ["overrun", "refused"] if code_words(taxels, code_bytes) <= FRAGMENT_WORDS else ["cut"]
    assert len(left) > 3 and min(counters[name] for name in ["taken", "ignored", "damaged", *rare]) > 0, counters


class Sending(LiteXModule):
    """A sender, and the table of requesters that it reads."""

    def __init__(self, words):
        self.requesters = Requesters()
        self.sender = ResultSender(fragment_words(words), self.requesters, 7)


@pytest.mark.parametrize("words", [9, 2 * FRAGMENT_WORDS + 5])
def test_results_leave_in_whole_packets(crc_in_python, words):
    dut = Sending(words)
    draw = random.Random(words)
    frames = [[draw.randrange(2**32) for _ in range(words)] for _ in range(max(3, 400 // words))]
    clipped = [draw.randrange(2) for _ in frames]
    sink, packet = dut.sender.sink, dut.sender.source
    results, packets = [], []

    def send():
        for number, frame in enumerate(frames):
            yield dut.requesters.written.valid.eq(1)
            yield dut.requesters.write_id.eq(number % 2**ID_BITS)
            yield dut.requesters.written.ip_address.eq(number + 1)
            yield dut.requesters.written.port.eq(number + 100)
            yield dut.requesters.written.sequence.eq(3 * number)
            yield dut.requesters.written.time.eq(TIMES[number % 2] + number)
            yield
            yield dut.requesters.written.valid.eq(0)
            for at, word in enumerate(frame):
                yield sink.valid.eq(1)
                yield sink.data.eq(word)
                yield sink.id.eq(number % 2**ID_BITS)
                yield sink.clipped.eq(clipped[number])
                yield sink.last.eq(at == words - 1)
                yield
                while not (yield sink.ready):
                    yield
                yield sink.valid.eq(0)
                # The engine pauses within a frame.
                for _ in range(draw.choice([0, 0, 0, 3])):
                    yield
        for _ in range(4 * words):
            yield

    @passive
    def take():
        own, pauses = [], False
        while True:
            yield packet.ready.eq(draw.random() < 0.6)
            yield
            if (yield packet.valid) and not (yield packet.ready):
                continue
            if not (yield packet.valid):
                pauses |= bool(own)
                continue
            own.append((yield packet.data))
            assert (yield packet.length) <= 1472
            if (yield packet.last):
                assert not pauses, "a pause within a packet"
                assert (yield packet.length) == 4 * len(own) and (yield packet.last_be) == 8
                where = ((yield packet.ip_address), (yield packet.dst_port), (yield packet.src_port))
                packets.append((where, b"".join(word.to_bytes(4, "little") for word in own)))
                own = []

    run_simulation(dut, [send(), take(), dut.sender.crc.run()])
    host = Results()
    for (ip_address, port, own_port), data in packets:
        assert (ip_address + 99, own_port) == (port, 7)
        result = host.add(data)
        if result:
            results.append((ip_address, *result))
    assert results == [(k + 1, 3 * k, frame, clipped[k], TIMES[k % 2] + k) for k, frame in enumerate(frames)]


def extremes(exponent):
    """The forces of the largest and smallest size with an exponent: sizes with one exponent are an interval."""
    grown = lambda size: size + (size >> 15)
    bound = lambda bits: bisect_left(range(2**31), 2**bits, key=grown) - 1
    low, high = bound(14 + exponent) + 1 if exponent else 0, bound(15 + exponent)
    return [force for size in (low, high) for force in (size, ~size)]


def test_no_mantissa_saturates_and_the_error_is_bounded():
    # A mantissa grows with its force: with the extremes of each exponent all forces are proved.
    assert extremes(17)[2] == 2**31 - 1
    for exponent in range(18):
        least, _, most, negative = extremes(exponent)
        for force in extremes(exponent):
            assert exponent_of([force]) == exponent
            assert -(2**15) <= mantissa_of(force, exponent) < 2**15
            # Without the next exponent it would not fit, or its error could be the same.
            assert exponent == 0 or mantissa_of(least, exponent - 1) >= 2**15 - 1
        assert exponent == 0 or 2 ** (exponent - 1) < least * (2**-15 + 2**-29)
        draw = random.Random(exponent)
        forces = [draw.choice([-1, 1]) * draw.randrange(most + 1) for _ in range(2000)] + [most, negative]
        decoded = roundtrip(forces)
        assert max(abs(was - now) for was, now in zip(forces, decoded, strict=True)) <= 2**exponent / 2


def roundtrip(forces):
    exponent = exponent_of(forces)
    mantissas = [mantissa_of(force, exponent) for force in forces] + [0] * (len(forces) % 2)
    words = struct.unpack(f"<{len(mantissas) // 2}I", struct.pack(f"<{len(mantissas)}h", *mantissas))
    decoded = forces_of(words, exponent << 3 | len(forces) % 2 << 1)
    return [word - 2**32 if word >> 31 else word for word in decoded]


def test_an_exponent_that_ignores_rounding_saturates():
    # The largest force that has a bit less without rounding.
    force = 2**16 - 1
    assert force.bit_length() - 15 == 1 and mantissa_of(force, 1) == 2**15
    assert exponent_of([force]) == 2


@pytest.mark.parametrize("force_words, fragment", [(45, 8), (1, 1), *(pytest.param(*own, marks=NIGHTLY) for own in [(16, 8), (9, 360)])])
def test_short_forces_are_those_of_the_model(force_words, fragment):
    dut = ShortForces(force_words, fragment)
    draw = random.Random(force_words)
    others, frames, left = 6, [], []
    for number in range(40):
        sizes = [draw.randrange(32) for _ in range(4)]
        force = lambda: draw.choice(extremes(draw.randrange(18)) + [draw.randrange(-(2**bits), 2**bits) for bits in sizes])
        frames.append(([force() for _ in range(force_words)], [draw.randrange(2**32) for _ in range(others)], draw.randrange(2), number % 16))

    def send():
        for forces, rest, clipped, identifier in frames:
            for at, word in enumerate(forces + rest):
                yield dut.sink.valid.eq(1)
                yield dut.sink.data.eq(word)
                yield dut.sink.user.eq((at >= force_words) | clipped << 1)
                yield dut.sink.id.eq(identifier)
                yield dut.sink.last.eq(at + 1 == force_words + others)
                yield
                while not (yield dut.sink.ready):
                    yield
                yield dut.sink.valid.eq(0)
                for _ in range(draw.choice([0, 0, 0, 2])):
                    yield
        for _ in range(8 * force_words + 40):
            yield

    @passive
    def take():
        while True:
            yield dut.source.ready.eq(draw.random() < 0.7)
            yield
            if (yield dut.source.valid) and (yield dut.source.ready):
                names = ("data", "short", "padded", "exponent", "clipped", "id", "last")
                own = []
                for name in names:
                    own.append((yield getattr(dut.source, name)))
                left.append(tuple(own))

    run_simulation(dut, [send(), take()])
    expected = []
    for forces, rest, clipped, identifier in frames:
        for begin in range(0, force_words, 2 * fragment):
            block = forces[begin : begin + 2 * fragment]
            exponent, padded = exponent_of(block), len(block) % 2
            mantissas = [mantissa_of(force, exponent) % 2**16 for force in block] + [0] * padded
            for low, high in zip(mantissas[::2], mantissas[1::2]):
                expected.append((low | high << 16, 1, padded, exponent, clipped, identifier, 0))
        expected += [(word, 0, 0, 0, clipped, identifier, at + 1 == others) for at, word in enumerate(rest)]
    assert left == expected


@pytest.mark.parametrize(
    "options, message",
    [({"force_bits": 24}, "force_bits = 24, not 16 or 32"), ({"code_bytes": 3}, "code_bytes = 3, not 2 or 4")],
)
def test_another_choice_is_refused(options, message):
    class Core:
        manifest = {"core": {"stream_bits": 32}}

    with pytest.raises(CoreError, match=message):
        DermisUDP(Core(), Port(), **options)


def test_short_resultants_are_refused():
    class Core:
        manifest = {"core": {"stream_bits": 32}}
        taxels, code_bits, force_words, words, arrays = 12, 20, 12, 21, 1

    with pytest.raises(CoreError, match="force_bits = 16, with 4 triples of resultants, not 12 of forces"):
        DermisUDP(Core(), Port(), force_bits=16)


# Under Icarus; test_network.py has the same under Verilator, with LiteEth before it.
def test_a_core_on_the_network(monkeypatch):
    """A core between packets, under Icarus; packets so short that a frame has several."""
    for module in ("packets", "udp"):
        monkeypatch.setattr(f"dermis_litex.{module}.FRAGMENT_WORDS", 5)
    folder = BUILD / "udp"
    generate(folder, "--bus", "wishbone", "--stream-bits", "32")
    generate(folder / "engine")
    network = Packets(folder, 4)
    sources = write_verilog(network, network.pins(), folder, "network")
    own = environment("wishbone", 32, folder / "engine/dermis_press_tb")
    assert icarus(folder, "network", sources, "udp", own) == (2, 0)
