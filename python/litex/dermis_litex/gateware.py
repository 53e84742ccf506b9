"""Gateware of a board: a core behind gigabit Ethernet, without a processor.

Written into a folder: `board.v`, the core's files, the pins `board.lpf`, the script of Yosys `board.ys`, and `build_board.sh`,
which runs the tools once. With `--run` `dermis place` runs them. Pins and devices are those of `litex-boards`.
"""

import argparse
import shutil
import sys
from ipaddress import IPv4Address
from pathlib import Path
from typing import NamedTuple

from litex.gen import ClockDomain, LiteXModule
from litex.soc.cores.clock import ECP5PLL
from litex_boards.platforms import colorlight_i5, lambdaconcept_ecpix5
from liteeth.phy.ecp5rgmii import LiteEthPHYRGMII

from dermis_litex import route
from dermis_litex.core import WORD_BITS, CoreError, Dermis
from dermis_litex.network import IP_ADDRESS, MAC_ADDRESS, Network
from dermis_litex.packets import UDP_PORT
from dermis_litex.udp import DermisUDP

MAC_BYTES = 6
# Files and top module.
NAME = "board"
# How far the PLL's clock may be from the core's: `dermis place` refuses one that is further off.
CLOCK_MARGIN = 1e-3
# A word of the network comes in as many cycles of the PHY as it has bytes. The core's clock has room for twice as many: LiteEth
# spends some cycles on the headers of each packet.
LEAST_HZ = 2 * LiteEthPHYRGMII.rx_clk_freq * LiteEthPHYRGMII.dw / WORD_BITS
EXAMPLES = """examples:
  dermis build sensor-1 --bus wishbone --target-board python/litex/boards/colorlight-i9.toml --out ip/sensor-1
  python -m dermis_litex.gateware colorlight-i9 ip/sensor-1 build/sensor-1         Verilog, pins and scripts
  python -m dermis_litex.gateware colorlight-i9 ip/sensor-1 build/sensor-1 --run   bitstream and figures, half an hour a seed
  python -m dermis_litex.route build/*/gateware.json                               a table of figures
"""


class Board(NamedTuple):
    """What a board has: its platform, its clock and reset, and the delays of its RGMII in s."""

    platform: object
    clock: str
    clock_Hz: float
    reset_n: str
    delays: dict


# Delays that PHY and board have already are not added.
BOARDS = {
    "colorlight-i9": Board(
        lambda: colorlight_i5.Platform(board="i9", revision="7.2"), "clk25", 25e6, "cpu_reset_n", {"tx_delay": 0}
    ),
    "ecpix5-85f": Board(lambda: lambdaconcept_ecpix5.Platform(device="85F"), "clk100", 100e6, "rst_n", {"rx_delay": 0}),
}


class Clocks(LiteXModule):
    """The clock of core and network, from the board's.

    Raises `CoreError` if the PLL has no dividers for it.
    """

    def __init__(self, board, platform, clock_Hz):
        self.cd_sys = ClockDomain()
        self.pll = pll = ECP5PLL()
        self.comb += pll.reset.eq(~platform.request(board.reset_n))
        pll.register_clkin(platform.request(board.clock), board.clock_Hz)
        try:
            pll.create_clkout(self.cd_sys, clock_Hz, margin=CLOCK_MARGIN)
            pll.finalize()
        except (AssertionError, ValueError) as error:
            raise CoreError(
                f"clock_MHz = {clock_Hz / 1e6:g}: the PLL does not make it of {board.clock_Hz / 1e6:g} MHz; "
                "build the core with another"
            ) from error


class Gateware(LiteXModule):
    """A core behind the board's first Ethernet port, both with the clock for which the core was built.

    Raises `CoreError` for a core of another board, and for a clock that is too slow for the network or that no PLL makes.
    """

    def __init__(self, name, platform, folder, mac, ip, code_bytes, force_bits):
        board = BOARDS[name]
        self.core = Dermis(platform, folder)
        manifest = self.core.manifest
        if manifest["board"] != name:
            raise CoreError(
                f'{folder}/manifest.json: board = "{manifest["board"]}", not "{name}"; '
                f"write the folder with `dermis build SCENE --bus wishbone --target-board python/litex/boards/{name}.toml`"
            )
        clock_Hz = 1e6 * manifest["clock_MHz"]
        if clock_Hz < LEAST_HZ:
            raise CoreError(
                f"{folder}/manifest.json: clock_MHz = {clock_Hz / 1e6:g}; gigabit Ethernet needs at least {LEAST_HZ / 1e6:g}"
            )
        self.clocks = Clocks(board, platform, clock_Hz)
        self.phy = LiteEthPHYRGMII(platform.request("eth_clocks", 0), platform.request("eth", 0), **board.delays)
        self.network = Network(self.phy, mac, ip, clock_Hz)
        port = self.network.udp.crossbar.get_port(UDP_PORT, dw=WORD_BITS)
        self.udp = DermisUDP(self.core, port, code_bytes, force_bits)
        if self.udp.bus:
            self.comb += self.udp.bus.connect(self.core.bus)


