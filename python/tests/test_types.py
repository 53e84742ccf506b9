"""The stubs say what the module has, and a type checker takes right code and refuses wrong code."""

import doctest
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import dermis
from conftest import ROOT

PACKAGE = Path(dermis.__file__).parent

RIGHT = """
import numpy as np
import dermis

scene = dermis.Scene.from_name("sensor-1")
one: dermis.Reconstruction = scene.reconstruct(scene.frames[0])
many: dermis.Reconstructions = scene.reconstruct(scene.frames, engine="fixed")
forces: np.ndarray | None = many.forces_N
flags: list[list[str]] = many.flags
"""

WRONG = """
import dermis

scene = dermis.Scene.from_name("sensor-1")
scene.reconstruct(scene.frames[0], engine="rtl")
sigma: float = scene.reconstruct(scene.frames[0]).contacts[0].sigma_N[0]
"""


def run(*arguments: str, folder: Path) -> tuple[int, str]:
    done = subprocess.run([sys.executable, "-m", *arguments], cwd=folder, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def test_the_stubs_are_those_of_the_module(tmp_path: Path) -> None:
    # The stubs of NumPy take longer to read than everything else, and are not compared.
    # Without them Python's own modules look wrong; the checker reads those below.
    own = "[mypy-dermis.lerobot,dermis._xarray]\nignore_errors = True\n"
    (tmp_path / "mypy.ini").write_text("[mypy]\n[mypy-numpy.*]\nfollow_imports = skip\n" + own)
    stubtest = ("mypy.stubtest", "--mypy-config-file", "mypy.ini", "dermis")
    code, text = run(*stubtest, folder=tmp_path)
    assert code == 0, text
    # A stub that lacks a property, and one whose default differs, are told.
    shutil.copytree(PACKAGE, tmp_path / "dermis")
    stub = tmp_path / "dermis" / "_dermis.pyi"
    whole = stub.read_text()
    changed = whole.replace("    @property\n    def id(self) -> str: ...\n", "").replace("seed: int = 1", "seed: int = 2")
    assert len(changed) < len(whole)
    stub.write_text(changed)
    code, text = run(*stubtest, folder=tmp_path)
    assert code == 1 and "dermis._dermis.Frame.id" in text and "seed" in text, text


def test_a_type_checker_knows_the_package(tmp_path: Path) -> None:
    (tmp_path / "right.py").write_text(RIGHT)
    (tmp_path / "wrong.py").write_text(WRONG)
    code, text = run("mypy", "--strict", "right.py", folder=tmp_path)
    assert code == 0, text
    code, text = run("mypy", "--strict", "-m", "dermis.lerobot", "-m", "dermis._xarray", folder=tmp_path)
    assert code == 0 and "2 source files" in text, text
    code, text = run("mypy", "--strict", "wrong.py", folder=tmp_path)
    # The engine; contacts and sigma_N that may be None.
    assert code == 1 and text.count("error:") >= 3 and "engine: Literal['golden', 'fixed']" in text, text


def test_everything_is_documented() -> None:
    for name in dermis.__all__:
        item = getattr(dermis, name)
        assert item.__doc__, name
        for member, value in vars(item).items() if isinstance(item, type) else ():
            assert member.startswith("_") or value.__doc__, f"{name}.{member}"


def tried(text: str, name: str) -> tuple[int, int]:
    """Examples of a text that failed, and all of them."""
    options = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    # The mark of the guide for what is left out.
    test = doctest.DocTestParser().get_doctest(text.replace("…", "..."), {}, name, name, 0)
    results = doctest.DocTestRunner(optionflags=options).run(test)
    return results.failed, results.attempted


@pytest.mark.parametrize(("name", "least"), [("python.md", 15), ("learning.md", 10)])
def test_the_examples_of_a_page_print_what_they_show(name: str, least: int) -> None:
    page = (ROOT / "docs" / name).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    failed, count = tried("\n".join(blocks), name)
    assert failed == 0 and count > least


def test_the_examples_of_the_package_print_what_they_show() -> None:
    assert tried(dermis.__doc__, "dermis")[0] == 0
    assert tried(">>> 1 + 1\n3\n", "wrong") == (1, 1)
