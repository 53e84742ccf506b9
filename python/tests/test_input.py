"""Bad input: an InputError that names field and value."""

from pathlib import Path

import numpy as np
import pytest

import dermis

SCENE = dermis.Scene.from_name("eight-by-eight")
FLAT = np.zeros((8, 8))
ROUND = {"shape": "hertz-circle", "size_mm": [3], "normal_N": 2}


def with_value(value: float) -> np.ndarray:
    stress = FLAT.copy()
    stress[1, 2] = value
    return stress


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SCENE.reconstruct(np.zeros((3, 4))), "frames has shape (3, 4), scene eight-by-eight wants (8, 8) or (time, 8, 8)"),
        (lambda: SCENE.reconstruct(np.zeros(64)), "frames has shape (64,)"),
        (lambda: SCENE.reconstruct(np.zeros((1, 1, 8, 8))), "frames has shape (1, 1, 8, 8)"),
        (lambda: SCENE.reconstruct(with_value(-np.inf)), "frame: stress_MPa[10] = -inf is not a finite number"),
        (
            lambda: SCENE.reconstruct(np.where(np.arange(64).reshape(8, 8) < 13, np.nan, 0.1)),
            "frame: 13 of 64 readings are missing, wanted at most 12 (input.missing_share = 0.2)",
        ),
        (lambda: SCENE.reconstruct([[None] * 7 + ["x"]] * 8), "frames has values of type object, wanted real numbers"),
        (lambda: SCENE.reconstruct(np.stack([FLAT, with_value(np.inf)])), "frame 1: stress_MPa[10] = inf is not a finite"),
        (lambda: SCENE.reconstruct(FLAT.astype(complex)), "frames has values of type complex128, wanted real numbers"),
        (lambda: SCENE.reconstruct([[1, 2], [3]]), "frames: "),
        (lambda: SCENE.reconstruct("sensor-1"), "frames has values of type <U8, wanted real numbers"),
        (lambda: SCENE.reconstruct([*SCENE.frames[:1], FLAT]), "frames[1] is not a Frame"),
        (lambda: SCENE.reconstruct(dermis.Scene.from_name("sensor-1").frames[0]), "disagree: the frame's sensor is"),
        (lambda: SCENE.reconstruct(FLAT, "rtl"), 'engine = "rtl" is not allowed; it must be "golden" or "fixed"'),
        (lambda: dermis.Scene.from_name("sensor1"), 'did you mean "sensor-1"?'),
        (lambda: dermis.Scene.from_toml("[sensor]\nrows = 1\n", "pad.toml"), "pad.toml: sensor.rows = 1 is not allowed"),
        (lambda: dermis.Scene.from_toml("rows = 1"), "scene.toml: unknown field rows"),
        (lambda: dermis.Frame.load("absent.json"), "absent.json: cannot be read"),
        (lambda: SCENE.load_frames(Path("absent.csv")), "absent.csv: cannot be read"),
        (lambda: SCENE.generate(), "no contact given"),
        (lambda: SCENE.generate([ROUND | {"weight": 3}]), 'contact 0: unknown key "weight"; known: shape, centre_mm'),
        (lambda: SCENE.generate([ROUND, ROUND | {"normal_N": "2"}]), "contact 1: normal_N = '2' is not a number"),
        (lambda: SCENE.generate([ROUND | {"centre_mm": [1]}]), "contact 0: centre_mm has shape (1,), wanted (2,)"),
        (lambda: SCENE.generate([ROUND | {"normal_N": -1}]), "contact 0: normal_N = -1 is not allowed"),
        (lambda: SCENE.generate([3]), "contact 0: wanted a dictionary"),
        (lambda: SCENE.generate(3), "contacts: wanted a list of dictionaries"),
        (lambda: SCENE.generate([ROUND], noise=-1), "noise = -1 is not allowed"),
        (lambda: SCENE.generate([ROUND], seed=-1), "seed = -1 is not allowed; it must be a whole number of at least 0"),
        (lambda: SCENE.generate([ROUND], dead=[(0, 8)]), "dead: taxel 0,8 is outside the array"),
        (lambda: SCENE.generate([ROUND], shapes="round"), 'shapes = "round" is not allowed'),
        (lambda: dermis.errors([1, 2], [1, 2, 3]), "reference_N has shape (2,), wanted (3,)"),
        (lambda: dermis.errors([1, 2, 3], [1, 2, np.nan]), "value_N[2] = NaN is not a finite number"),
    ],
)
def test_the_message_names_field_and_value(call, message: str) -> None:
    with pytest.raises(dermis.InputError) as error:
        call()
    assert message in str(error.value)
    assert isinstance(error.value, ValueError)


def test_arguments_of_another_type_are_named() -> None:
    with pytest.raises(TypeError, match="noise"):
        SCENE.generate([ROUND], noise="loud")
    with pytest.raises(TypeError, match="estimator"):
        SCENE.reconstruct(FLAT, estimator="search")
