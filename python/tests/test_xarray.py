"""Datasets of xarray: values, coordinates, units; as files and back; without xarray a clear error."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

import dermis

SCENE = dermis.Scene.from_name("sensor-1-noisy")
TIMES = [1732770000020000003 + 10_000_000 * k for k in range(4)]


def frames(count: int = 4) -> list[dermis.Frame]:
    return [SCENE.generate(random=1, seed=k, noise=0.002, id=f"press {k}") for k in range(count)]


def test_results_have_coordinates_units_and_times() -> None:
    results = SCENE.reconstruct(frames(), times_ns=TIMES)
    data = results.to_xarray()
    assert data.sizes["time"] == 4 and data.force.dims == ("time", "row", "col", "axis")
    assert (data.force.values == results.forces_N).all() and data.force.units == "N"
    assert (data.resultant.values == results.resultant_N).all()
    assert np.array_equal(data.resultant_sigma.values, results.sigma_N, equal_nan=True)
    assert data.time.values.tolist() == TIMES and data.time.units == "ns"
    assert data.frame.values.tolist() == ["press 0", "press 1", "press 2", "press 3"]
    assert data.attrs == {"scene": "sensor-1-noisy", "engine": "golden"}
    places = SCENE.positions_mm
    assert (data.x_mm.values == places[0, :, 0]).all() and (data.y_mm.values == places[:, 0, 1]).all()
    assert data.x_mm.units == data.y_mm.units == data.contact_centre.units == "mm"
    assert data.moment.units == "N mm" and (data.moment.values[2] == results[2].moment_Nmm).all()
    # By label, as xarray has it.
    assert data.force.sel(axis="z", row=3, col=4).values.tolist() == results.forces_N[:, 3, 4, 2].tolist()
    for time, result in enumerate(results):
        assert data.flags.isel(time=time).where(data.flags.isel(time=time), drop=True).flag.values.tolist() == result.flags
        assert data.contact_count.values[time] == len(result.contacts)
        for number, contact in enumerate(result.contacts):
            own = data.isel(time=time, contact=number)
            assert (own.contact_force.values == contact.force_N).all() and (own.contact_mu.values == contact.mu).all()
    assert all(variable.attrs["long_name"] for variable in data.variables.values())


def test_contacts_fill_up_with_missing_values() -> None:
    scene = dermis.Scene.from_name("sensor-3-contacts")
    one = {"shape": "hertz-circle", "centre_mm": [-20, -20], "size_mm": [7], "normal_N": 8, "tangential_N": [1, 1]}
    pair = [one, one | {"centre_mm": [18, 18], "normal_N": 4}]
    results = scene.reconstruct([scene.generate([one]), scene.generate(pair)])
    data = results.to_xarray()
    counts = [len(result.contacts) for result in results]
    assert data.contact_count.values.tolist() == counts and data.sizes["contact"] == max(counts) > counts[0]
    assert np.isnan(data.contact_force.values[0, counts[0] :]).all() and not np.isnan(data.contact_force.values[1]).any()
    # An engine that tells no contacts apart has none of their variables.
    fixed = dermis.Scene.from_name("sensor-1").reconstruct(dermis.Scene.from_name("sensor-1").frames[:1], engine="fixed")
    assert not any(name.startswith("contact") for name in fixed.to_xarray())


def test_one_result_has_no_axis_of_time() -> None:
    [frame] = frames(1)
    one = SCENE.reconstruct(frame)
    data = one.to_xarray()
    assert data.force.dims == ("row", "col", "axis") and (data.force.values == one.forces_N).all()
    assert "time" not in data.coords and data.frame.item() == "press 0"
    many = SCENE.reconstruct([frame], times_ns=TIMES[:1])
    assert many[0].to_xarray().time.item() == TIMES[0]
    assert many.to_xarray().isel(time=0).identical(many[0].to_xarray())
    with SCENE.tracker() as tracker:
        tracked = tracker.push(frame, time_ns=5)
    assert tracked is not None and tracked.to_xarray().time.item() == 5
    assert SCENE.reconstruct(np.zeros((0, 10, 10))).to_xarray().sizes["time"] == 0


def test_frames_have_stress_and_known_forces() -> None:
    every = frames()
    data = dermis.frames_to_xarray(every)
    assert data.stress.dims == ("time", "row", "col") and data.stress.units == "MPa"
    assert (data.stress.values == np.stack([frame.stress_MPa for frame in every])).all()
    assert (data.resultant.values[1] == every[1].resultant_N).all()
    assert (every[1].to_xarray().cell_force.values == every[1].cell_forces_N).all()
    assert data.isel(time=2).identical(every[2].to_xarray())
    # A generator; frames of which one knows no force.
    flat = SCENE.load_frames(Path(__file__).parents[2] / "golden" / "data" / "frames" / "S1-hs-hertz.json")
    mixed = dermis.frames_to_xarray(frame for frame in [*flat, every[0]])
    assert mixed.sizes["time"] == 2


def test_a_file_holds_the_same(tmp_path: Path) -> None:
    for data in (SCENE.reconstruct(frames(), times_ns=TIMES).to_xarray(), dermis.frames_to_xarray(frames())):
        data.to_netcdf(tmp_path / "press.nc")
        with xarray.open_dataset(tmp_path / "press.nc") as back:
            # What is true or false becomes a byte and is read as one.
            xarray.testing.assert_identical(back.load(), data)


def test_what_cannot_be_used_is_named() -> None:
    other = dermis.Scene.from_name("eight-by-eight").frames[0]
    for wrong, message in [
        ([], "frames is empty, wanted at least one"),
        ([*frames(1), other], "frames[1] has the array"),
        ([3], "frames[0] is not a Frame"),
    ]:
        with pytest.raises(dermis.InputError, match=message.replace("[", r"\[")):
            dermis.frames_to_xarray(wrong)


def test_without_xarray_the_error_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['xarray'] = None\n"
        "import dermis; scene = dermis.Scene.from_name('eight-by-eight')\n"
        "for make in (scene.frames[0].to_xarray, scene.reconstruct(scene.frames[0]).to_xarray):\n"
        "    try: make()\n"
        "    except ImportError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["to_xarray needs xarray, which is not installed: pip install xarray"] * 2
