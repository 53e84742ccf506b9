"""Results: equal to the command's to the last bit, whole in every form of input, and with nothing that is not known."""

import threading
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import dermis
from conftest import dermis as program


@pytest.mark.parametrize("engine", ["golden", "fixed"])
@pytest.mark.parametrize("name", ["sensor-1", "sensor-1-noisy", "eight-by-eight"])
def test_the_result_is_that_of_the_command(name: str, engine: str) -> None:
    scene = dermis.Scene.from_name(name)
    frame = scene.frames[0]
    printed = program("reconstruct", name, "--engine", engine, "--json")
    result = scene.reconstruct(frame, engine)
    assert result.to_json() + "\n" == printed
    # The same numbers in arrays.
    fields = result.to_dict()
    forces = np.stack([np.array(fields["forces_N"][axis]) for axis in ("fx", "fy", "fz")], axis=-1)
    assert np.array_equal(result.forces_N, forces.reshape(scene.rows, scene.cols, 3))
    assert result.resultant_N.tolist() == fields["resultant_N"]
    assert (result.flags, result.scene, result.engine) == (fields["flags"], name, engine)
    assert result.error.tangential == fields["error"]["tangential"]


def test_the_noise_that_the_command_finds_is_found(tmp_path: Path, searching: str) -> None:
    scene = dermis.Scene.from_toml(searching, "pad.toml")
    frame = scene.generate(random=1, seed=3, noise=5e-4)
    (tmp_path / "pad.toml").write_text(searching)
    (tmp_path / "frame.json").write_text(frame.to_json())
    files = [str(tmp_path / "pad.toml"), "--frame", str(tmp_path / "frame.json")]
    for engine in ("golden", "fixed"):
        # Text alone has the name of its origin; of a file it is that of the file.
        own = dermis.Scene.from_name(files[0])
        loaded = dermis.Frame.load(files[2])
        result = own.reconstruct(loaded, engine)
        assert result.to_json() + "\n" == program("reconstruct", *files, "--engine", engine, "--json")
        assert "shear-unreliable" in result.flags and result.checks["noise_MPa"] > 0
        quick = own.reconstruct(loaded, engine, cross_check=0)
        assert "noise_MPa" not in quick.checks
        assert np.array_equal(quick.forces_N, result.forces_N)
    assert np.array_equal(scene.reconstruct(frame).forces_N, own.reconstruct(frame).forces_N)


SMALL = "[sensor]\nrows = 8\ncols = 8\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n"
# With a stated noise, none is looked for.
SEARCH = '[search]\nestimator = "search"\nnoise_floor_MPa = 1e-9\n'


def test_every_form_of_a_frame_gives_the_same() -> None:
    scene = dermis.Scene.from_toml(SMALL + SEARCH)
    frames = [frame.stress_MPa for frame in scene.frames]
    whole = scene.reconstruct(np.stack(frames))
    assert (len(whole), whole.forces_N.shape, whole.resultant_N.shape) == (5, (5, 8, 8, 3), (5, 3))
    for index, stress in enumerate(frames):
        one = scene.reconstruct(stress)
        assert np.array_equal(one.forces_N, whole.forces_N[index])
        assert np.array_equal(one.forces_N, whole[index].forces_N)
        assert np.array_equal(one.resultant_N, whole.resultant_N[index])
        assert one.flags == whole.flags[index]
        assert whole[index].frame == f"frame {index}"
        for other in (np.asfortranarray(stress), stress.tolist(), np.pad(stress, 1)[1:-1, 1:-1]):
            assert np.array_equal(scene.reconstruct(other).forces_N, one.forces_N)
    assert [np.array_equal(a.forces_N, b.forces_N) for a, b in zip(whole, scene.reconstruct(scene.frames))] == [True] * 5
    assert np.array_equal(whole[-1].forces_N, whole[4].forces_N)
    single = frames[0].astype(np.float32)
    assert np.array_equal(scene.reconstruct(single).forces_N, scene.reconstruct(single.astype(float)).forces_N)
    assert scene.reconstruct(np.zeros((0, 8, 8))).forces_N.shape == (0, 8, 8, 3)
    with pytest.raises(IndexError, match="index 5 of 5 results"):
        whole[5]


