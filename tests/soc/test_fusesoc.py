"""Runs the targets of the generated FuseSoC core files: testbench, lint, synthesis."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from test_cores import BUILD, HERE, NIGHTLY, SCENE, generate

FUSESOC = Path(sys.executable).with_name("fusesoc")
CONTACTS = HERE.parents[1] / "golden/scenes/eight-by-eight-contacts.toml"


def fusesoc(root, core, target):
    """Runs a target of the core in folder `root`; whether it passed, and what it printed."""
    work = root / "work" / target
    command = [FUSESOC, "--cores-root", root, "run", "--work-root", work, "--target", target, core]
    # FuseSoC finds no other cores than those of the root.
    environment = {**os.environ, "XDG_CONFIG_HOME": str(BUILD)}
    done = subprocess.run(command, capture_output=True, text=True, cwd=BUILD, env=environment)
    return done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="session", params=["engine", "axi", "wishbone"])
def core(request):
    """Folder and name of a generated core."""
    return generated(request.param, SCENE)


def generated(form, scene):
    """Folder and name of the engine of a scene, or of its core for the bus `form`."""
    bus = [] if form == "engine" else ["--bus", form, "--stream-bits", "64"]
    suffix = f"_{form}" if bus else ""
    folder = BUILD / "fusesoc" / f"{scene.stem}{suffix}"
    generate(folder, *bus, scene=scene)
    return folder, f"dermis:ip:dermis_{scene.stem.replace('-', '_')}{suffix}"


def test_sim(core):
    passed, output = fusesoc(*core, "sim")
    assert passed and "PASS" in output, output


def test_sim_with_labels_of_contacts():
    passed, output = fusesoc(*generated("axi", CONTACTS), "sim")
    assert passed and "PASS" in output, output


def test_lint(core):
    passed, output = fusesoc(*core, "lint")
    assert passed, output


@pytest.mark.parametrize("form", [pytest.param("engine", marks=NIGHTLY), "axi"])
def test_synth(form):
    passed, output = fusesoc(*generated(form, HERE / "still.toml"), "synth")
    assert passed, output


def test_sim_finds_a_wrong_word(core, tmp_path):
    folder, name = core
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("work"))
    vectors = next(path for path in tmp_path.glob("*_tb_*.hex") if "codes" not in path.name)
    words = vectors.read_text(encoding="utf-8").splitlines()
    words[5] = words[5][:-1] + ("0" if words[5][-1] != "0" else "1")
    vectors.write_text("\n".join(words), encoding="utf-8")
    passed, output = fusesoc(tmp_path, name, "sim")
    assert "expected" in output and "PASS" not in output, output
    assert not passed, output
