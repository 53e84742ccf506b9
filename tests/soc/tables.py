"""Tests of a core whose tables are written through its registers. Run by test_tables.py, in Icarus."""

import itertools
import os
import random
from pathlib import Path

import cocotb
from cocotb.triggers import ClockCycles

from core import BEATS, CODES, FORCE_BYTES, REGISTERS, Bench, pauses

IMAGE = Path(os.environ["DERMIS_IMAGE"]).read_bytes()
# The tables of the bitstream, as version 1.
OWN_IMAGE = Path(os.environ["DERMIS_OWN_IMAGE"]).read_bytes()
VERSION = int(os.environ["DERMIS_VERSION"])
CYCLES = int(os.environ.get("DERMIS_CYCLES", 20_000))
OWN = BEATS[:FORCE_BYTES]
with open(f"{os.environ['DERMIS_SPECIMEN']}_beats.hex", encoding="utf-8") as file:
    SPECIMEN = b"".join(int(line, 16).to_bytes(12, "little") for line in file)[:FORCE_BYTES]
# In the flags of the first status triple, and above the shift in the second.
INCOMPLETE = 1 << 6
REFUSED = 1 << 15


def status(data):
    """Version and whether the last image was refused, whether the tables are incomplete."""
    word = lambda index: int.from_bytes(data[FORCE_BYTES + 4 * index : FORCE_BYTES + 4 * index + 4], "little")
    version = word(5) >> 16
    return version & (REFUSED - 1), bool(version & REFUSED), bool(word(2) & INCOMPLETE)


async def frame(bench, tid=1):
    await bench.send(CODES, tid=tid)
    data, *_ = await bench.receive()
    return data[:FORCE_BYTES], status(data)


async def begin(dut):
    """A bench whose core has the tables of its bitstream as version 1: those of the test before outlast a reset."""
    bench = await Bench.begin(dut)
    await bench.registers.load(OWN_IMAGE)
    return bench


# The first test: the tables are those of the bitstream.
@cocotb.test()
async def a_frame_after_an_image_is_the_specimen_s(dut):
    bench = await Bench.begin(dut)
    assert SPECIMEN != OWN
    assert await bench.registers.is_set("tables", "writable")
    assert await frame(bench) == (OWN, (0, False, False))
    await bench.registers.load(IMAGE)
    assert await frame(bench) == (SPECIMEN, (VERSION, False, False))
    # A reset leaves the tables.
    await bench.registers.pulse("control", "reset")
    await ClockCycles(dut.aclk, 24)
    assert await frame(bench) == (SPECIMEN, (VERSION, False, False))
    assert await bench.registers.errors() == set()


@cocotb.test()
async def a_byte_waits_for_the_frame_and_another_is_refused(dut):
    bench = await begin(dut)
    registers = bench.registers
    # Some codes, then none for long.
    bench.source.set_pause_generator(itertools.chain([False] * 7, [True] * 400, itertools.repeat(False)))
    await bench.send(CODES, tid=2)
    await ClockCycles(dut.aclk, 60)
    await registers.write("tables", IMAGE[0])
    assert await registers.is_set("tables", "waiting")
    assert (await registers.access(REGISTERS["tables"]["address"], IMAGE[1]))[1]
    assert await registers.errors() == {"access"}
    data, *_ = await bench.receive()
    assert data[:FORCE_BYTES] == OWN
    for place, byte in enumerate(IMAGE[1:]):
        await registers.push(byte, place + 2 == len(IMAGE))
    assert await frame(bench) == (SPECIMEN, (VERSION, False, False))


@cocotb.test()
async def frames_under_way_are_solved_with_the_old_tables_and_later_ones_with_the_new(dut):
    bench = await begin(dut)
    bench.sink.set_pause_generator(pauses(2, 0.4))
    for tid in range(6):
        await bench.send(CODES, tid=tid)
    loading = cocotb.start_soon(bench.registers.load(IMAGE))
    seen = []
    for tid in range(6):
        data, own, *_ = await bench.receive()
        assert own == tid
        seen.append((data[:FORCE_BYTES], status(data)))
    await loading
    assert await frame(bench) == (SPECIMEN, (VERSION, False, False))
    old, new = (OWN, (1, False, False)), (SPECIMEN, (VERSION, False, False))
    assert all(one in (old, new) for one in seen), [one[1] for one in seen]
    assert seen == sorted(seen, key=lambda one: one == new)


@cocotb.test()
async def wrong_images_are_refused_and_the_next_frame_is_right(dut):
    """Damaged, cut short, too long, for other hardware, broken off by a reset; counts are printed for the table."""
    bench = await begin(dut)
    draws = random.Random(11)
    counts = {}
    current = (OWN, 1)
    start = await bench.registers.read("cycles")
    while await bench.registers.read("cycles") - start < CYCLES:
        kind = draws.choice(["whole", "damaged", "short", "long", "other", "reset"])
        image = bytearray(IMAGE)
        if kind == "damaged":
            image[draws.randrange(6, len(image))] ^= 1 << draws.randrange(8)
        elif kind == "short":
            image = image[: draws.randrange(7, len(image))]
        elif kind == "long":
            image += image[:3]
        elif kind == "other":
            image[draws.randrange(6)] ^= 1 << draws.randrange(8)
        if kind == "reset":
            for byte in image[: draws.randrange(7, len(image))]:
                await bench.registers.push(byte, False)
            await bench.registers.pulse("control", "reset")
            await ClockCycles(dut.aclk, 24)
        else:
            await bench.registers.load(image)
        if kind == "whole":
            current = (SPECIMEN, VERSION)
        elif kind != "other":
            current = None
        forces, (version, refused, incomplete) = await frame(bench)
        if current is None:
            assert (forces, version, incomplete) == (bytes(FORCE_BYTES), 0, True), kind
        else:
            assert (forces, version, incomplete) == (*current, False), kind
        assert refused == (kind != "whole"), kind
        counts[kind] = counts.get(kind, 0) + 1
    assert await bench.registers.errors() == set()
    dut._log.info("images: %s", counts)
    assert len(counts) == 6
