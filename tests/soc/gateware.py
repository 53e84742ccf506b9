"""Gateware of LiteX around a core, as Verilog for simulators."""

import re
import shutil
import subprocess

from dermis_litex import Arbiter, Dermis, DermisUDP
from dermis_litex.network import IP_ADDRESS, MAC_ADDRESS
from dermis_litex.network import Network as LiteEth
from dermis_litex.packets import UDP_PORT
from litex.gen import Cat, ClockDomain, LiteXModule, Signal
from litex.gen.fhdl import verilog
from litex.soc.interconnect import stream
from liteeth.common import eth_phy_description, eth_udp_user_description


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


def connect_tables(module):
    """Connects the packets of tables with the registers of the core."""
    if module.udp.bus:
        module.comb += module.udp.bus.connect(module.core.bus)


class Packets(LiteXModule):
    """A core between the two directions of a UDP port."""

    def __init__(self, folder, code_bytes):
        self.cd_sys = ClockDomain()
        self.platform, self.port = Sources(), Port()
        self.core = Dermis(self.platform, folder)
        self.udp = DermisUDP(self.core, self.port, code_bytes)
        connect_tables(self)

    def pins(self):
        return {"sys_clk": self.cd_sys.clk, "sys_rst": self.cd_sys.rst} | {
            f"{end}_{signal.backtrace[-1][0].removeprefix('payload_').removeprefix('param_')}": signal
            for end in ("source", "sink")
            for signal in getattr(self.port, end).flatten()
        }


class BehindArbiter(LiteXModule):
    """A core behind its arbiter, with the pins of an AXI4-Stream for each array and for the results, and those of Wishbone."""

    def __init__(self, folder):
        self.cd_sys = ClockDomain()
        self.platform, self.reset_n = Sources(), Signal()
        self.core = Dermis(self.platform, folder)
        self.arbiter = Arbiter(self.platform, self.core)
        self.comb += self.cd_sys.rst.eq(~self.reset_n)

    def pins(self):
        ends = {f"s{array}_axis": (sink, ["data"]) for array, sink in enumerate(self.arbiter.sinks)}
        ends["m_axis"] = self.core.source, ["data", "keep", "user", "id"]
        streams = {
            f"{prefix}_t{name}": getattr(end, name) for prefix, (end, own) in ends.items() for name in ["valid", "ready", "last", *own]
        }
        bus = {f"wb_{name}": getattr(self.core.bus, name) for name in "cyc stb we adr dat_w sel ack err dat_r".split()}
        return {"aclk": self.cd_sys.clk, "aresetn": self.reset_n} | streams | bus


class Phy(LiteXModule):
    """In the place of a PHY of LiteEth: a byte per cycle in each direction."""

    dw = 8

    def __init__(self):
        self.sink, self.source = [stream.Endpoint(eth_phy_description(self.dw)) for _ in range(2)]
        self.comb += self.sink.ready.eq(1)


class Network(LiteXModule):
    """A core behind LiteEth, from the bytes of the PHY on."""

    def __init__(self, folder, code_bytes, force_bits, clock_Hz):
        self.cd_sys = ClockDomain()
        self.cd_eth_rx = ClockDomain()
        self.cd_eth_tx = ClockDomain()
        self.rst = Signal()
        self.platform, self.phy = Sources(), Phy()
        self.core = Dermis(self.platform, folder)
        self.network = LiteEth(self.phy, MAC_ADDRESS, IP_ADDRESS, clock_Hz)
        self.udp = DermisUDP(self.core, self.network.udp.crossbar.get_port(UDP_PORT, dw=32), code_bytes, force_bits)
        connect_tables(self)
        counters = self.udp.receiver.counters
        self.counter_names = list(counters)
        self.counters = Signal(32 * len(counters))
        self.comb += [
            *(domain.rst.eq(self.rst) for domain in (self.cd_sys, self.cd_eth_rx, self.cd_eth_tx)),
            self.counters.eq(Cat(*counters.values())),
        ]

    def pins(self):
        clocks = {f"{name}_clk": getattr(self, f"cd_{name}").clk for name in ("sys", "eth_rx", "eth_tx")}
        wires = {
            f"{side}_{name}": getattr(end, name)
            for side, end in (("rx", self.phy.source), ("tx", self.phy.sink))
            for name in ("valid", "data", "last")
        }
        return clocks | wires | {"rst": self.rst, "counters": self.counters}


def as_verilog(module, pins, name):
    """The Verilog of `module` with these pins."""
    for pin, signal in pins.items():
        signal.name_override = pin
    return str(verilog.convert(module, ios=set(pins.values()), name=name))


def engine_sources(module):
    return [source for source in module.platform.files if source.endswith(".v")]


def verilate(module, pins, folder, name, driver, optimisation):
    """The simulation of `module` that the C++ of `driver` drives, in a folder with its memory files."""
    work = folder / "verilated"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    (work / f"{name}.v").write_text(as_verilog(module, pins, name))
    for memory in folder.glob("*.hex"):
        shutil.copy(memory, work)
    # What LiteX writes is not free of lint.
    options = ["--cc", "--exe", "--build", "-Wno-lint", "-Wno-style", "-Wno-UNOPTFLAT", "-Wno-fatal", "--top-module", name]
    options += ["-CFLAGS", f"-std=c++17 {optimisation}", "--Mdir", "."]
    sources = [f"{name}.v", *engine_sources(module), str(driver)]
    done = subprocess.run(["verilator", *options, *sources], cwd=work, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return work / f"V{name}"


def changing_once(text):
    """Verilog in which `always @(*)` changes what it assigns once each time that it runs.

    LiteX assigns a default first. Two blocks that assign `valid` and `ready` to each other would so wake each other for ever.
    """
    names = set()

    def block(found):
        assigned = {}

        def to_next(line):
            assigned.update(dict.fromkeys(re.findall(r"(?<!\w)[A-Za-z_]\w*", line[2])))
            return line[1] + re.sub(r"(?<!\w)([A-Za-z_]\w*)", r"next_\1", line[2]) + " = "

        body = re.sub(r"^(\s+)([\w{}, \[\]:]+) <= ", to_next, found[1], flags=re.MULTILINE)
        names.update(assigned)
        return "always @(*) begin\n" + body + "".join(f"    {name} <= next_{name};\n" for name in assigned) + "end\n"

    text = re.sub(r"^always @\(\*\) begin\n(.*?)^end\n", block, text, flags=re.MULTILINE | re.DOTALL)
    register = r"^\s*(?:output )?reg\s+((?:signed)?\s*(?:\[[^\]]*\])?)\s*(\w+)"
    widths = {name: width for width, name in re.findall(register, text, flags=re.MULTILINE)}
    declared = "".join(f"reg {widths[name]} next_{name};\n" for name in sorted(names))
    return text.replace(");\n", f");\n{declared}", 1)


def write_verilog(module, pins, folder, name):
    """Writes `module` with these pins as `name` into a folder, for an event-driven simulator; all Verilog files of the design."""
    text = as_verilog(module, pins, name)
    # An event-driven simulator does not run `always @(*)` before an input changes: what is assigned begins undefined, until the
    # reset.
    assigned = set(re.findall(r"^\s+(\w+)\S* <= ", text, flags=re.MULTILINE))
    first = lambda declared: f"{declared[1]};" if declared[2] in assigned else declared[0]
    text = re.sub(r"^(reg [^=;]*?(\w+)) = [^;]*;", first, text, flags=re.MULTILINE)
    text = changing_once(text)
    path = folder / f"{name}.v"
    path.write_text(text)
    return [path, *engine_sources(module)]
