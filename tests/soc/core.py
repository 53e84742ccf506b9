"""Bus-functional tests of a core: registers over AXI4-Lite or Wishbone, streams of every width. Run by test_cores.py, in
Icarus: cocotb calls every function with the decorator `test`, with the core as `dut`."""

import itertools
import json
import os
import random
import struct
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import ClockCycles, ReadOnly, RisingEdge, Timer, with_timeout
from cocotbext.axi import AxiLiteBus, AxiLiteMaster, AxiResp, AxiStreamBus, AxiStreamFrame, AxiStreamSink, AxiStreamSource

FOLDER = os.environ["DERMIS_CORE"]
BUS = os.environ["DERMIS_BUS"]
WORDS = int(os.environ["DERMIS_WORDS"])
MAP = json.loads(Path(FOLDER, "registers.json").read_text(encoding="utf-8"))
REGISTERS = {register["name"]: register for register in MAP["registers"]}
MANIFEST = json.loads(Path(FOLDER, "manifest.json").read_text(encoding="utf-8"))
CODE_BITS = MANIFEST["input"]["bits"]
FORCES = MAP["constants"]["force_triples"]
# Cycles after which something hangs, far more than two frames take.
PATIENCE = 40_000


def lines(ending):
    """The words of a memory file of the engine's testbench."""
    with open(f"{os.environ['DERMIS_VECTORS']}{ending}", encoding="utf-8") as file:
        return [int(line, 16) for line in file]


def low_bit(register, field):
    return next(own["low"] for own in REGISTERS[register]["fields"] if own["name"] == field)


def signed(word, bits):
    return word - (1 << bits) if word >> (bits - 1) else word


CODES = [signed(word, CODE_BITS) for word in lines("_codes.hex")]
# fx is in the low bits; the bytes of an array of triples.
BEATS = b"".join(beat.to_bytes(12, "little") for beat in lines("_beats.hex"))
FORCE_BYTES = 12 * FORCES


class Registers:
    """The registers by name, over either bus."""

    def __init__(self, dut):
        self.dut = dut
        if BUS == "axi":
            bus = AxiLiteBus.from_prefix(dut, "s_axil")
            self.master = AxiLiteMaster(bus, dut.aclk, dut.aresetn, reset_active_level=False)
        else:
            for pin in [dut.wb_cyc, dut.wb_stb, dut.wb_we, dut.wb_adr, dut.wb_dat_w, dut.wb_sel]:
                pin.value = 0

    async def access(self, address, data=None, strobe=15):
        """Reads or writes; the content, and whether the core refused."""
        if BUS == "axi":
            if data is None:
                answer = await self.master.read(address, 4)
                return int.from_bytes(answer.data, "little"), answer.resp != AxiResp.OKAY
            answer = await self.master.write(address, data.to_bytes(4, "little"))
            return None, answer.resp != AxiResp.OKAY
        dut = self.dut
        dut.wb_adr.value, dut.wb_we.value, dut.wb_sel.value = address // 4, data is not None, strobe
        dut.wb_dat_w.value = data or 0
        dut.wb_cyc.value = dut.wb_stb.value = 1
        for _ in range(PATIENCE):
            await ReadOnly()
            content, done, refused = dut.wb_dat_r.value, int(dut.wb_ack.value), int(dut.wb_err.value)
            await RisingEdge(dut.aclk)
            if done or refused:
                dut.wb_cyc.value = dut.wb_stb.value = 0
                assert not (done and refused)
                await RisingEdge(dut.aclk)
                return (None if data is not None else int(content)), bool(refused)
        raise AssertionError("no answer")

    async def read(self, name):
        content, refused = await self.access(REGISTERS[name]["address"])
        assert not refused, name
        return content

    async def write(self, name, data):
        _, refused = await self.access(REGISTERS[name]["address"], data)
        assert not refused, name

    async def pulse(self, name, field):
        await self.write(name, 1 << low_bit(name, field))

    async def is_set(self, name, field):
        """Whether a bit of a register is high."""
        return bool((await self.read(name)) >> low_bit(name, field) & 1)

    async def push(self, byte, last, array=0):
        """Writes a byte of an image of tables once there is room for it."""
        while await self.is_set("tables", "waiting"):
            pass
        await self.write("tables", byte | last << low_bit("tables", "last") | array << low_bit("tables", "array"))

    async def load(self, image, array=0):
        """Writes an image of tables of an array, which its first byte names."""
        for place, byte in enumerate(image):
            await self.push(byte, place + 1 == len(image), array if place == 0 else 15 - array)
        while await self.is_set("tables", "waiting"):
            pass

    async def errors(self):
        """Names of the errors since they were last cleared, which clears them."""
        word = await self.read("errors")
        await self.write("errors", word)
        return {own["name"] for own in REGISTERS["errors"]["fields"] if word >> own["low"] & 1}