def write(name, folder, out, mac=MAC_ADDRESS, ip=IP_ADDRESS, code_bytes=2, force_bits=WORD_BITS):
    """Writes the gateware of board `name` with the core of `folder` into the folder `out`.

    Returns what `route` needs: what the gateware is, and the arguments of `dermis place` for its device and clocks.

    Raises `CoreError` as `Gateware` and `DermisUDP` do.
    """
    if folder.resolve() == out.resolve():
        raise CoreError(f"out = {out}: the folder of the core, whose files are copied; take another one")
    platform = BOARDS[name].platform()
    gateware = Gateware(name, platform, folder, mac, ip, code_bytes, force_bits)
    manifest = gateware.core.manifest
    out.mkdir(parents=True, exist_ok=True)
    for index, (source, *kind) in enumerate(platform.sources):
        shutil.copy(source, out)
        platform.sources[index] = (Path(source).name, *kind)
    # Look-up tables that a slice's multiplexers join are placed as one: single ones come closer to their neighbours.
    platform.build(gateware, build_dir=str(out), build_name=NAME, run=False, nowidelut=True)
    family, size, speed, package = platform.toolchain.nextpnr_ecp5_parse_device(platform.device)
    size = platform.toolchain.nextpnr_ecp5_architectures[f"{family}-{size}"]
    # A part of the name of each clock's net, and the MHz that it must reach.
    clocks = {
        "core": f"pll_clkout:{manifest['clock_MHz']}",
        "Ethernet": f"eth_clocks0_rx:{gateware.phy.rx_clk_freq / 1e6}",
    }
    device = ["--family", "ecp5", "--size", size, "--package", package, "--speed-grade", speed]
    sensor = manifest["sensor"]
    design = {
        "board": name,
        "device": platform.device,
        "scene": manifest["scene"],
        "array": f"{sensor['rows']}×{sensor['cols']}",
        "lanes": manifest["sizes"]["lanes"],
        "force_bits": force_bits,
    }
    return design, device + [f"--clock={name}={clock}" for name, clock in clocks.items()]


def mac_address(text):
    """A MAC address as a number."""
    data = bytes.fromhex(text.replace(":", ""))
    if len(data) != MAC_BYTES:
        raise argparse.ArgumentTypeError(f"{text!r}: not {MAC_BYTES} bytes, as in 10:e2:d5:00:00:01")
    return int.from_bytes(data, "big")


def main():
    parser = argparse.ArgumentParser(
        prog="python -m dermis_litex.gateware",
        description="Put a core behind the gigabit Ethernet of a board",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("board", choices=BOARDS)
    parser.add_argument("core", type=Path, help="folder of `dermis build SCENE --bus wishbone`, for this board")
    parser.add_argument("out", type=Path, help="folder to write")
    parser.add_argument("--ip", type=IPv4Address, default=IP_ADDRESS, help="address of the board (%(default)s)")
    mac = MAC_ADDRESS.to_bytes(MAC_BYTES, "big").hex(":")
    parser.add_argument("--mac", type=mac_address, default=mac, help="its MAC address (%(default)s)")
    parser.add_argument("--code-bytes", type=int, choices=[2, 4], default=2, help="bytes of a code in a packet (%(default)s)")
    parser.add_argument("--force-bits", type=int, choices=[16, 32], default=32, help="bits of a force in a packet (%(default)s)")
    parser.add_argument("--run", action="store_true", help="run `dermis place`; write and print the figures")
    parser.add_argument("--seeds", help="most seeds to try until all clocks are reached, as of `dermis place`")
    parser.add_argument("--minutes", help="time limit of a tool's run, as of `dermis place`")
    options = parser.parse_args()
    try:
        design, arguments = write(
            options.board, options.core, options.out, options.mac, str(options.ip), options.code_bytes, options.force_bits
        )
        if not options.run:
            return
        limits = {"--seeds": options.seeds, "--minutes": options.minutes}
        arguments += [f"{option}={value}" for option, value in limits.items() if value is not None]
        figures = route.route(options.out / f"{NAME}.ys", design, arguments)
    except (CoreError, route.RouteError) as error:
        sys.exit(f"error: {error}")
    print(route.table([figures]))
    if not figures["is_met"]:
        sys.exit(f"error: missed with every seed: {', '.join(figures['missed'])}; logs in {options.out}")


if __name__ == "__main__":
    main()
