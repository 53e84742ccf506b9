"""The core as a LiteX module."""

import json
from pathlib import Path

from litex.gen import Cat, ClockSignal, If, Instance, LiteXModule, Mux, ResetSignal, Signal
from litex.soc.interconnect import stream, wishbone

WORD_BITS = 32
# Of a core of one array; that of several has the number of the array below them.
ID_BITS = 4
REMEDY = "write the folder with `dermis build SCENE --bus wishbone`"


class CoreError(ValueError):
    """A folder does not hold what `dermis build SCENE --bus wishbone` writes."""


def read_json(path):
    """A file of the folder."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise CoreError(f"{path}: {error}; {REMEDY}") from error


def read_manifest(folder):
    """The manifest of a core with registers on Wishbone.

    Raises `CoreError` with file, field and what would be right.
    """
    path = Path(folder) / "manifest.json"
    manifest = read_json(path)
    core = manifest.get("core") or {}
    if core.get("bus") != "wishbone":
        raise CoreError(f"{path}: core.bus = {json.dumps(core.get('bus'))}, not \"wishbone\"; {REMEDY}")
    return manifest


def require_width(core, bits):
    """A core whose results are `bits` wide.

    Raises `CoreError` with field, value and what would be right.
    """
    own = core.manifest["core"]["stream_bits"]
    if own != bits:
        raise CoreError(
            f"core.stream_bits = {own}, on a bus of {bits} bits; "
            f"write the folder with `dermis build SCENE --bus wishbone --stream-bits {bits}`"
        )


def require_choice(name, value, choices):
    """An argument that is one of `choices`.

    Raises `CoreError` with name, value and what would be right.
    """
    if value not in choices:
        raise CoreError(f"{name} = {value!r}, not {' or '.join(map(str, choices))}")


def require_forces(core):
    """A core that sends the force of every taxel.

    Raises `CoreError` with field, value and what would be right.
    """
    if core.force_words != 3 * core.taxels:
        raise CoreError(
            f"force_bits = 16, with {core.force_words // 3} triples of resultants, not {core.taxels} of forces: an exponent would be that "
            'of the largest moment; take force_bits = 32, or build with output.forces = "taxels"'
        )


def results(words, id_bits=ID_BITS):
    """The layout of a core's results, `words` words in a beat."""
    return [("data", WORD_BITS * words), ("keep", WORD_BITS // 8 * words), ("user", words + 1), ("id", id_bits)]


class WholeFrames(LiteXModule):
    """Results in, each of them with `count` words out, `words` in a beat: one that ends early, because a reset by register abandoned it,
    is filled up with words of 0 that are spoiled and no forces. Its status has no cycles."""

    def __init__(self, words, count, id_bits=ID_BITS):
        self.sink = sink = stream.Endpoint(results(words, id_bits))
        self.source = source = stream.Endpoint(results(words, id_bits))

        # # #

        beats = -(-count // words)
        all_kept = 2 ** len(sink.keep) - 1
        # A word has a bit of `keep` per byte.
        last_kept = 2 ** (WORD_BITS // 8 * (count - (beats - 1) * words)) - 1
        at, fills, ends, identifier = Signal(max=max(beats, 2)), Signal(), Signal(), Signal(id_bits)
        self.comb += [
            ends.eq(at == beats - 1),
            source.valid.eq(sink.valid | fills),
            source.last.eq(ends),
            source.data.eq(Mux(fills, 0, sink.data)),
            source.keep.eq(Mux(ends, last_kept, all_kept)),
            source.user.eq(Mux(fills, 2 ** len(sink.user) - 1, sink.user)),
            source.id.eq(Mux(fills, identifier, sink.id)),
            sink.ready.eq(source.ready & ~fills),
        ]
        self.sync += If(
            source.valid & source.ready,
            identifier.eq(source.id),
            at.eq(at + 1),
            If(ends, at.eq(0), fills.eq(0)).Elif(sink.last, fills.eq(1)),
        )


class Dermis(LiteXModule):
    """A core between two streams.

    - `sink`: a taxel's code per beat, 32 bits signed, row-major; `last` on a frame's last taxel; `id` names the frame, with several
      arrays in its low bits the array.
    - `source`: words of 32 bits, fx, fy, fz of each taxel, then status, always `words` of a frame (see `WholeFrames`); `keep`,
      `user` and `id` as the guide says.
    - `bus`: the register map on Wishbone, addresses of words, 64 registers.
    - `manifest`: scales and counts, as in `manifest.json`.
    - `constants`: the content of the constant registers, by name.
    - `writable_tables`, `tables_register`: whether a specimen's tables can be written, and the register for them.
    - `arrays`, `array_bits`: how many it serves, and the bits of `id` that name one.
    - `taxels`, `code_bits`, `words`: of a frame the codes, their bits, and the words of 32 bits that come back.
    - `force_words`: how many of those are forces, or resultants.
    - `folder`: the folder of the core.

    The Verilog and its memory files are added to `platform`.
    """

    def __init__(self, platform, folder):
        self.folder = folder = Path(folder).resolve()
        self.manifest = read_manifest(folder)
        registers = read_json(folder / "registers.json")
        self.constants = constants = registers["constants"]
        self.tables_register = next(own for own in registers["registers"] if own["name"] == "tables")
        self.writable_tables = self.manifest["input"].get("tables") is not None
        rows, cols, self.code_bits, _ = constants["array"].to_bytes(4, "little")
        self.taxels = rows * cols
        self.force_words = 3 * constants["force_triples"]
        self.words = self.force_words + 3 * constants["status_triples"]
        bits = self.manifest["core"]["stream_bits"]
        words = bits // WORD_BITS
        # Earlier versions wrote none: they had as many for any number of arrays.
        id_bits = self.manifest["core"].get("id_bits", ID_BITS)
        self.arrays, self.array_bits = self.manifest["input"].get("arrays", 1), id_bits - ID_BITS
        self.sink = stream.Endpoint([("data", WORD_BITS), ("id", id_bits)])
        self.frames = WholeFrames(words, self.words, id_bits)
        self.source = self.frames.source
        self.bus = wishbone.Interface(data_width=WORD_BITS, address_width=8, addressing="word")

        # # #

        top = self.manifest["top"]
        self.specials += Instance(
            top,
            i_aclk=ClockSignal(),
            i_aresetn=~ResetSignal(),
            i_s_axis_tdata=self.sink.data,
            i_s_axis_tkeep=2 ** (WORD_BITS // 8) - 1,
            i_s_axis_tid=self.sink.id,
            i_s_axis_tvalid=self.sink.valid,
            o_s_axis_tready=self.sink.ready,
            i_s_axis_tlast=self.sink.last,
            o_m_axis_tdata=self.frames.sink.data,
            o_m_axis_tkeep=self.frames.sink.keep,
            o_m_axis_tuser=self.frames.sink.user,
            o_m_axis_tid=self.frames.sink.id,
            o_m_axis_tvalid=self.frames.sink.valid,
            i_m_axis_tready=self.frames.sink.ready,
            o_m_axis_tlast=self.frames.sink.last,
            i_wb_cyc=self.bus.cyc,
            i_wb_stb=self.bus.stb,
            i_wb_we=self.bus.we,
            i_wb_adr=self.bus.adr,
            i_wb_dat_w=self.bus.dat_w,
            i_wb_sel=self.bus.sel,
            o_wb_ack=self.bus.ack,
            o_wb_err=self.bus.err,
            o_wb_dat_r=self.bus.dat_r,
        )
        platform.add_source(str(folder / f"{top}.v"))
        # $readmemh reads them from the folder in which the tool runs.
        for name in self.manifest["files"]:
            if name.startswith(f"{top}__"):
                platform.add_source(str(folder / name), copy=True)


class Arbiter(LiteXModule):
    """What gives each array of a core of several arrays a stream of its own: a frame waits in it until it is whole, and frames go to the
    core in turn, so that a sender that stalls keeps no other waiting.

    - `sinks`: a taxel's code per beat of each array, 32 bits signed, row-major; `last` on a frame's last taxel.

    It drives `sink` of `core`. Raises `CoreError` for a core of one array.
    """

    def __init__(self, platform, core):
        name = core.manifest["core"].get("arbiter")
        if name is None:
            raise CoreError(f"{core.folder / 'manifest.json'}: no core.arbiter, and hardware.arrays = {core.arrays}; an arbiter is of several")
        self.sinks = sinks = [stream.Endpoint([("data", WORD_BITS)]) for _ in range(core.arrays)]

        # # #

        ready, keep = Signal(core.arrays), Signal(WORD_BITS // 8)
        self.comb += [sink.ready.eq(ready[array]) for array, sink in enumerate(sinks)]
        self.specials += Instance(
            name,
            i_aclk=ClockSignal(),
            i_aresetn=~ResetSignal(),
            i_s_axis_tdata=Cat(*(sink.data for sink in sinks)),
            i_s_axis_tvalid=Cat(*(sink.valid for sink in sinks)),
            o_s_axis_tready=ready,
            i_s_axis_tlast=Cat(*(sink.last for sink in sinks)),
            o_m_axis_tdata=core.sink.data,
            o_m_axis_tkeep=keep,
            o_m_axis_tid=core.sink.id,
            o_m_axis_tvalid=core.sink.valid,
            i_m_axis_tready=core.sink.ready,
            o_m_axis_tlast=core.sink.last,
        )
        platform.add_source(str(core.folder / f"{name}.v"))