def test_what_an_engine_does_not_give_is_absent(tmp_path: Path) -> None:
    scene = dermis.Scene.from_name("sensor-1")
    frame = scene.generate([{"shape": "hertz-circle", "size_mm": [4], "normal_N": 5, "tangential_N": [1, -0.5]}], noise=1e-3)
    golden, fixed = scene.reconstruct(frame), scene.reconstruct(frame, "fixed")
    [contact] = golden.contacts
    [[again]] = scene.reconstruct([frame]).contacts
    assert contact.force_N.tolist() == again.force_N.tolist()
    assert (contact.sigma_N > 0).all() and contact.sigma_N.shape == (3,)
    assert np.linalg.eigvalsh(contact.mu_covariance).min() > 0
    assert np.abs(contact.force_N - frame.resultant_N).max() < 5 * contact.sigma_N.max()
    assert np.linalg.norm(contact.centre_mm) < 1
    alone = scene.reconstruct(frame, "fixed", cross_check=0)
    assert fixed.contacts is None and "shear_spread" in fixed.checks and "shear_spread" not in alone.checks
    assert scene.reconstruct(frame.stress_MPa).error is None
    # Regions tell contacts apart, without standard deviations.
    text = "[sensor]\nrows = 10\ncols = 10\npitch_x_mm = 2\npitch_y_mm = 4\nthickness_mm = 3\n"
    regions = dermis.Scene.from_toml(text + '[partition]\ncase = "contacts"\n[search]\nestimator = "search"\n')
    [contact] = regions.reconstruct(frame).contacts
    assert contact.sigma_N is None and contact.mu_covariance is None and contact.force_N[2] > 1
    assert contact.shear_sigma_N is None and again.shear_sigma_N.tolist() == again.sigma_N[:2].tolist()
    assert contact.mu_sigma is None and np.allclose(again.mu_sigma**2, np.diag(again.mu_covariance))
    # A network has the standard deviation of each region's mu; one for the whole array would give all the same mu.
    contacts = text + '[partition]\ncase = "contacts"\n'
    network = contacts + '[search]\nestimator = "network"\nnetwork = "{}"\n'
    with pytest.raises(dermis.InputError, match="window around each contact"):
        dermis.Scene.from_toml(network.format("dermis:sensor-1")).reconstruct(frame)
    (tmp_path / "own.toml").write_text(contacts)
    small = "--steps 600 --contacts 600 --hidden 24,12 --batch 64 --rate 5e-3 --draws 20".split()
    program("train", str(tmp_path / "own.toml"), *small, "--out", str(tmp_path / "own.network"))
    result = dermis.Scene.from_toml(network.format(tmp_path / "own.network")).reconstruct(frame)
    [contact], [region] = result.contacts, result.to_dict()["regions"]
    assert contact.mu_sigma.tolist() == region["mu_sigma"] and (contact.mu_sigma > 0).all()
    assert contact.shear_sigma_N.tolist() == region["shear_sigma_N"] and contact.sigma_N is None
    assert np.allclose(contact.shear_sigma_N, contact.mu_sigma * contact.force_N[2])
    resultants = dermis.Scene.from_toml(text + '[output]\nforces = "resultants"\n').reconstruct(frame)
    assert resultants.forces_N is None and resultants.resultant_N[2] > 1


