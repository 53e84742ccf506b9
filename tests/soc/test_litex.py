"""A core in a LiteX SoC with a VexRiscv, in LiteX's simulation: the firmware sends frames and prints what comes back."""

import shutil
import subprocess
import sys
from collections import defaultdict

import pytest
from dermis_litex import CoreError, DermisDMA
from dermis_litex.core import WholeFrames, read_manifest
from migen import passive, run_simulation
from test_cores import BUILD, HERE, NIGHTLY, SCENE, generate

FRAMING, CLIPPED = 4, 1


def generated(scene):
    """Folder of the core of a scene."""
    folder = BUILD / "litex" / getattr(scene, "stem", scene)
    generate(folder, "--bus", "wishbone", "--stream-bits", "32", scene=scene)
    return folder


def expected(core):
    """The words of the reconstruction in the core's testbench."""
    return next(core.glob("*_tb_words.hex")).read_text().split()


def printed(command, folder):
    """What the firmware printed: the values of each name."""
    done = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=1500)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    values = defaultdict(list)
    for line in done.stdout.splitlines():
        name, _, value = line.partition(" ")
        values[name].append(value)
    return values


def simulated(core, out):
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    return printed([sys.executable, HERE / "litex/soc.py", core, out], out)


def are_right(values, core):
    """A frame is right, also the one after a frame that ended early; errors are told and cleared; three were answered."""
    words = expected(core)
    assert values["id"] == ["4d524544"]
    assert values["right"] == words
    # It says in its status that one was cut short.
    changed = [(int(was, 16), int(now, 16)) for was, now in zip(words, values["after"], strict=True) if was != now]
    framing = read_manifest(core)["output"]["flags"]["framing"]
    assert changed and all(now == was | framing for was, now in changed), changed
    assert [int(error, 16) for error in values["errors"]] == [0, FRAMING, CLIPPED, 0]
    assert values["frames"] == ["00000003"]


def test_a_processor_sends_frames_and_reads_forces():
    core = generated(SCENE)
    out = BUILD / "litex/press-simulation"
    are_right(simulated(core, out), core)
    # The same simulation with another coefficient.
    memory = out / "dermis_press_wishbone__coefficients.hex"
    lines = memory.read_text().splitlines()
    lines[0] = "".join("1" if digit == "0" else "0" for digit in lines[0])
    memory.write_text("\n".join(lines) + "\n")
    assert printed([out / "obj_dir/Vsim"], out)["right"] != expected(core)


@NIGHTLY
def test_a_processor_reads_contacts():
    core = generated("eight-by-eight-contacts")
    are_right(simulated(core, BUILD / "litex/contacts-simulation"), core)


@pytest.mark.parametrize("bus, message", [([], "core.bus = null"), (["--bus", "axi"], 'core.bus = "axi", not "wishbone"')])
def test_another_folder_is_refused(tmp_path, bus, message):
    generate(tmp_path, *bus)
    with pytest.raises(CoreError, match=message):
        read_manifest(tmp_path)


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(CoreError, match="manifest.json: .*; write the folder with"):
        read_manifest(tmp_path)


def test_another_width_than_that_of_the_bus_is_refused():
    class Core:
        manifest = {"core": {"stream_bits": 64}}

    with pytest.raises(CoreError, match="core.stream_bits = 64, on a bus of 32 bits; .* --stream-bits 32"):
        DermisDMA(Core(), 32, 30)


@pytest.mark.parametrize("words", [1, 2, 4])
def test_a_result_that_ends_early_is_filled_up(words):
    """Whole results of 9 words, and one of which a reset left 6: two of a triple, one of zeros."""
    count, short = 9, 6
    frames = [(1, count), (2, short), (3, count)]
    whole = WholeFrames(words, count)
    got = []

    @passive
    def receive():
        source = whole.source
        step = 0
        while True:
            step += 1
            yield source.ready.eq(step % 3 > 0)
            yield
            if (yield source.valid) and (yield source.ready):
                beat = []
                for pin in (source.data, source.keep, source.user, source.id, source.last):
                    beat.append((yield pin))
                got.append(beat)

    def send():
        sink = whole.sink
        for identifier, length in frames:
            for at in range(0, length, words):
                there = min(words, length - at)
                data = sum((at + word + 1) << 32 * word for word in range(there))
                values = (data, 2 ** (4 * there) - 1, 0, identifier, at + words >= length, 1)
                pins = (sink.data, sink.keep, sink.user, sink.id, sink.last, sink.valid)
                for pin, value in zip(pins, values, strict=True):
                    yield pin.eq(value)
                yield
                while not (yield sink.ready):
                    yield
            yield sink.valid.eq(0)
        for _ in range(40):
            yield

    run_simulation(whole, [send(), receive()])
    beats = -(-count // words)
    assert len(got) == len(frames) * beats
    for (identifier, length), own in zip(frames, [got[at : at + beats] for at in range(0, len(got), beats)], strict=True):
        assert [beat[4] for beat in own] == [0] * (beats - 1) + [1]
        assert {beat[3] for beat in own} == {identifier}
        kept = [beat[0] >> 32 * word & 0xFFFFFFFF for beat in own for word in range(words) if beat[1] >> 4 * word & 1]
        assert kept == list(range(1, length + 1)) + [0] * (count - length)
        filled = own[-(-length // words) :]
        assert all(beat[2] == 2 ** (words + 1) - 1 for beat in filled)
        assert all(beat[2] == 0 for beat in own[: len(own) - len(filled)])
