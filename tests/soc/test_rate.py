"""48x48 taxels behind LiteEth under Verilator, a frame every millisecond; with whole packets, which test_network.py shortens."""

from dermis_litex.packets import Results, frame_packets
from test_cores import NIGHTLY
from test_network import built, datagram, on_the_wire, payload_of

# Of 125 MHz in a millisecond; what separates two frames of Ethernet.
RATE_CYCLES, IDLE_BYTES = 125_000, 12


@NIGHTLY
def test_48_by_48_taxels_are_answered_at_a_sustained_kilohertz():
    frames, clock_Hz = 12, 62_500_000
    wire = built("wire-48", scene="sensor-4", clock_Hz=clock_Hz)
    assert len(wire.codes) == 48 * 48
    packets = lambda sequence: [on_the_wire(datagram(packet)) for packet in frame_packets(sequence, wire.codes, 4)]
    each = len(packets(0))
    # Each frame comes a millisecond after the one before, whatever has been answered.
    pause = RATE_CYCLES - sum(len(packet) + IDLE_BYTES for packet in packets(0))
    assert pause > 0
    played = [(0, 0 if at else pause, packet) for sequence in range(frames) for at, packet in enumerate(packets(sequence))]
    back, counters, cycles = wire.play_after_arp(played, each)
    host, ends, begins = Results(), [], []
    for time_ps, frame in back[2:]:
        if result := host.add(payload_of(frame)):
            assert result[:3] == (len(ends), wire.result, 0)
            ends.append(time_ps)
            begins.append(result.time)
    assert len(ends) == frames
    assert counters == {name: frames * each if name == "taken" else 0 for name in wire.counter_names}
    # Results come at the rate of the frames: none waits for longer than the one before. Behind the first frame the answer to the
    # core's question has come.
    periods = [(after - before) / 1e9 for before, after in zip(ends[1:], ends[2:])]
    assert all(abs(period - 1.0) < 0.01 for period in periods), periods
    # Frames begin at that rate by the core's own clock.
    periods = [(after - before) * 1000 / clock_Hz for before, after in zip(begins[1:], begins[2:])]
    assert all(abs(period - 1.0) < 0.001 for period in periods), periods
    assert cycles > (frames - 1) * clock_Hz // 1000