@pytest.mark.parametrize("engine", ["golden", "fixed"])
def test_nan_none_and_masked_values_are_missing_readings(engine: str) -> None:
    scene = dermis.Scene.from_name("eight-by-eight")
    stress = scene.frames[1].stress_MPa
    missing = np.zeros((8, 8), dtype=bool)
    missing[3, 3] = missing[6, 2] = True
    lacking = np.where(missing, np.nan, stress)
    result = scene.reconstruct(lacking, engine)
    assert "taxel-missing" in result.flags
    assert [(own["row"], own["col"]) for own in result.to_dict()["missing"]] == [(3, 3), (6, 2)]
    whole = scene.reconstruct(stress, engine)
    bound = 0.02 if engine == "golden" else 0.1
    assert np.abs(result.resultant_N - whole.resultant_N).max() < bound * whole.resultant_N[2]
    masked = np.ma.masked_array(stress, mask=missing)
    nones = [[None if absent else value for value, absent in zip(*row)] for row in zip(stress, missing)]
    for other in [masked, np.ma.masked_array(stress.astype("float32"), mask=missing), nones, np.array(nones, dtype=object)]:
        again = scene.reconstruct(other, engine)
        if isinstance(other, np.ndarray) and other.dtype == "float32":
            assert np.allclose(again.resultant_N, result.resultant_N, rtol=1e-2)
        else:
            assert again.to_dict() == result.to_dict()
    # Of a list NumPy would drop the masks: of arrays, of rows, of numbers.
    rows = [np.ma.masked_array(row, mask=absent) for row, absent in zip(stress, missing)]
    numbers = [[np.ma.masked if absent else value for value, absent in zip(*row)] for row in zip(stress, missing)]
    for listed in [rows, numbers]:
        assert scene.reconstruct(listed, engine).to_dict() == result.to_dict()
    _, listed_last = scene.reconstruct([stress, masked], engine)
    # A frame in time has its own missing readings.
    first, second = scene.reconstruct(np.stack([stress, lacking]), engine)
    assert "taxel-missing" not in first.flags and "taxel-missing" in second.flags
    assert listed_last.to_dict() == second.to_dict()
    # Where nothing can be missing a mask is refused.
    with pytest.raises(dermis.InputError, match="value_N has masked values, wanted numbers"):
        dermis.errors([0, 0, 1], np.ma.masked_array([0.0, 0.0, 1.0], mask=[True, False, False]))
    [frame] = [dermis.Scene.from_name("eight-by-eight").frames[1]]
    assert not np.isnan(frame.stress_MPa).any()


def test_blocks_and_sliding_means_have_their_frames() -> None:
    text = SMALL + SEARCH + "[input]\naverage = 1\n"
    scene = dermis.Scene.from_toml(text)
    stress = np.stack([frame.stress_MPa for frame in dermis.Scene.from_name("eight-by-eight").frames[:4]])
    blocks = scene.reconstruct(stress)
    assert (len(blocks), scene.frames_per_result) == (2, 2)
    plain = dermis.Scene.from_toml(text.replace("average = 1", "average = 0"))
    assert np.allclose(blocks.resultant_N[0], plain.reconstruct(stress[:2].mean(axis=0)).resultant_N, rtol=1e-3)
    with pytest.raises(dermis.InputError, match=r"input.average = 1"):
        scene.reconstruct(stress[:3])
    with pytest.raises(dermis.InputError, match=r"input.average = 1"):
        scene.reconstruct(stress[0])
    sliding = dermis.Scene.from_toml(text + 'mean = "sliding"\n').reconstruct(stress)
    assert [result.to_dict()["mean_frames"] for result in sliding] == [1, 2, 3, 3]
    with dermis.Scene.from_toml(text + 'mean = "sliding"\n').tracker() as tracker:
        pushed = [tracker.push(frame) for frame in stress]
    assert [result.to_dict()["mean_frames"] for result in pushed] == [1, 2, 3, 3]
    assert (np.stack([result.resultant_N for result in pushed]) == sliding.resultant_N).all()


def test_an_adaptive_mean_follows_a_press() -> None:
    text = SMALL + '[input]\nmean = "adaptive"\n'
    stress = np.repeat(dermis.Scene.from_name("eight-by-eight").frames[1].stress_MPa[None], 12, axis=0)
    results = [result.to_dict() for result in dermis.Scene.from_toml(text).reconstruct(stress)]
    assert [result["mean_frames"] for result in results][:3] == [1, 2, 3]
    assert results[11]["template"] == {"held": True, "residual": pytest.approx(0.46, abs=0.5)}
    [track] = results[11]["tracks"]
    assert (track["number"], track["age"], track["moving"]) == (1, 12, False)