class Bench:
    """The core after a reset, with a source, a sink and the registers."""

    def __init__(self, dut, source="s_axis"):
        self.dut = dut
        self.source = self.source_of(source)
        self.sink = AxiStreamSink(AxiStreamBus.from_prefix(dut, "m_axis"), dut.aclk, dut.aresetn, reset_active_level=False)
        self.registers = Registers(dut)

    def source_of(self, prefix):
        dut = self.dut
        return AxiStreamSource(AxiStreamBus.from_prefix(dut, prefix), dut.aclk, dut.aresetn, reset_active_level=False)

    @classmethod
    async def begin(cls, dut):
        cocotb.start_soon(Clock(dut.aclk, 10, unit="ns").start())
        dut.aresetn.value = 0
        bench = cls(dut)
        await ClockCycles(dut.aclk, 20)
        dut.aresetn.value = 1
        await ClockCycles(dut.aclk, 2)
        cocotb.start_soon(offered_beats_stay(dut))
        return bench

    async def send(self, codes=None, tid=0):
        codes = CODES if codes is None else codes
        await self.source.send(AxiStreamFrame(struct.pack(f"<{len(codes)}i", *codes), tid=tid))

    async def words(self, cycles=PATIENCE):
        """A frame: its bytes, its identifier, and of each word whether it is spoiled, and whether it is no force."""
        frame = await with_timeout(self.sink.recv(compact=False), 10 * cycles, "ns")
        kept = [index for index, keep in enumerate(frame.tkeep) if keep]
        # A frame has no gaps: only the end of its last beat is empty.
        assert kept == list(range(len(kept))) and len(frame.tkeep) - len(kept) < 4 * WORDS
        data = bytes(frame.tdata[index] for index in kept)
        users = [frame.tuser[index] for index in kept[::4]]
        ids = {frame.tid[index] for index in kept}
        assert len(ids) == 1
        others = [bool(user >> (word % WORDS) & 1) for word, user in enumerate(users)]
        return data, ids.pop(), [bool(user >> WORDS) for user in users], others

    async def receive(self):
        """A frame: its bytes, its identifier, whether it is spoiled, and the index of the first word that is no force."""
        data, tid, spoiled, others = await self.words()
        assert len(set(spoiled)) == 1
        first = others.index(True)
        assert all(others[first:])
        return data, tid, spoiled[0], first

    async def expect(self, tid, spoiled=False, forces=True):
        data, own, own_spoiled, first = await self.receive()
        assert (own, own_spoiled, first, len(data)) == (tid, spoiled, 3 * FORCES, len(BEATS))
        if forces:
            assert data[:FORCE_BYTES] == BEATS[:FORCE_BYTES]
        return data


async def offered_beats_stay(dut):
    """An offered beat stays as it is until it is accepted; only `aresetn` takes it back."""
    pins = [dut.m_axis_tdata, dut.m_axis_tkeep, dut.m_axis_tuser, dut.m_axis_tid, dut.m_axis_tlast]
    held = None
    while True:
        await RisingEdge(dut.aclk)
        is_reset, valid = dut.aresetn.value != 1, dut.m_axis_tvalid.value == 1
        now = [pin.value for pin in pins] if valid and not is_reset else None
        assert held is None or is_reset or now == held, f"{held} on the output became {now}"
        held = None if dut.m_axis_tready.value == 1 else now


