"""A Dermis core in a LiteX SoC.

`add_dermis` puts a core into a SoC, with its registers on the SoC's bus and a DMA channel in each direction. `Dermis` is the
core alone, with LiteX streams; `Arbiter` gives each of its arrays a stream of its own; `DermisUDP` puts it behind a UDP port of LiteEth.
All take a folder that `dermis build SCENE --bus wishbone --stream-bits 32` has written.
"""

from dermis_litex.core import Arbiter, CoreError, Dermis
from dermis_litex.soc import DermisDMA, add_dermis
from dermis_litex.udp import DermisUDP

__all__ = ["Arbiter", "CoreError", "Dermis", "DermisDMA", "DermisUDP", "add_dermis"]
