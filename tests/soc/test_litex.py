"""A core in a LiteX SoC with a VexRiscv, in LiteX's simulation: the firmware sends frames and prints what comes back."""

import shutil
import subprocess
import sys
from collections import defaultdict

import pytest
from dermis_litex import CoreError, DermisDMA
from dermis_litex.core import read_manifest
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
    memory = out / "coefficients.hex"
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