def test_the_interpreter_is_free_while_a_model_computes() -> None:
    scene = dermis.Scene.from_name("sensor-3")
    frame = scene.frames[0]
    scene.reconstruct(frame)
    times: list[float] = []

    def compute() -> None:
        begin = time.perf_counter()
        scene.reconstruct(frame)
        times.append(time.perf_counter() - begin)

    thread = threading.Thread(target=compute)
    # Before the start, which may return only when the frame is done if the interpreter is held.
    longest, last = 0.0, time.perf_counter()
    thread.start()
    while thread.is_alive():
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    longest = max(longest, time.perf_counter() - last)
    # Were it held, this thread would stand still until the frame is done.
    assert longest < times[0] / 3, (longest, times)


def growing(count: int) -> np.ndarray:
    """Frames of a press that grows, of the array of SMALL."""
    frame = dermis.Scene.from_name("eight-by-eight").frames[1]
    return np.stack([frame.stress_MPa * (1 + k / count) for k in range(count)])


@pytest.mark.parametrize("engine", ["golden", "fixed"])
def test_many_frames_have_the_results_of_each_alone(engine: str) -> None:
    scene = dermis.Scene.from_toml(SMALL + "[input]\nfull_scale_MPa = 4.0\n")
    stress = growing(40)
    stress[3, 2, 5] = np.nan
    results = scene.reconstruct_many(stress, engine, cross_check=False)
    assert (len(results), results.sigma_N.shape) == (40, (40, 3))
    for k in (0, 3, 39):
        alone = scene.reconstruct(stress[k], engine, cross_check=0)
        assert (results[k].forces_N == alone.forces_N).all() and results[k].flags == alone.flags
        assert np.array_equal(results.sigma_N[k], np.full(3, np.nan) if alone.sigma_N is None else alone.sigma_N, equal_nan=True)
    assert np.isnan(results.sigma_N[0]).any() == (engine == "fixed")
    assert ["taxel-missing" in flags for flags in results.flags] == [k == 3 for k in range(40)]
    # Masked values and other kinds of arrays are taken, with a copy.
    masked = np.ma.masked_invalid(stress)
    assert (scene.reconstruct_many(masked, engine, cross_check=False).resultant_N == results.resultant_N).all()
    checked = scene.reconstruct_many(stress[:2], engine)
    assert ("cross_check_age" in checked[0].checks) == (engine == "fixed")


def test_a_batch_of_another_shape_or_of_frames_that_depend_on_each_other_is_refused() -> None:
    scene = dermis.Scene.from_toml(SMALL)
    with pytest.raises(dermis.InputError, match=r"frames has shape \(8, 8\), scene .* wants \(frames, 8, 8\)"):
        scene.reconstruct_many(np.zeros((8, 8)))
    stress = growing(3)
    stress[2, 0, 0] = np.inf
    with pytest.raises(dermis.InputError, match="frame 2"):
        scene.reconstruct_many(stress)
    for mean in ('average = 1\nmean = "sliding"', 'mean = "adaptive"'):
        slides = dermis.Scene.from_toml(SMALL + f"[input]\n{mean}\n")
        with pytest.raises(dermis.InputError, match=r"input.mean = "):
            slides.reconstruct_many(stress)


def test_a_batch_reads_the_array_where_it_stands() -> None:
    scene = dermis.Scene.from_toml(SMALL + SEARCH)
    stress = np.zeros((4000, 8, 8))
    tracemalloc.start()
    results = scene.reconstruct_many(stress, cross_check=False)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # NumPy reports its arrays; a copy would be as large as the argument.
    assert len(results) == 4000 and most < stress.nbytes / 10, most


