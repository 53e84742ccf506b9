"""Tests of a core of several arrays, each of which has a sender of its own behind the arbiter. Run by test_arrays.py, in Icarus."""

import os
import random

import cocotb

from arrays import ARRAYS, FORCE_BYTES, FORCES
from core import CODES, Bench, pauses


class Senders(Bench):
    """The core behind the arbiter, with a source for each array."""

    def __init__(self, dut):
        super().__init__(dut, "s0_axis")
        self.sources = [self.source] + [self.source_of(f"s{array}_axis") for array in range(1, ARRAYS)]

    async def send_of(self, array, codes=None):
        self.source = self.sources[array]
        await self.send(codes)


@cocotb.test()
async def each_array_is_as_if_alone_and_has_its_turn(dut):
    bench = await Senders.begin(dut)
    for array, source in enumerate(bench.sources):
        source.set_pause_generator(pauses(array, 0.1 + 0.2 * array))
    bench.sink.set_pause_generator(pauses(9, 0.2))
    rounds = 4 * int(os.environ.get("DERMIS_ROUNDS", 6))
    for array in range(ARRAYS):
        for _ in range(rounds):
            await bench.send_of(array)
    counts = [0] * ARRAYS
    for _ in range(ARRAYS * rounds):
        data, tid, spoiled, _ = await bench.receive()
        assert not spoiled and data[:FORCE_BYTES] == FORCES[tid], f"array {tid}"
        counts[tid] += 1
    assert counts == [rounds] * ARRAYS
    assert await bench.registers.errors() == set()


@cocotb.test()
async def a_sender_that_stalls_or_is_damaged_keeps_no_other_waiting(dut):
    bench = await Senders.begin(dut)
    draws = random.Random(4)
    # It ends within a frame: its other beats never come.
    bench.sources[1].set_pause_generator(beat >= 5 for beat in range(1_000_000))
    await bench.send_of(1)
    for _ in range(3):
        for array in (0, 2, 3):
            await bench.send_of(array)
    for _ in range(3):
        seen = set()
        for _ in range(3):
            data, tid, spoiled, _ = await bench.receive()
            assert not spoiled and data[:FORCE_BYTES] == FORCES[tid]
            seen.add(tid)
        assert seen == {0, 2, 3}
    assert await bench.registers.errors() == set()
    # Cut short: no answer. Too long: the surplus is, as of a core alone. The others have their results.
    await bench.send_of(2, CODES[: draws.randrange(1, len(CODES))])
    await bench.send_of(3, CODES + CODES[:5])
    await bench.send_of(0)
    await bench.send_of(2)
    await bench.send_of(3)
    assert sorted([(await bench.receive())[1] for _ in range(4)]) == [0, 2, 3, 3]
    assert await bench.registers.errors() == {"framing"}
