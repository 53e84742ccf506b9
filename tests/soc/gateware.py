"""Gateware of LiteX around a core, as Verilog for an event-driven simulator."""

import re

from dermis_litex import Dermis, DermisUDP
from litex.gen import ClockDomain, LiteXModule
from litex.gen.fhdl import verilog
from litex.soc.interconnect import stream
from liteeth.common import eth_udp_user_description


class Sources:
    """In the place of a LiteX platform: the files that a core adds."""

    def __init__(self):
        self.files = []

    def add_source(self, name, copy=False):
        self.files.append(name)


class Port:
    """In the place of a UDP port of LiteEth."""

    def __init__(self):
        self.sink, self.source = [stream.Endpoint(eth_udp_user_description(32)) for _ in range(2)]


class Packets(LiteXModule):
    """A core between the two directions of a UDP port."""

    def __init__(self, folder, code_bytes):
        self.cd_sys = ClockDomain()
        self.platform, self.port = Sources(), Port()
        self.core = Dermis(self.platform, folder)
        self.udp = DermisUDP(self.core, self.port, code_bytes)

    def pins(self):
        return {"sys_clk": self.cd_sys.clk, "sys_rst": self.cd_sys.rst} | {
            f"{end}_{signal.backtrace[-1][0].removeprefix('payload_').removeprefix('param_')}": signal
            for end in ("source", "sink")
            for signal in getattr(self.port, end).flatten()
        }


def event_driven(text):
    """Verilog of LiteX for an event-driven simulator: LiteX writes for those that sort logic by its dependences.

    A combinational block assigns a default and then its exceptions, each of which wakes the blocks that read it, and two such
    blocks wake one another for ever: here a block assigns each of its values once. `always @(*)` does not run before an input
    changes, so registers have their first value from 1 ns on, and what follows from them has none.
    """
    widths = {name: width for width, name in re.findall(r"^ *(?:output )?reg +(\[[^\]]*\])? *(\w+)", text, flags=re.MULTILINE)}
    assigned = set(re.findall(r"^\s+(\w+)\S* <= ", text, flags=re.MULTILINE))
    held = []

    def once(block):
        names = sorted(set(re.findall(r"^\s+(\w+)\S* <= ", block[0], flags=re.MULTILINE)))
        held.extend(f"reg {widths[name]} next_{name};" for name in names)
        body = re.sub(r"^(\s+)(\w+\S*) <= ", r"\1next_\2 = ", block[0].removesuffix("end"), flags=re.MULTILINE)
        return body + "".join(f"    {name} = next_{name};\n" for name in names) + "end"

    text = re.sub(r"^always @\(\*\) begin$.*?^end$", once, text, flags=re.MULTILINE | re.DOTALL)

    def first(declared):
        declaration, name, value = declared.groups()
        if name not in assigned:
            return declared[0]
        return f"{declaration};" if f"reg {widths[name]} next_{name};" in held else f"{declaration}; initial #1 {name} = {value};"

    text = re.sub(r"^(reg [^=;]*?(\w+)) = ([^;]*);", first, text, flags=re.MULTILINE)
    head, logic = text.split("always @(*)", 1)
    return head + "\n".join(held) + "\nalways @(*)" + logic


def write_verilog(module, pins, folder, name):
    """Writes `module` with these pins as `name` into a folder; all Verilog files of the design."""
    for pin, signal in pins.items():
        signal.name_override = pin
    text = event_driven(str(verilog.convert(module, ios=set(pins.values()), name=name)))
    path = folder / f"{name}.v"
    path.write_text(text)
    return [path, *(source for source in module.platform.files if source.endswith(".v"))]
