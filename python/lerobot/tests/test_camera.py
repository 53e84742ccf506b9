"""The camera by way of LeRobot's own calls: its registry of types, its reader of configurations, its interface of cameras.

Only what these import is installed beside LeRobot; `test_whole.py` needs all of it.
"""

import json
import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import dermis
import draccus
import numpy as np
import pytest
import sources
from lerobot.cameras import Camera, CameraConfig, make_cameras_from_configs
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from lerobot.utils.import_utils import register_third_party_plugins

register_third_party_plugins()

NAME = "eight-by-eight"
SCENE = dermis.Scene.from_name(NAME)
FULL_SCALE_N = 2.0
START_NS = 1732770000020000003


@dataclass
class Robot:
    """As the configurations of LeRobot's robots have cameras."""

    cameras: dict[str, CameraConfig] = field(default_factory=dict)


def made(**settings: Any) -> Camera:
    """A camera of the command line that LeRobot's programs take."""
    settings = {"type": "dermis", "scene": NAME, "full_scale": FULL_SCALE_N} | settings
    robot = draccus.parse(Robot, args=[f"--cameras={json.dumps({'pad': settings})}"])
    return make_cameras_from_configs(robot.cameras)["pad"]


@pytest.fixture
def camera() -> Iterator[Callable[..., Camera]]:
    """Makes cameras, which are disconnected at the end; none may leave a thread."""
    every: list[Camera] = []

    def make(**settings: Any) -> Camera:
        every.append(made(**settings))
        return every[-1]

    sources.GO_ON.clear()
    sources.CLOSED.clear()
    yield make
    sources.GO_ON.set()
    for one in every:
        if one.is_connected:
            one.disconnect()
    assert not reading_threads()


def reading_threads() -> list[str]:
    """Threads of cameras, which are given a moment to end."""
    until = time.monotonic() + 20
    while time.monotonic() < until:
        names = [thread.name for thread in threading.enumerate() if thread.name.endswith(" readings")]
        if not names:
            break
        time.sleep(0.01)
    return names


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """A press that grows in five frames, 150 ms apart."""
    folder = tmp_path / "press"
    folder.mkdir()
    press = json.loads(SCENE.generate(random=1, seed=1).to_json())
    for k, stress in enumerate(sources.presses(SCENE, 5)):
        text = press | {"id": f"press-{k}", "time_ns": START_NS + 150_000_000 * k, "stress_MPa": stress.ravel().tolist()}
        for known in ("forces_N", "cell_forces_N", "resultant_N", "contacts"):
            text.pop(known, None)
        (folder / f"{k}.json").write_text(json.dumps(text))
    return folder


def results(readings: list[Any], engine: Any = "golden") -> list[dermis.Reconstruction]:
    """What Dermis itself gives of readings in their order."""
    with SCENE.tracker(engine) as tracker:
        found = [tracker.push(reading) for reading in readings]
    return [one for one in found if one is not None]


def pixels(forces_N: Any) -> np.ndarray:
    """The image of forces, taxel by taxel, as the guide has it."""
    image = np.zeros((SCENE.rows, SCENE.cols, 3), dtype=np.uint8)
    for row in range(SCENE.rows):
        for col in range(SCENE.cols):
            x, y, normal = forces_N[row, col] / FULL_SCALE_N
            image[row, col] = [
                max(1, min(255, round(128 + 127 * x))),
                max(1, min(255, round(128 + 127 * y))),
                max(0, min(255, round(255 * normal))),
            ]
    return image


def shows(camera: Camera, frames: list[dermis.Frame], engine: Any = "golden") -> None:
    """The camera plays frames: each image is that of its frame, none comes twice, the last one comes, whatever a busy machine misses."""
    found = results(frames, engine)
    shown = []
    camera.connect()
    while True:
        try:
            image = camera.async_read(timeout_ms=20_000)
        except RuntimeError as error:
            assert "the source has no more readings" in str(error)
            break
        reading = camera.reading
        [index] = [k for k, frame in enumerate(frames) if np.array_equal(frame.stress_MPa, reading.stress)]
        assert image.dtype == np.uint8 and np.array_equal(image, pixels(found[index].forces_N))
        assert np.array_equal(reading.result.forces_N, found[index].forces_N)
        assert reading.result.time_ns == found[index].time_ns
        shown.append(index)
        # It is the reader's own.
        image.fill(0)
    camera.disconnect()
    assert shown == sorted(set(shown)) and shown[-1] == len(frames) - 1


