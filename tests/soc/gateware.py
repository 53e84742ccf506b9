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


def write_verilog(module, pins, folder, name):
    """Writes `module` with these pins as `name` into a folder; all Verilog files of the design."""
    for pin, signal in pins.items():
        signal.name_override = pin
    text = str(verilog.convert(module, ios=set(pins.values()), name=name))
    # An event-driven simulator does not run `always @(*)` before an input changes: what is assigned begins undefined, until the
    # reset.
    assigned = set(re.findall(r"^\s+(\w+)\S* <= ", text, flags=re.MULTILINE))
    first = lambda declared: f"{declared[1]};" if declared[2] in assigned else declared[0]
    text = re.sub(r"^(reg [^=;]*?(\w+)) = [^;]*;", first, text, flags=re.MULTILINE)
    path = folder / f"{name}.v"
    path.write_text(text)
    return [path, *(source for source in module.platform.files if source.endswith(".v"))]
