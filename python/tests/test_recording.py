"""A recording of `dermis reconstruct --record`: every field of every message, decoded by ROS 2's readers, against the
program's output."""

import json
import math
import os
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory

ROWS, COLS, PITCH_MM = 8, 6, (4.0, 3.0)
SCENE = f"""
[sensor]
rows = {ROWS}
cols = {COLS}
pitch_x_mm = {PITCH_MM[0]}
pitch_y_mm = {PITCH_MM[1]}
thickness_mm = 3.0
"""
# Estimator, partition and output: with contacts, with mu of a subarray, with mu of regions, without forces.
SCENES = {
    "contacts": "",
    "search": '[search]\nestimator = "search"\n',
    "regions": '[search]\nestimator = "search"\n[partition]\ncase = "contacts"\n',
    "resultants": '[output]\nforces = "resultants"\n',
}
SCHEMAS = {
    "/dermis/stress": "sensor_msgs/msg/Image",
    "/dermis/forces": "sensor_msgs/msg/PointCloud2",
    "/dermis/contacts/1": "geometry_msgs/msg/WrenchStamped",
    "/dermis/contacts/2": "geometry_msgs/msg/WrenchStamped",
}


def frames() -> np.ndarray:
    """Two presses side by side, one press, none: values with full mantissas."""
    y, x = np.mgrid[0:ROWS, 0:COLS]

    def press(row: float, col: float, size: float) -> np.ndarray:
        away = ((y - row) / size) ** 2 + ((x - col) / size) ** 2
        return np.sqrt(np.maximum(0.0, 1.0 - away)) / 7 * (1 + (x - col) / 20)

    return np.stack([press(1.6, 1.5, 1.7) + press(5.6, 4.2, 1.6), press(4.1, 2.3, 2.6), np.zeros((ROWS, COLS))])


def record(folder: Path, name: str) -> tuple[Path, list[dict[str, Any]]]:
    """A recording of the frames in the scene, and the lines that the program wrote."""
    scene, path = folder / f"{name}.toml", folder / f"{name}.mcap"
    scene.write_text(SCENE + SCENES[name])
    lines = "".join(json.dumps({"stress_MPa": frame.ravel().tolist()}) + "\n" for frame in frames())
    command = [os.environ["DERMIS"], "--build-dir", str(ROOT / "build"), "reconstruct", str(scene), "--stream"]
    # The second line is refused.
    first, rest = lines.split("\n", 1)
    done = subprocess.run(
        [*command, "--record", str(path)], input=f"{first}\n1,2\n{rest}", capture_output=True, text=True, check=False
    )
    assert "3 results recorded" in done.stderr, done.stderr
    return path, [json.loads(line) for line in done.stdout.splitlines()]


def contacts(result: dict[str, Any]) -> list[tuple[list[float], list[float]]]:
    """Centre and force of each contact of a result."""
    for key, force in [("contacts", "force_N"), ("regions", "load_N"), ("resultants", "force_N")]:
        if key in result:
            return [(own["centre_mm"], own[force]) for own in result[key] if own["centre_mm"] is not None]
    (whole,) = result["subarrays"]
    return [] if "no-contact" in result["flags"] else [(whole["compression_centroid_mm"], result["resultant_N"])]


def check_header(header: Any, received_s: float) -> None:
    assert header.frame_id == "dermis"
    assert 0 <= header.stamp.nanosec < 10**9
    assert header.stamp.sec * 10**9 + header.stamp.nanosec == round(received_s * 1e9)


def check_image(image: Any, result: dict[str, Any], frame: np.ndarray) -> None:
    check_header(image.header, result["received_s"])
    assert (image.height, image.width, image.step) == (ROWS, COLS, 8 * COLS)
    assert (image.encoding, image.is_bigendian) == ("64FC1", 0)
    assert np.array_equal(np.frombuffer(bytes(image.data), "<f8").reshape(ROWS, COLS), frame)


def check_cloud(cloud: Any, result: dict[str, Any]) -> None:
    check_header(cloud.header, result["received_s"])
    assert (cloud.height, cloud.width, cloud.is_bigendian) == (ROWS, COLS, False)
    wanted = {"x": 7, "y": 7, "z": 7, "fx": 8, "fy": 8, "fz": 8}
    ratios: dict[str, np.ndarray] = {}
    if "contacts" not in result:
        for own in result.get("regions", result["subarrays"]):
            taxels = own.get("taxels", range(ROWS * COLS))
            for key, name in [("mu", "mu"), ("mu_sigma", "mu_sigma")]:
                for axis, value in zip("xy", own.get(key, []), strict=False):
                    values = ratios.setdefault(f"{name}_{axis}", np.full(ROWS * COLS, math.nan))
                    values[list(taxels)] = value
        wanted |= dict.fromkeys(ratios, 8)
    assert {field.name: field.datatype for field in cloud.fields} == wanted
    assert all(field.count == 1 for field in cloud.fields)
    kinds = {7: "<f4", 8: "<f8"}
    point = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": [kinds[field.datatype] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_step,
        }
    )
    assert cloud.row_step == COLS * cloud.point_step
    points = np.frombuffer(bytes(cloud.data), point)
    assert len(points) == ROWS * COLS
    rows, cols = np.divmod(np.arange(ROWS * COLS), COLS)
    assert np.array_equal(points["x"], ((cols - (COLS - 1) / 2) * PITCH_MM[0] * 1e-3).astype("<f4"))
    assert np.array_equal(points["y"], ((rows - (ROWS - 1) / 2) * PITCH_MM[1] * 1e-3).astype("<f4"))
    assert not points["z"].any()
    for axis in ("fx", "fy", "fz"):
        assert np.array_equal(points[axis], result["forces_N"][axis])
    for name, values in ratios.items():
        assert np.array_equal(points[name], values, equal_nan=True)
    assert cloud.is_dense == all(np.isfinite(points[name]).all() for name in wanted)


