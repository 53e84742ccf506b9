"""hdl/examples/bare.v: the pin is high after a frame with a force, and low after one without. Run by test_examples.py."""

import struct

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge

from core import BEATS, CODES

THRESHOLD = 1000


async def send(dut, codes):
    for index, code in enumerate(codes):
        dut.code.value = code & 0xFFFF_FFFF
        dut.code_valid.value = 1
        dut.code_last.value = index == len(codes) - 1
        await RisingEdge(dut.clk)
        while not int(dut.code_ready.value):
            await RisingEdge(dut.clk)
    dut.code_valid.value = 0
    await ClockCycles(dut.clk, 2000)


@cocotb.test()
async def a_force_raises_the_pin(dut):
    cocotb.start_soon(Clock(dut.clk, 10, unit="ns").start())
    dut.reset_n.value = 0
    dut.code_valid.value = 0
    await ClockCycles(dut.clk, 10)
    dut.reset_n.value = 1
    largest = max(fz for _, _, fz in struct.iter_unpack("<3i", BEATS[: 12 * len(CODES)]))
    assert largest > THRESHOLD
    for codes, touched in [(CODES, 1), ([0] * len(CODES), 0), (CODES, 1), ([2**31 - 1] + CODES[1:], 0)]:
        await send(dut, codes)
        assert int(dut.touched.value) == touched, codes