def test_times_go_through_to_the_nanosecond() -> None:
    # A float would lose the last digits.
    first_ns = 1_732_770_000_020_000_003
    stress = growing(4)
    times = [first_ns + k for k in range(4)]
    scene = dermis.Scene.from_toml(SMALL + SEARCH)
    results = scene.reconstruct(stress, times_ns=times)
    assert results.times_ns is not None and results.times_ns.dtype == np.int64
    assert results.times_ns.tolist() == times == [result.time_ns for result in results]
    assert results[-1].time_ns == times[-1] and scene.reconstruct(stress, times_ns=np.array(times))[1].time_ns == times[1]
    assert scene.reconstruct(stress).times_ns is None and scene.reconstruct(stress[0]).time_ns is None
    for average, wanted in [("average = 1\n", times[1::2]), ('average = 1\nmean = "sliding"\n', times)]:
        blocks = dermis.Scene.from_toml(SMALL + SEARCH + "[input]\n" + average)
        given = blocks.reconstruct(stress, times_ns=times).times_ns
        assert given is not None and given.tolist() == wanted
        with blocks.tracker() as tracker:
            pushed = [tracker.push(frame, time_ns=time) for frame, time in zip(stress, times)]
        assert [result.time_ns for result in pushed if result is not None] == wanted
    with scene.tracker() as tracker:
        for frame in stress[:2]:
            result = tracker.push(frame)
            assert result is not None and result.time_ns is None
    for wrong, text in [(times[:3], "times_ns has 3 values for 4 frames"), (times + times, "8 values for 4 frames")]:
        with pytest.raises(dermis.InputError, match=text):
            scene.reconstruct(stress, times_ns=wrong)
    with pytest.raises(dermis.InputError, match="times_ns has 1 values for one frame without an axis of time"):
        scene.reconstruct(stress[0], times_ns=times[:1])
    with pytest.raises(TypeError):
        scene.reconstruct(stress, times_ns=np.array(times, dtype=float))


def test_frames_of_a_file_have_its_times(tmp_path: Path) -> None:
    path = tmp_path / "frames.csv"
    rows = [f"2024-11-28T05:00:00.02000000{k},{','.join(['0.1'] * 64)}" for k in range(3)]
    path.write_text("time," + ",".join(f"t{k}" for k in range(64)) + "\n" + "\n".join(rows) + "\n")
    scene = dermis.Scene.from_toml(SMALL + SEARCH)
    frames = scene.load_frames(path)
    wanted = [1_732_770_000_020_000_000 + k for k in range(3)]
    assert [frame.time_ns for frame in frames] == wanted
    times = scene.reconstruct(frames).times_ns
    assert times is not None and times.tolist() == wanted
    assert scene.reconstruct(frames[1]).time_ns == wanted[1]
    with scene.tracker() as tracker:
        result = tracker.push(frames[2])
        assert result is not None and result.time_ns == wanted[2]
        result = tracker.push(frames[2], time_ns=-5)
        assert result is not None and result.time_ns == -5
    kept = tmp_path / "one.json"
    kept.write_text(frames[1].to_json())
    assert dermis.Frame.load(kept).time_ns == wanted[1]


def test_a_tracker_has_the_history_of_a_stream() -> None:
    scene = dermis.Scene.from_toml(SMALL)
    stress = growing(12)
    stress[:, 4, 4] = stress[0].max()
    wanted = scene.reconstruct(stress)
    with scene.tracker() as tracker:
        results = [tracker.push(frame) for frame in stress]
        assert [result.flags for result in results] == wanted.flags
        assert all((result.forces_N == other.forces_N).all() for result, other in zip(results, wanted))
        assert "taxel-constant" in results[-1].flags and "taxel-constant" not in results[0].flags
        tracker.reset()
        assert "taxel-constant" not in tracker.push(dermis.Scene.from_name("eight-by-eight").frames[1]).flags
        with pytest.raises(dermis.InputError, match="a tracker takes one at a time"):
            tracker.push(stress)
    with pytest.raises(dermis.InputError, match="the tracker is closed"):
        tracker.push(stress[0])
    blocks = dermis.Scene.from_toml(SMALL + SEARCH + "[input]\naverage = 1\n").tracker()
    assert [blocks.push(frame) is None for frame in stress[:4]] == [True, False, True, False]
