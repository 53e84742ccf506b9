"""The core in a SoC, between two DMA channels."""

from litex.gen import LiteXModule
from litex.soc.cores.dma import WishboneDMAReader, WishboneDMAWriter
from litex.soc.integration.soc import SoCRegion
from litex.soc.interconnect import wishbone
from litex.soc.interconnect.csr import CSRStorage

from dermis_litex.core import Dermis, require_width


class DermisDMA(LiteXModule):
    """A core between memory and memory; one transfer of each channel per frame.

    | CSR | meaning |
    |---|---|
    | `reader_base`, `reader_length`, `reader_enable`, `reader_done` | codes: a word of 32 bits per taxel, row-major |
    | `writer_base`, `writer_length`, `writer_enable`, `writer_done` | results: `words` words of 32 bits |
    | `id` | identifier of the frames to come |

    Lengths are in bytes; words have the byte order of the bus. Clear `enable` before a channel's next transfer. A processor
    with a data cache must not read results that it has cached.
    """

    def __init__(self, core, bus_data_width, bus_adr_width):
        require_width(core, bus_data_width)
        interface = lambda: wishbone.Interface(data_width=bus_data_width, adr_width=bus_adr_width)
        # "big" is LiteX's name for words as they are.
        self.reader = WishboneDMAReader(interface(), endianness="big", with_csr=True)
        self.writer = WishboneDMAWriter(interface(), endianness="big")
        # Results that come without a transfer wait.
        self.writer.add_ctrl(ready_on_idle=0)
        self.writer.add_csr()
        self.id = CSRStorage(len(core.sink.id), description="Identifier of the frames to come.")

        # # #

        taken = {"valid", "ready", "last", "data"}
        self.comb += [
            self.reader.source.connect(core.sink, keep=taken),
            core.sink.id.eq(self.id.storage),
            core.source.connect(self.writer.sink, keep=taken),
        ]


def add_dermis(soc, folder, name="dermis", origin=None):
    """Adds the core of `folder` to `soc` and returns it.

    Its registers are memory region `name`, from `origin` on if given; its DMA channels are masters of the SoC's bus, or of its
    DMA bus, and have the CSRs `name`_dma_* of `DermisDMA`.
    """
    core = Dermis(soc.platform, folder)
    dma_bus = getattr(soc, "dma_bus", soc.bus)
    dma = DermisDMA(core, dma_bus.data_width, dma_bus.get_address_width(standard="wishbone"))
    soc.add_module(name, core)
    soc.add_module(f"{name}_dma", dma)
    soc.bus.add_slave(name, core.bus, SoCRegion(origin=origin, size=0x100, cached=False))
    dma_bus.add_master(f"{name}_reader", master=dma.reader.bus)
    dma_bus.add_master(f"{name}_writer", master=dma.writer.bus)
    return core