def pauses(seed, share):
    draws = random.Random(seed)
    return (draws.random() < share for _ in itertools.count())


@cocotb.test()
async def constants_are_those_of_the_scene(dut):
    bench = await Bench.begin(dut)
    for name, content in MAP["constants"].items():
        assert await bench.registers.read(name) == content, name
    assert await bench.registers.read("id") == int.from_bytes(b"DERM", "little")


@cocotb.test()
async def a_frame_is_that_of_the_model(dut):
    bench = await Bench.begin(dut)
    await bench.send(tid=5)
    await bench.expect(5)
    registers = bench.registers
    assert [await registers.read("frames_in"), await registers.read("frames_out")] == [1, 1]
    assert await registers.errors() == set()


@cocotb.test()
async def frames_back_to_back_with_pauses_keep_order_and_identifier(dut):
    bench = await Bench.begin(dut)
    bench.source.set_pause_generator(pauses(1, 0.3))
    bench.sink.set_pause_generator(pauses(2, 0.4))
    draws = random.Random(3)
    ids = [draws.randrange(16) for _ in range(6)]
    for tid in ids:
        await bench.send(tid=tid)
    for tid in ids:
        await bench.expect(tid)
    assert await bench.registers.read("frames_out") == len(ids)


@cocotb.test()
async def a_code_out_of_range_is_clipped_and_its_frame_alone_is_spoiled(dut):
    bench = await Bench.begin(dut)
    most = (1 << (CODE_BITS - 1)) - 1
    await bench.send([2**31 - 1] + CODES[1:], tid=1)
    await bench.send([most] + CODES[1:], tid=2)
    await bench.send([-(2**31)] + CODES[1:], tid=3)
    clipped = await bench.expect(1, spoiled=True, forces=False)
    right = await bench.expect(2, forces=False)
    assert clipped[:FORCE_BYTES] == right[:FORCE_BYTES]
    await bench.expect(3, spoiled=True, forces=False)
    assert await bench.registers.read("codes_clipped") == 2
    assert await bench.registers.errors() == {"clipped"}
    assert await bench.registers.errors() == set()


@cocotb.test()
async def a_wrong_length_is_told_and_the_next_frame_is_right(dut):
    bench = await Bench.begin(dut)
    # Cut short: no answer; too long: the frame that ends early begins with the surplus, and is cut short itself.
    await bench.send(CODES[:5], tid=1)
    await bench.send(CODES, tid=2)
    await bench.send(CODES + CODES[:2], tid=3)
    await bench.send(CODES, tid=4)
    for tid in [2, 3, 4]:
        await bench.expect(tid)
    registers = bench.registers
    assert [await registers.read("frames_in"), await registers.read("frames_out")] == [3, 3]
    assert await registers.errors() == {"framing"}
    assert await registers.read("frames_misframed") == 3


@cocotb.test()
async def a_beat_without_all_bytes_spoils_its_frame(dut):
    bench = await Bench.begin(dut)
    data = struct.pack(f"<{len(CODES)}i", *CODES)
    keep = [1] * len(data)
    keep[7] = 0
    await bench.source.send(AxiStreamFrame(data, tkeep=keep, tid=9))
    await bench.expect(9, spoiled=True)
    assert await bench.registers.read("beats_partial") == 1
    assert await bench.registers.errors() == {"partial"}


