"""LiteEth with words of 32 bits, and registers where its longest paths are: on an ECP5 at gigabit it is too slow without them.

The `ready` of LiteEth's streams passes through all stages within a cycle: from the gap between frames to the FIFO of what is
sent, from the CRC to the preamble of what is received, and from the buffer of pings to the FIFO of what is received.
"""

from types import SimpleNamespace

from litex.gen import ClockDomainsRenamer, LiteXModule
from litex.soc.interconnect import stream
from liteeth.common import eth_phy_description, icmp_protocol
from liteeth.core import LiteEthUDPIPCore
from liteeth.core.icmp import LiteEthICMP
from liteeth.mac.crc import LiteEthMACCRC32Checker, LiteEthMACCRC32Inserter
from liteeth.mac.last_be import LiteEthMACRXLastBE
from liteeth.mac.padding import LiteEthMACPaddingInserter

from dermis_litex.core import WORD_BITS

# Words between the clocks, of what is sent: distributed RAM has 16 in a cell, so that nothing selects among several.
SENT_WORDS = 16
# Of a core, if nothing else is said.
MAC_ADDRESS, IP_ADDRESS = 0x10E2D5000001, "192.168.1.50"


def buffer(layout):
    """A stage that cuts the paths of data and of `ready`."""
    return stream.Buffer(layout, pipe_valid=True, pipe_ready=True)


class Ping(LiteXModule):
    """Answers pings; what it receives is buffered."""

    def __init__(self, ip, ip_address):
        port = ip.crossbar.get_port(icmp_protocol, WORD_BITS)
        self.buffer = buffer(port.source.description)
        self.comb += port.source.connect(self.buffer.sink)
        # LiteEth asks the crossbar for its port itself.
        buffered = SimpleNamespace(sink=port.sink, source=self.buffer.source)
        crossbar = SimpleNamespace(get_port=lambda protocol, bits: buffered)
        self.icmp = LiteEthICMP(SimpleNamespace(crossbar=crossbar), ip_address, WORD_BITS)


class Network(LiteXModule):
    """MAC, ARP, IP, ping and UDP of LiteEth behind `phy`; `udp.crossbar.get_port` gives ports."""

    def __init__(self, phy, mac_address, ip_address, clock_Hz):
        self.core = core = LiteEthUDPIPCore(
            phy, mac_address, ip_address, clock_Hz, dw=WORD_BITS, with_icmp=False, tx_cdc_depth=SENT_WORDS
        )
        self.ping = Ping(core.ip, ip_address)
        self.udp = core.udp
        sent, received = (getattr(core.mac.core, name).pipeline for name in ("tx_datapath", "rx_datapath"))
        # The FIFO reads on a register's `ready`.
        self.cut(sent, stream.StrideConverter, "eth_tx", WORD_BITS, stream.PipeReady)
        self.cut(sent, LiteEthMACPaddingInserter, "eth_tx", phy.dw)
        self.cut(sent, LiteEthMACCRC32Inserter, "eth_tx", phy.dw)
        self.cut(received, LiteEthMACCRC32Checker, "eth_rx", phy.dw, stream.PipeReady)
        self.cut(received, LiteEthMACRXLastBE, "eth_rx", phy.dw)
        self.cut(received, stream.Endpoint, "sys", WORD_BITS)

    def cut(self, stages, kind, domain, bits, register=buffer):
        """Puts a register before the only stage of a kind; LiteEth connects the stages when it is finalised."""
        (place,) = (at for at, stage in enumerate(stages) if isinstance(stage, kind))
        stage = ClockDomainsRenamer(domain)(register(eth_phy_description(bits)))
        self.submodules += stage
        stages.insert(place, stage)
