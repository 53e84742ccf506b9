"""Two cores in one project: each reads its own memory files, in one folder, with FuseSoC and with LiteX; a program in C has the figures
of both."""

import json
import shutil
import subprocess

import pytest
from dermis_litex import Dermis
from gateware import Sources
from test_cores import BUILD, SCENE, generate
from test_fusesoc import fusesoc

THICKNESS_mm = {"thin": "3.0", "thick": "4.0"}
ROOT = BUILD / "two-cores"
SUFFIXES = ["codes", "words"]


def top(name):
    return f"dermis_{name}_wishbone"


@pytest.fixture(scope="session")
def cores():
    """Folders of two cores of one array under different covers, by their names."""
    shutil.rmtree(ROOT, ignore_errors=True)
    ROOT.mkdir(parents=True)
    text = SCENE.read_text(encoding="utf-8")
    for name, thickness in THICKNESS_mm.items():
        own = text.replace('name = "press"', f'name = "{name}"').replace("thickness_mm = 3.0", f"thickness_mm = {thickness}")
        scene = ROOT / f"{name}.toml"
        scene.write_text(own, encoding="utf-8")
        generate(ROOT / name, "--bus", "wishbone", "--stream-bits", "32", scene=scene)
    return {name: ROOT / name for name in THICKNESS_mm}


def passes(folder, name):
    """Whether the testbench of a core passes in a folder with the files of both; what it printed."""
    files = [f"{top(name)}.v", f"{top(name)}_tb.sv"]
    subprocess.run(["iverilog", "-g2012", "-o", f"{name}.vvp", *files], cwd=folder, check=True)
    done = subprocess.run(["vvp", "-n", f"{name}.vvp"], cwd=folder, capture_output=True, text=True)
    return done.returncode == 0 and "PASS" in done.stdout, done.stdout


def test_in_a_project_of_litex(cores, tmp_path):
    platform = Sources()
    for core in cores.values():
        Dermis(platform, core)
    # LiteX copies them into one folder, each under its name.
    names = [file.rpartition("/")[2] for file in platform.files]
    assert len(set(names)) == len(names) == 2 * len(cores)
    for file in platform.files:
        shutil.copy(file, tmp_path)
    for name, core in cores.items():
        for file in core.glob(f"{top(name)}_tb*"):
            shutil.copy(file, tmp_path)
        passed, output = passes(tmp_path, name)
        assert passed, output
    # The files of one, under the names of the other.
    for file in tmp_path.glob(f"{top('thin')}__*"):
        shutil.copy(file, tmp_path / file.name.replace(top("thin"), top("thick")))
    passed, output = passes(tmp_path, "thick")
    assert not passed and "missing, or not the file of this core" in output, output


PROJECT = """\
CAPI=2:
name: dermis:ip:two-cores:1
filesets:
  bench:
    depend: [{depend}]
    files:
{files}targets:
{targets}"""
TARGET = """\
  {name}:
    filesets: [bench]
    toplevel: {top}_tb
    flow: sim
    flow_options:
      tool: icarus
"""


def test_in_a_project_of_fusesoc(cores):
    files, targets = "", ""
    for name in cores:
        files += f"      - {name}/{top(name)}_tb.sv: {{file_type: systemVerilogSource}}\n"
        for suffix in SUFFIXES:
            vectors = f"{top(name)}_tb_{suffix}.hex"
            files += f"      - {name}/{vectors}: {{file_type: user, copyto: {vectors}}}\n"
        targets += TARGET.format(name=name, top=top(name))
    depend = ", ".join(f"dermis:ip:{top(name)}" for name in cores)
    (ROOT / "two.core").write_text(PROJECT.format(depend=depend, files=files, targets=targets), encoding="utf-8")
    for name in cores:
        passed, output = fusesoc(ROOT, "dermis:ip:two-cores", name)
        assert passed and "PASS" in output, output


PROGRAM = """\
#include <stdint.h>
#include <stdio.h>
#include "dermis_registers.h"
#include "{thin}.h"
#include "{thick}.h"

#define PRINT(name, value) printf("\\"%s\\": %.17g,\\n", name, (double)(value))

int main(void)
{{
    static const uint32_t status[DERMIS_STATUS_WORDS] = {{ {status} }};
{lines}    return 0;
}}
"""
# Of the core, and of its manifest or map.
FIGURES = {
    "FORCE_LSB_N": lambda manifest, _: manifest["output"]["force_lsb_N"],
    "FORCE_LSB_N_PER_MPA": lambda manifest, _: manifest["output"]["force_lsb_N_per_MPa"],
    "FULL_SCALE_MPA": lambda manifest, _: manifest["input"]["full_scale_MPa"],
    "FULL_SCALE_READINGS": lambda manifest, _: manifest["input"]["full_scale_readings"],
    "CODE_MAX": lambda manifest, _: 2 ** (manifest["input"]["bits"] - 1) - 1,
    "FORCE_TRIPLES": lambda _, constants: constants["force_triples"],
    "STATUS_TRIPLES": lambda _, constants: constants["status_triples"],
    "SCENE": lambda _, constants: constants["scene"],
}


def test_in_a_program_in_c(cores, tmp_path):
    read = lambda core, name: json.loads((core / name).read_text(encoding="utf-8"))
    manifests = {name: read(core, "manifest.json") for name, core in cores.items()}
    constants = {name: read(core, "registers.json")["constants"] for name, core in cores.items()}
    # The status at the end of a frame of the model, by the fields of the manifest and by the header.
    words = [int(word, 16) for word in (cores["thin"] / f"{top('thin')}_tb_words.hex").read_text().split()]
    fields = manifests["thin"]["output"]["status"]
    status = words[-9:]
    expected = {own["name"]: status[own["word"]] >> own["low"] & (1 << own["bits"]) - 1 for own in fields}
    lines = [
        f'    PRINT("{name}", (status[DERMIS_STATUS_{name.upper()}_WORD] & DERMIS_STATUS_{name.upper()}_MASK) '
        f">> DERMIS_STATUS_{name.upper()}_SHIFT);\n"
        for name in expected
    ]
    for core in cores:
        for figure, value in FIGURES.items():
            expected[f"{core} {figure}"] = value(manifests[core], constants[core])
            lines.append(f'    PRINT("{core} {figure}", {top(core).upper()}_{figure});\n')
    text = PROGRAM.format(thin=top("thin"), thick=top("thick"), status=", ".join(f"{word}u" for word in status), lines="".join(lines))
    (tmp_path / "main.c").write_text(text, encoding="utf-8")
    folders = [option for core in cores.values() for option in ("-I", core)]
    subprocess.run(["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", *folders, "-o", "main", "main.c"], cwd=tmp_path, check=True)
    printed = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    assert json.loads("{" + printed.rstrip(",\n") + "}") == expected
    assert expected["condition"] == 1 and expected["cycles"] > 100
    assert expected["thin SCENE"] != expected["thick SCENE"]