@cocotb.test()
async def a_wrong_access_is_refused_and_changes_nothing(dut):
    bench = await Bench.begin(dut)
    registers = bench.registers
    last = max(register["address"] for register in MAP["registers"])
    for address in [last + 4, 0xFC]:
        assert (await registers.access(address))[1], hex(address)
        assert (await registers.access(address, 1))[1], hex(address)
    assert (await registers.access(REGISTERS["frames_in"]["address"], 7))[1]
    assert (await registers.access(REGISTERS["id"]["address"], 7))[1]
    # The tables are in the bitstream.
    assert (await registers.access(REGISTERS["tables"]["address"], 7))[1] and await registers.read("tables") == 0
    assert await registers.read("id") == MAP["constants"]["id"]
    assert await registers.read("accesses_refused") == 7
    assert await registers.errors() == {"access"}
    await bench.send(tid=1)
    await bench.expect(1)


@cocotb.test()
async def a_reset_by_register_ends_a_frame_under_way(dut):
    bench = await Bench.begin(dut)
    registers = bench.registers
    await bench.send(CODES[: len(CODES) - 2], tid=1)
    await bench.source.wait()
    await registers.pulse("control", "reset")
    await ClockCycles(dut.aclk, 24)
    await bench.send(tid=2)
    await bench.expect(2)
    # The counters stay, until they are cleared.
    assert await registers.read("frames_out") == 1
    await registers.pulse("control", "clear")
    assert await registers.read("frames_out") == 0
    before = await registers.read("cycles")
    await Timer(1, unit="us")
    assert await registers.read("cycles") - before >= 100


@cocotb.test()
async def a_frame_of_several_identifiers_is_spoiled_and_told_once(dut):
    bench = await Bench.begin(dut)
    data = struct.pack(f"<{len(CODES)}i", *CODES)
    # Beats of another source in the middle, and at the end.
    tids = [3] * len(CODES)
    tids[5] = tids[6] = tids[-1] = 4
    await bench.source.send(AxiStreamFrame(data, tid=[tid for tid in tids for _ in range(4)]))
    await bench.send(tid=4)
    await bench.expect(3, spoiled=True)
    await bench.expect(4)
    assert await bench.registers.read("frames_misframed") == 1
    assert await bench.registers.errors() == {"framing"}


async def accepted(dut, beats):
    """Waits until so many beats of the output have been accepted."""
    while beats:
        await RisingEdge(dut.aclk)
        beats -= dut.m_axis_tvalid.value == 1 and dut.m_axis_tready.value == 1


@cocotb.test()
async def a_reset_by_register_ends_the_frame_that_leaves_and_counters_stay_true(dut):
    bench = await Bench.begin(dut)
    registers = bench.registers
    draws = random.Random(4)
    rounds = 6
    for tid in range(rounds):
        await bench.send(tid=tid)
        await accepted(dut, draws.randrange(1, 4))
        # A receiver that waits gets the rest after the reset.
        bench.sink.pause = tid % 2 == 1 or WORDS == 4
        await registers.pulse("control", "reset")
        await ClockCycles(dut.aclk, draws.randrange(1, 60))
        bench.sink.pause = False
        # It has begun.
        data, own, spoiled, others = await bench.words(1000)
        # Some whole triples as they are, and one of zeros that are no forces; the receiver has a frame of its own.
        assert own == tid and len(data) < len(BEATS) and len(data) % 12 == 0
        assert data == BEATS[: len(data) - 12] + bytes(12) and all(others[-3:])
        assert spoiled[-1] and not spoiled[0]
        await ClockCycles(dut.aclk, 24)
        await bench.send(tid=tid + 8)
        await bench.expect(tid + 8)
    # One that is lost in the engine leaves no word.
    await bench.send(tid=7)
    while await registers.read("frames_in") != 2 * rounds + 1:
        pass
    await registers.pulse("control", "reset")
    await ClockCycles(dut.aclk, 24)
    await bench.send(tid=9)
    await bench.expect(9)
    counts = [await registers.read(name) for name in ["frames_in", "frames_out", "frames_lost"]]
    assert counts == [2 * rounds + 2, rounds + 1, rounds + 1]
    # A sender that goes on has no error from all this.
    assert await registers.errors() == set()
