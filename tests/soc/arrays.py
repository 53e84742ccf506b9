"""Tests of a core that serves several arrays. Run by test_arrays.py, in Icarus."""

import os
import random
from pathlib import Path

import cocotb

from core import CODES, FORCE_BYTES, MANIFEST, Bench, pauses

ARRAYS = int(os.environ["DERMIS_ARRAYS"])


def forces(array):
    """What an engine of the array alone answers the same codes with."""
    with open(os.environ["DERMIS_ALONE"].format(array), encoding="utf-8") as file:
        return b"".join(int(line, 16).to_bytes(12, "little") for line in file)[:FORCE_BYTES]


IMAGE, VERSION = Path(os.environ["DERMIS_IMAGE"]).read_bytes(), int(os.environ["DERMIS_VERSION"])
FORCES = [forces(array) for array in range(ARRAYS)]


def status(data, name):
    """A field of the first status."""
    own = next(field for field in MANIFEST["output"]["status"] if field["name"] == name)
    place = FORCE_BYTES + 4 * own["word"]
    return int.from_bytes(data[place : place + 4], "little") >> own["low"] & ((1 << own["bits"]) - 1)


@cocotb.test()
async def each_array_is_as_if_alone(dut):
    assert len(set(FORCES)) == ARRAYS
    bench = await Bench.begin(dut)
    bench.source.set_pause_generator(pauses(1, 0.2))
    bench.sink.set_pause_generator(pauses(2, 0.2))
    draws = random.Random(5)
    for _ in range(int(os.environ.get("DERMIS_ROUNDS", 6))):
        # Above the number of the array `tid` is free.
        tids = [draws.randrange(16 * ARRAYS) for _ in range(4)]
        for tid in tids:
            await bench.send(tid=tid)
        for tid in tids:
            data, own, spoiled, _ = await bench.receive()
            assert (own, spoiled) == (tid, False)
            assert data[:FORCE_BYTES] == FORCES[tid % ARRAYS], f"array {tid % ARRAYS}"
    assert await bench.registers.errors() == set()


@cocotb.test()
async def a_damaged_frame_of_an_array_harms_no_other(dut):
    bench = await Bench.begin(dut)
    for array in range(ARRAYS):
        await bench.send(tid=array)
    for array in range(ARRAYS):
        await bench.expect(array, forces=False)
    # Cut short: the mean of the second array begins anew; the others go on.
    await bench.send(CODES[:5], tid=1)
    for array in range(ARRAYS):
        await bench.send(tid=array)
    for array in range(ARRAYS):
        data = await bench.expect(array, forces=False)
        assert data[:FORCE_BYTES] == FORCES[array]
        frames = status(data, "frames")
        assert frames == (1 if array == 1 else 2), f"array {array}: {frames} frames in its mean"
    assert await bench.registers.errors() == {"framing"}


@cocotb.test()
async def an_image_is_of_its_array_alone(dut):
    bench = await Bench.begin(dut)
    for turn in range(2):
        for array in range(ARRAYS):
            await bench.send(tid=array)
        for array in range(ARRAYS):
            data, own, spoiled, _ = await bench.receive()
            written = turn == 1 and array == 2
            assert (own, spoiled) == (array, False)
            assert data[:FORCE_BYTES] == FORCES[0 if written else array], f"array {array}"
            seen = (status(data, "frames"), status(data, "tables_version"))
            assert seen == ((1, VERSION) if written else (turn + 1, 0)), f"array {array}: {seen}"
        if turn == 0:
            # It is that of the first array: the third answers as the first from then on, and its mean begins anew.
            await bench.registers.load(IMAGE, array=2)
    assert await bench.registers.errors() == set()