PROGRAM = """
import sys, draccus
from dataclasses import dataclass
from lerobot.cameras import CameraConfig, make_cameras_from_configs
from lerobot.utils.import_utils import register_third_party_plugins

@dataclass
class Robot:
    cameras: dict[str, CameraConfig]

if sys.argv.pop(1) == "plugins":
    register_third_party_plugins()
cameras = make_cameras_from_configs(draccus.parse(Robot).cameras)
print({name: type(camera).__name__ for name, camera in cameras.items()})
"""


def test_lerobot_finds_the_camera_by_the_name_of_its_distribution() -> None:
    cameras = f"--cameras={{pad: {{type: dermis, scene: {NAME}, full_scale: 2, source: 'sensor:readings', fps: 30}}}}"

    def run(which: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([sys.executable, "-c", PROGRAM, which, cameras], capture_output=True, text=True)

    found = run("plugins")
    assert found.returncode == 0 and found.stdout == "{'pad': 'DermisCamera'}\n", found.stderr
    # Without the search the type is not known, so that it is the search that finds it.
    missing = run("none")
    assert missing.returncode != 0 and "dermis" in missing.stderr


@pytest.mark.parametrize("engine", ["golden", "fixed"])
def test_a_recording_shows_the_forces_of_its_frames(camera: Callable[..., Camera], recording: Path, engine: str) -> None:
    frames = SCENE.load_frames(recording)
    assert len({pixels(one.forces_N).tobytes() for one in results(frames)}) == 5
    one = camera(recording=str(recording), engine=engine)
    shows(one, frames, engine)
    # Connected again, it begins anew.
    shows(one, frames, engine)


@pytest.mark.parametrize("defect", ["x and y exchanged", "rows from below", "cut off in place of rounded", "one image late"])
def test_wrong_images_are_found(
    camera: Callable[..., Camera], recording: Path, monkeypatch: pytest.MonkeyPatch, defect: str
) -> None:
    import lerobot_camera_dermis.camera as module

    right = module.force_image
    before = [np.zeros((SCENE.rows, SCENE.cols, 3), dtype=np.uint8)]

    def late(forces: np.ndarray, scale: float) -> np.ndarray:
        before.append(right(forces, scale))
        return before[-2]

    defects = {
        "x and y exchanged": lambda forces, scale: right(forces, scale)[..., [1, 0, 2]],
        "rows from below": lambda forces, scale: right(forces, scale)[::-1],
        "cut off in place of rounded": lambda forces, scale: right(forces - scale / 512, scale),
        "one image late": late,
    }
    monkeypatch.setattr(module, "force_image", defects[defect])
    with pytest.raises(AssertionError):
        shows(camera(recording=str(recording)), SCENE.load_frames(recording))


def test_no_image_is_left_out_for_a_reader_that_is_there(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:asked")
    one.connect(warmup=False)
    for found in results(sources.presses(SCENE, 5)):
        sources.ASKED.release()
        assert np.array_equal(one.async_read(timeout_ms=20_000), pixels(found.forces_N))
        # Nor twice; behind the last one the source ends.
        with pytest.raises((TimeoutError, RuntimeError)):
            one.async_read(timeout_ms=1)


def test_a_recording_is_played_at_its_times(recording: Path) -> None:
    from lerobot_camera_dermis.source import played

    frames = SCENE.load_frames(recording)
    times = []
    for index, frame in enumerate(played(frames, None, threading.Event())):
        times.append(time.monotonic())
        assert frame.time_ns == frames[index].time_ns
        # Never early, however late the frame before was; the clock begins behind the first one.
        assert times[-1] - times[0] >= 0.15 * index - 0.001
    assert len(times) == 5
    # A camera that disconnects does not wait for the next frame.
    stopped = threading.Event()
    stopped.set()
    start = time.monotonic()
    assert len(list(played(frames, None, stopped))) == 1 and time.monotonic() - start < 0.15
    with pytest.raises(ValueError, match=f"frame 1 has the time {START_NS} ns, the one before {START_NS} ns"):
        played([frames[0], frames[0]], None, stopped)


def test_frames_without_times_are_played_at_the_rate_of_the_configuration(camera: Callable[..., Camera], tmp_path: Path) -> None:
    for k, stress in enumerate(sources.presses(SCENE, 3)):
        (tmp_path / f"{k}.csv").write_text("\n".join(",".join(map(str, row)) for row in stress) + "\n")
    with pytest.raises(ConnectionError, match="frame 0 has no time; fps says how many"):
        camera(recording=str(tmp_path)).connect()
    one = camera(recording=str(tmp_path), fps=5)
    start = time.monotonic()
    shows(one, SCENE.load_frames(tmp_path))
    assert time.monotonic() - start > 0.35 and one.fps == 5


def test_a_function_gives_arrays_lists_and_masked_values(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:three")
    one.connect()
    readings = [reading for reading in sources.three(SCENE) if reading is not None]
    last = results(readings)[-1]
    # `read_latest` would not have it: the source has ended by then.
    until = time.monotonic() + 20
    while one.reading is None or not np.isnan(one.reading.stress).any():
        assert time.monotonic() < until
        image = one.async_read(timeout_ms=20_000)
    assert np.array_equal(image, pixels(last.forces_N))
    assert "taxel-missing" in one.reading.result.flags and np.isnan(one.reading.stress[1, 3])


def test_stress_is_grey_and_black_where_it_is_missing(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:three", content="stress", full_scale=0.05)
    one.connect()
    until = time.monotonic() + 20
    while one.reading is None or not np.isnan(one.reading.stress).any():
        assert time.monotonic() < until
        image = one.async_read(timeout_ms=20_000)
    stress = sources.presses(SCENE, 3)[-1]
    stress[1, 3] = 0
    assert np.array_equal(image, np.repeat(np.rint(255 * stress / 0.05).clip(0, 255).astype(np.uint8)[..., None], 3, axis=2))
    assert image.max() > 50


def test_an_image_gives_the_forces_back_to_half_a_step() -> None:
    from lerobot_camera_dermis import force_image, forces_N_of

    rng = np.random.default_rng(1)
    forces = rng.uniform([-2, -2, 0], [2, 2, 2], (20, 30, 3))
    off = np.abs(forces_N_of(force_image(forces, 2.0), 2.0) - forces).max(axis=(0, 1))
    # 10^-12 for the arithmetic itself.
    assert (off <= np.array([2 / 254, 2 / 254, 2 / 510]) + 1e-12).all() and (off > 0.9 * np.array([2 / 254, 2 / 254, 2 / 510])).all()
    ends = force_image(np.array([[[9.0, -9.0, -1.0], [0.0, 0.0, 9.0]]]), 2.0)
    assert ends.tolist() == [[[255, 1, 0], [128, 128, 255]]]


def test_forces_beyond_the_scale_are_told_once(camera: Callable[..., Camera], caplog: pytest.LogCaptureFixture) -> None:
    one = camera(source="sources:steady", full_scale=0.05)
    with caplog.at_level(logging.WARNING):
        one.connect()
        for _ in range(3):
            one.async_read(timeout_ms=20_000)
    told = [record.getMessage() for record in caplog.records if "beyond full_scale = 0.05" in record.getMessage()]
    assert len(told) == 1


def test_a_taxel_is_a_block_of_pixels(camera: Callable[..., Camera], recording: Path) -> None:
    one = camera(recording=str(recording), height=24, width=64)
    assert (one.height, one.width) == (24, 64)
    one.connect()
    image = one.async_read(timeout_ms=20_000)
    small = pixels(one.reading.result.forces_N)
    assert image.shape == (24, 64, 3)
    for row in range(24):
        for col in range(64):
            assert np.array_equal(image[row, col], small[row // 3, col // 8])


def test_a_source_that_stalls_is_told_and_goes_on(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:stalling")
    one.connect()
    first = one.async_read()
    start = time.monotonic()
    with pytest.raises(TimeoutError, match="no new image within 80 ms"):
        one.async_read(timeout_ms=80)
    assert 0.07 < time.monotonic() - start < 10
    # The newest image is there without waiting while it is young, again and again, as an array of its own.
    again = one.read_latest(max_age_ms=10_000)
    assert np.array_equal(again, first) and again is not one.read_latest(max_age_ms=10_000)
    with pytest.raises(TimeoutError, match="ms old, at most 50 ms"):
        one.read_latest(max_age_ms=50)
    sources.GO_ON.set()
    second = one.async_read(timeout_ms=20_000)
    assert np.array_equal(second, pixels(results(sources.presses(SCENE, 2))[1].forces_N))


def test_read_waits_for_an_image_after_the_call(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:steady")
    one.connect()
    until = time.monotonic() + 20
    while one._stream.count < 3:
        assert time.monotonic() < until
    one.read()
    assert one._stream.given > 3


def test_a_source_that_ends_leaves_the_camera_connected(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:three")
    one.connect()
    assert not reading_threads()
    # The image that is there comes first.
    one.async_read()
    for call in (one.async_read, one.read, one.read_latest):
        with pytest.raises(RuntimeError, match=r"DermisCamera\(eight-by-eight, sources:three\): the source has no more readings"):
            call()
    assert one.is_connected
    one.disconnect()
    assert not one.is_connected


@pytest.mark.parametrize(
    ("source", "message", "cause"),
    [
        ("turned", r"frames has shape \(2, 3\), scene eight-by-eight wants \(8, 8\)", dermis.InputError),
        ("unplugged", "the port is gone", OSError),
    ],
)
def test_a_source_that_fails_is_named(camera: Callable[..., Camera], source: str, message: str, cause: type) -> None:
    one = camera(source=f"sources:{source}")
    one.connect()
    assert not reading_threads()
    one.async_read()
    for call in (one.async_read, one.read_latest):
        with pytest.raises(RuntimeError, match=message) as error:
            call()
        assert isinstance(error.value.__cause__, cause)
    one.disconnect()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"source": "sources:wrong"}, r"frames has shape \(2, 3\)"),
        ({"source": "sources:refusing"}, "the port is in use"),
        ({"source": "sources:silent", "timeout_s": 0.2}, "no result within 0.2 s"),
        ({"source": "sources:absent"}, "module sources has no absent"),
        ({"source": "sources:not_a_function"}, "not callable"),
        ({"source": "no_such_module:readings"}, "no_such_module"),
        ({"recording": "absent.mcap"}, "absent.mcap"),
        ({"source": "sources:steady", "board": "/dev/absent"}, "/dev/absent"),
    ],
)
def test_a_connection_that_fails_leaves_nothing(camera: Callable[..., Camera], settings: dict[str, Any], message: str) -> None:
    one = camera(**settings)
    with pytest.raises(ConnectionError, match=message):
        one.connect()
    assert not one.is_connected and not reading_threads()
    assert sources.CLOSED == (["wrong"] if settings.get("source") == "sources:wrong" else [])
    with pytest.raises(DeviceNotConnectedError):
        one.async_read()


def test_the_thread_ends_and_the_source_is_closed_at_disconnect(camera: Callable[..., Camera]) -> None:
    one = camera(source="sources:steady")
    for call in (one.read, one.async_read, one.read_latest, one.disconnect):
        with pytest.raises(DeviceNotConnectedError):
            call()
    for count in (1, 2):
        one.connect(warmup=False)
        with pytest.raises(DeviceAlreadyConnectedError):
            one.connect()
        one.async_read(timeout_ms=20_000)
        one.disconnect()
        assert not one.is_connected and one.reading is None
        # Without a wait: `disconnect` has waited.
        assert not [thread for thread in threading.enumerate() if thread.name.endswith(" readings")]
        assert sources.CLOSED == ["steady"] * count


def test_a_source_that_does_not_return_keeps_the_sensor_to_itself(
    camera: Callable[..., Camera], monkeypatch: pytest.MonkeyPatch
) -> None:
    import lerobot_camera_dermis.camera as module

    monkeypatch.setattr(module, "_END_S", 0.1)
    one = camera(source="sources:waiting")
    one.connect()
    one.disconnect()
    assert not one.is_connected and sources.CLOSED == []
    with pytest.raises(ConnectionError, match="the source of the last connection has not returned yet"):
        one.connect()
    sources.GO_ON.set()
    assert not reading_threads() and sources.CLOSED == ["waiting"]
    one.connect()
    one.async_read()


def test_a_board_reconstructs_the_readings(camera: Callable[..., Camera], recording: Path) -> None:
    command = [os.environ["DERMIS"], "board", NAME, "--udp", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as core:
        try:
            assert core.stdout is not None
            address = core.stdout.readline().strip()
            shows(camera(recording=str(recording), board=address), SCENE.load_frames(recording), "fixed")
        finally:
            core.kill()


def test_ctrl_c_in_a_connection_leaves_nothing(camera: Callable[..., Camera], monkeypatch: pytest.MonkeyPatch) -> None:
    import lerobot_camera_dermis.camera as module

    def interrupted(*_: Any) -> bool:
        raise KeyboardInterrupt

    one = camera(source="sources:steady")
    with monkeypatch.context() as change, pytest.raises(KeyboardInterrupt):
        change.setattr(module._Stream, "wait", interrupted)
        one.connect()
    assert not one.is_connected and not reading_threads() and sources.CLOSED == ["steady"]
    one.connect()


def test_an_image_that_lerobot_would_turn_is_refused(tmp_path: Path) -> None:
    sensor = "rows = 3\ncols = 4\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n"
    (tmp_path / "three.toml").write_text(f"[sensor]\n{sensor}")
    settings = {"scene": str(tmp_path / "three.toml"), "source": "sources:steady"}
    with pytest.raises(ValueError, match="LeRobot would take the rows for channels"):
        made(**settings)
    assert made(**settings, height=6).height == 6


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "exactly one of both"),
        ({"source": "sources:steady", "recording": "press.mcap"}, "exactly one of both"),
        ({"source": "steady"}, "must be 'module:function'"),
        ({"source": "sources:steady", "full_scale": 0}, "full_scale = 0"),
        ({"source": "sources:steady", "timeout_s": -1}, "timeout_s = -1"),
        ({"source": "sources:steady", "fps": 0}, "fps = 0"),
        ({"source": "sources:steady", "content": "colour"}, "content = 'colour' is not allowed; it must be 'force' or 'stress'"),
        ({"source": "sources:steady", "engine": "rtl"}, "engine = 'rtl'"),
        ({"source": "sources:steady", "engine": "fixed", "board": "/dev/ttyUSB0"}, "beside board"),
        ({"source": "sources:steady", "width": 20}, "width = 20 is not allowed; scene eight-by-eight has 8 columns"),
        ({"source": "sources:steady", "height": 12}, "height = 12 is not allowed"),
        ({"source": "sources:steady", "scene": "eight"}, "no scene"),
        ({"source": "sources:steady", "full_scale": "much"}, "full_scale"),
    ],
)
def test_a_configuration_that_cannot_be_used_is_named(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(Exception) as error:
        made(**settings)
    # The reader of configurations has the reason as the cause of its own message.
    told: list[str] = []
    cause: BaseException | None = error.value
    while cause is not None:
        told.append(str(cause))
        cause = cause.__cause__ or cause.__context__
    assert message in "\n".join(told), told


def test_the_source_of_the_guide_reads_a_serial_port(
    camera: Callable[..., Camera], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (Path(__file__).resolve().parents[3] / "docs" / "learning.md").read_text()
    [text] = [block for block in page.split("```") if block.startswith("python\nimport numpy as np\nimport serial")]
    ours, theirs = os.openpty()
    text = text.removeprefix("python\n").replace("/dev/ttyACM2", os.ttyname(theirs))
    (tmp_path / "sensor_of_the_guide.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    stress = sources.presses(SCENE, 1)[0].round(6)
    line = ",".join(map(str, stress.ravel())).encode() + b"\r\n"
    one = camera(source="sensor_of_the_guide:readings")
    one.connect(warmup=False)
    image = None
    for _ in range(20):
        # A line without its beginning, and a whole one; the port loses what it was sent before it was opened.
        os.write(ours, line[60:] + line)
        try:
            image = one.async_read(timeout_ms=500)
            break
        except TimeoutError:
            pass
    assert image is not None and np.array_equal(image, pixels(results([stress])[0].forces_N))
    one.disconnect()
    os.close(ours)
    os.close(theirs)


def test_cameras_are_not_looked_for() -> None:
    from lerobot_camera_dermis import DermisCamera

    with pytest.raises(NotImplementedError, match="its scene and its source are configured"):
        DermisCamera.find_cameras()
