"""The notebook: its cells run one after the other, and its pictures show something."""

import json
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

NOTEBOOK = Path(__file__).parents[1] / "first-forces.ipynb"


def cells() -> list[str]:
    """The code of the notebook's cells."""
    notebook = json.loads(NOTEBOOK.read_text())
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run(sources: list[str]) -> dict[str, Any]:
    """Runs cells as a notebook does; a cell that fails is named."""
    names: dict[str, Any] = {}
    for number, source in enumerate(sources, 1):
        try:
            exec(compile(source, f"cell {number}", "exec"), names)
        except Exception as error:
            raise AssertionError(f"cell {number}: {error}") from error
    return names


def test_ten_cells_lead_from_a_scene_to_pictures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pictures: list[Path] = []

    def show() -> None:
        pictures.append(tmp_path / f"{len(pictures)}.png")
        plt.savefig(pictures[-1], dpi=50)
        plt.close("all")

    monkeypatch.setattr(plt, "show", show)
    sources = cells()
    assert len(sources) == 10
    names = run(sources)
    # Each picture has lines or areas of many colours, not an empty frame.
    assert len(pictures) == sum("plt.show()" in source for source in sources) == 5
    for picture in pictures:
        pixels = plt.imread(picture)[..., :3].reshape(-1, 3)
        assert len(np.unique((pixels * 15).astype(int), axis=0)) > 8, picture
    # What it shows: the true forces are within the error bars, the bound is below the error.
    off = np.abs(names["found"] - names["true"])
    assert (off < 4 * names["sigma"]).mean() > 0.9
    assert names["result"].error.tangential < 0.2
    assert all(row["found"]["median"] > 0.5 * row["bound_6"]["median"] for row in names["rows"])


def test_a_cell_that_fails_is_named() -> None:
    with pytest.raises(AssertionError, match="cell 2: name 'absent' is not defined"):
        run(["found = 1", "found = absent"])
