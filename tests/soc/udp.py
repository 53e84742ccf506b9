"""A core between packets of a UDP port, in Icarus: run by test_udp.py, which makes the top module `network`."""

import random
import struct

import cocotb
import dermis_litex.packets
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, RisingEdge
from core import BEATS, CODES

# As in test_udp.py: a frame has several packets.
dermis_litex.packets.FRAGMENT_WORDS = 5
# Cycles of the test with wrong packets.
CYCLES = 20_000
PORT, ADDRESS = 4321, 0x0A000001
RESULT = [word for (word,) in struct.iter_unpack("<I", BEATS)]


class Host:
    """Sends packets, and collects results."""

    def __init__(self, dut):
        self.dut = dut
        self.results = []
        self.incomplete = dermis_litex.packets.Results()

    @staticmethod
    async def begin(dut):
        host = Host(dut)
        for pin in ["valid", "last", "error", "data", "length", "src_port", "dst_port", "ip_address", "first", "last_be"]:
            getattr(dut, f"source_{pin}").value = 0
        dut.sink_ready.value = 0
        dut.sys_rst.value = 1
        cocotb.start_soon(Clock(dut.sys_clk, 10, "ns").start())
        await ClockCycles(dut.sys_clk, 4)
        dut.sys_rst.value = 0
        cocotb.start_soon(host.collect())
        return host

    async def collect(self):
        dut, own = self.dut, []
        while True:
            dut.sink_ready.value = random.random() < 0.8
            await RisingEdge(dut.sys_clk)
            if int(dut.sink_valid.value) and int(dut.sink_ready.value):
                own.append(int(dut.sink_data.value))
                if int(dut.sink_last.value):
                    assert int(dut.sink_length.value) == 4 * len(own)
                    assert int(dut.sink_dst_port.value) == PORT and int(dut.sink_ip_address.value) == ADDRESS
                    result = self.incomplete.add(b"".join(word.to_bytes(4, "little") for word in own))
                    own = []
                    if result:
                        self.results.append(result)

    async def send(self, packet, damaged=False):
        dut = self.dut
        dut.source_length.value = len(packet)
        dut.source_src_port.value = PORT
        dut.source_ip_address.value = ADDRESS
        for at in range(0, len(packet), 4):
            dut.source_valid.value = 1
            dut.source_data.value = int.from_bytes(packet[at : at + 4], "little")
            dut.source_last.value = at + 4 == len(packet)
            dut.source_error.value = damaged and at + 4 == len(packet)
            await RisingEdge(dut.sys_clk)
            while not int(dut.source_ready.value):
                await RisingEdge(dut.sys_clk)
        dut.source_valid.value = 0


@cocotb.test()
async def frames_are_answered_by_their_sequence(dut):
    host = await Host.begin(dut)
    for sequence in [7, 8, 0x80000000]:
        for packet in dermis_litex.packets.frame_packets(sequence, CODES, 4):
            await host.send(packet)
        await ClockCycles(dut.sys_clk, 3000)
    assert [own[:3] for own in host.results] == [(7, RESULT, 0), (8, RESULT, 0), (0x80000000, RESULT, 0)]


@cocotb.test()
async def after_lost_doubled_reordered_and_damaged_packets_frames_are_right(dut):
    host, draw = await Host.begin(dut), random.Random(5)
    whole, sequence, end = [], 100, 0
    while end < CYCLES:
        sequence += 1
        codes = list(CODES)
        clips = draw.random() < 0.3
        if clips:
            codes[0] = 1 << 30
        sent = [(packet, False) for packet in dermis_litex.packets.frame_packets(sequence, codes, 4)]
        form = draw.choice(["right", "right", "lost", "doubled", "reordered", "damaged"])
        if form == "lost":
            sent.pop(draw.randrange(len(sent)))
        elif form == "doubled":
            sent.insert(draw.randrange(len(sent)), draw.choice(sent))
        elif form == "reordered":
            draw.shuffle(sent)
        elif form == "damaged":
            sent[-1] = (sent[-1][0], True)
        for packet, damaged in sent:
            await host.send(packet, damaged)
        if form not in ("lost", "damaged"):
            whole.append((sequence, clips))
        # A frame after the other: with fewer pauses whole frames would be refused.
        await ClockCycles(dut.sys_clk, 900)
        end += 900
    await ClockCycles(dut.sys_clk, 3000)
    assert [(own.sequence, bool(own.flags)) for own in host.results] == whole
    assert all(own.words == RESULT for own in host.results if not own.flags)
    assert len(whole) > 10 and any(clips for _, clips in whole)
