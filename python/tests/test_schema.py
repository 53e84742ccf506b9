"""What `dermis schema` prints, as another reader takes it: the package jsonschema."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from conftest import ROOT, dermis


def validator(what: str) -> jsonschema.Draft202012Validator:
    schema = json.loads(dermis("schema", what))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_scenes_are_valid_and_wrong_ones_are_not() -> None:
    scenes = validator("scene")
    files = sorted((ROOT / "golden" / "scenes").glob("*.toml"))
    everything = ROOT / "tests" / "corpus" / "scene" / "everything.toml"
    assert len(files) > 9
    for file in [*files, everything]:
        scenes.validate(tomllib.loads(file.read_text()))
    sensor = "[sensor]\nrows = 4\ncols = 4\npitch_x_mm = 2\npitch_y_mm = 2\nthickness_mm = 2\n"
    scenes.validate(tomllib.loads(sensor))
    wrong = [
        ("", "'sensor' is a required property"),
        (sensor.replace("cols = 4\n", ""), "'cols' is a required property"),
        (sensor.replace("rows = 4", "rows = 1"), "1 is less than the minimum of 2"),
        (sensor + "[search]\nmu_maks = 1", "'mu_maks' was unexpected"),
        (sensor + "[search]\nmu_max = 0.0001", "is not valid under any of the given schemas"),
        (sensor + "[fixed]\nlanes = 6", "6 is not a multiple of 4"),
        (sensor + '[search]\nestimator = "learned"', "'learned' is not one of"),
    ]
    for text, message in wrong:
        with pytest.raises(jsonschema.ValidationError, match=message):
            scenes.validate(tomllib.loads(text))


def test_frames_and_results_are_valid(tmp_path: Path) -> None:
    frames, results = validator("frame"), validator("result")
    files = sorted((ROOT / "golden" / "data" / "frames").rglob("*.json"))
    assert len(files) > 9
    for file in files:
        frames.validate(json.loads(file.read_text()))
    frames.validate({"stress_MPa": [0.1, None]})
    with pytest.raises(jsonschema.ValidationError, match="'stress_MPa' is a required property"):
        frames.validate({"id": "press"})
    frame = tmp_path / "gap.json"
    stress = [0.001 * k for k in range(100)]
    frame.write_text(json.dumps({"stress_MPa": [None, *stress[1:]]}))
    for scene, engine in (("sensor-1", "golden"), ("sensor-1", "fixed"), ("sensor-1-noisy", "golden")):
        result = json.loads(dermis("reconstruct", scene, "--json", "--frame", str(frame), "--engine", engine))
        results.validate(result)
        assert set(result) <= set(results.schema["properties"]), (scene, engine)