def check_wrench(stamped: Any, result: dict[str, Any], number: int) -> None:
    check_header(stamped.header, result["received_s"])
    (x, y), (fx, fy, fz) = contacts(result)[number - 1]
    force, torque = stamped.wrench.force, stamped.wrench.torque
    assert [force.x, force.y, force.z] == [fx, fy, fz]
    moments = np.cross([x * 1e-3, y * 1e-3, 0.0], [fx, fy, fz])
    assert np.allclose([torque.x, torque.y, torque.z], moments, rtol=1e-12, atol=1e-15)


def check(path: Path, lines: list[dict[str, Any]]) -> dict[str, int]:
    """Compares every message with the lines; returns how many there are on each channel."""
    results = [line for line in lines if "sequence" in line]
    counts: dict[str, int] = {}
    written = []
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        header = reader.get_header()
        assert (header.profile, header.library.split()[0]) == ("ros2", "dermis")
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None and summary.chunk_indexes
        # In the order of the file: those of one result have the same time.
        for schema, channel, message in reader.iter_messages():
            topic = channel.topic
            counts[topic] = counts.get(topic, 0) + 1
            assert message.log_time == message.publish_time
            if topic == "/dermis/result":
                assert (schema, channel.message_encoding) == (None, "json")
                written.append(json.loads(message.data))
                continue
            assert (schema.name, schema.encoding) == (SCHEMAS[topic], "ros2msg")
            assert channel.message_encoding == "cdr"
            result = results[message.sequence]
            assert message.log_time == round(result["answered_s"] * 1e9)
            decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
            assert decode is not None
            decoded = decode(message.data)
            if topic == "/dermis/stress":
                check_image(decoded, result, frames()[message.sequence])
            elif topic == "/dermis/forces":
                check_cloud(decoded, result)
            else:
                check_wrench(decoded, result, int(topic.rsplit("/", 1)[1]))
        assert summary.statistics.message_count == sum(counts.values())
    assert written == lines
    return counts


@pytest.mark.parametrize("name", SCENES)
def test_every_field_is_that_of_the_output(tmp_path: Path, name: str) -> None:
    path, lines = record(tmp_path, name)
    counts = check(path, lines)
    results = [line for line in lines if "sequence" in line]
    found = [len(contacts(result)) for result in results]
    wanted = {"/dermis/stress": 3, "/dermis/result": 4}
    if name != "resultants":
        wanted["/dermis/forces"] = 3
    for number in range(1, max(found) + 1):
        wanted[f"/dermis/contacts/{number}"] = sum(count >= number for count in found)
    assert counts == wanted
    assert max(found) >= (2 if name in ("contacts", "regions") else 1)


def rewrite(path: Path, topic: str, change: Callable[[bytes], bytes]) -> Path:
    """A copy of a recording in which the messages of a channel are changed."""
    copy = path.with_name("changed.mcap")
    with path.open("rb") as source, copy.open("wb") as target:
        writer = Writer(target)
        writer.start("ros2", "dermis")
        known: dict[str, int] = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.topic not in known:
                number = writer.register_schema(schema.name, schema.encoding, schema.data) if schema else 0
                known[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, number)
            data = change(message.data) if channel.topic == topic else message.data
            writer.add_message(known[channel.topic], message.log_time, data, message.publish_time, message.sequence)
        writer.finish()
    return copy


def swap_torque(data: bytes) -> bytes:
    """A wrench whose torque has its first two numbers exchanged."""
    head, moments = data[:-24], struct.unpack("<3d", data[-24:])
    return head + struct.pack("<3d", moments[1], moments[0], moments[2])


def test_a_wrong_encoding_is_found(tmp_path: Path) -> None:
    path, lines = record(tmp_path, "contacts")
    # Unchanged, the copy passes.
    check(rewrite(path, "/dermis/stress", bytes), lines)
    changes: list[tuple[str, Callable[[bytes], bytes]]] = [
        # A wrench without the padding before its first number of 64 bits.
        ("/dermis/contacts/1", lambda data: data[:23] + data[28:]),
        ("/dermis/contacts/1", swap_torque),
        # The other byte order.
        ("/dermis/stress", lambda data: b"\0\0" + data[2:]),
        # The last bit of the last taxel, and the last value of the last point.
        ("/dermis/stress", lambda data: data[:-8] + struct.pack("<d", 1e-12 + struct.unpack("<d", data[-8:])[0])),
        ("/dermis/forces", lambda data: data[:-9] + struct.pack("<d", 1.0) + data[-1:]),
        ("/dermis/forces", lambda data: data[:-1] + b"\0"),
    ]
    for topic, change in changes:
        changed = rewrite(path, topic, change)
        # The comparison fails, or already the decoder, with exceptions of its own.
        with pytest.raises(Exception):
            check(changed, lines)
