"""hdl/examples/dma.v between a core and a memory that is not ours. Run by test_examples.py."""

import itertools
import json
import os
import random
import struct

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge
from cocotbext.axi import AxiBus, AxiLiteBus, AxiLiteMaster, AxiRam

from core import BEATS, CODES, MAP

SOURCE, DESTINATION = 0x400, 0x1000
# Written around the answer: no word of it may change.
BORDER = b"\xa5" * 64


async def begin(dut, pauses):
    """The memory and the registers after a reset."""
    cocotb.start_soon(Clock(dut.clk, 10, unit="ns").start())
    dut.reset_n.value = 0
    dut.start.value = 0
    dut.source.value, dut.destination.value = SOURCE, DESTINATION
    registers = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axil"), dut.clk, dut.reset_n, reset_active_level=False)
    # Before the first edge of a reset nothing is defined.
    await ClockCycles(dut.clk, 10)
    memory = AxiRam(AxiBus.from_prefix(dut, "m_axi"), dut.clk, dut.reset_n, reset_active_level=False, size=2**13)
    if pauses:
        draws = random.Random(4)
        for channel in [
            memory.write_if.aw_channel,
            memory.write_if.w_channel,
            memory.write_if.b_channel,
            memory.read_if.ar_channel,
            memory.read_if.r_channel,
        ]:
            channel.set_pause_generator(draws.random() < 0.4 for _ in itertools.count())
    memory.write(DESTINATION - len(BORDER), BORDER + bytes(len(BEATS)) + BORDER)
    await ClockCycles(dut.clk, 10)
    dut.reset_n.value = 1
    await ClockCycles(dut.clk, 2)
    return memory, registers


async def transfer(dut):
    dut.start.value = 1
    await RisingEdge(dut.clk)
    dut.start.value = 0
    for _ in range(10_000):
        await RisingEdge(dut.clk)
        if not int(dut.busy.value):
            return
    raise AssertionError("the transfer does not end")


@cocotb.test()
@cocotb.parametrize(pauses=[False, True])
async def frames_go_from_memory_to_memory(dut, pauses):
    memory, registers = await begin(dut, pauses)
    for frame in range(3):
        # The second frame is another one, with another answer.
        codes = [code // 2 for code in CODES] if frame == 1 else CODES
        memory.write(SOURCE, struct.pack(f"<{len(codes)}i", *codes))
        memory.write(DESTINATION, bytes(len(BEATS)))
        await transfer(dut)
        assert not int(dut.failed.value)
        answer = memory.read(DESTINATION - len(BORDER), len(BEATS) + 2 * len(BORDER))
        assert answer[: len(BORDER)] == answer[-len(BORDER) :] == BORDER
        forces = answer[len(BORDER) : len(BORDER) + 12 * len(CODES)]
        assert (forces == BEATS[: 12 * len(CODES)]) == (frame != 1)
    frames_out = next(own["address"] for own in MAP["registers"] if own["name"] == "frames_out")
    assert int.from_bytes((await registers.read(frames_out, 4)).data, "little") == 3


assert json.loads(os.environ["DERMIS_SIZES"]) == [len(CODES), len(BEATS) // 4]
