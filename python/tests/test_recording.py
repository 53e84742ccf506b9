"""A recording of `dermis reconstruct --record`: every field of every message, decoded by the readers that users call,
against the program's output; and what is left of it after the program is killed."""

import json
import math
import os
import signal
import struct
import subprocess
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer as RosWriter
from rerun.chunk import McapReader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

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
    "/dermis/stress_exact": "sensor_msgs/msg/Image",
    "/dermis/arrows": "visualization_msgs/msg/MarkerArray",
    "/dermis/result": "std_msgs/msg/String",
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


def check_header(header: Any, time_ns: int) -> None:
    assert header.frame_id == "dermis"
    assert 0 <= header.stamp.nanosec < 10**9
    assert header.stamp.sec * 10**9 + header.stamp.nanosec == time_ns


def check_image(image: Any, result: dict[str, Any], frame: np.ndarray, topic: str) -> None:
    check_header(image.header, result["time_ns"])
    kind = {"/dermis/stress": np.dtype("<f4"), "/dermis/stress_exact": np.dtype("<f8")}[topic]
    assert (image.height, image.width, image.step) == (ROWS, COLS, kind.itemsize * COLS)
    assert (image.encoding, image.is_bigendian) == (f"{8 * kind.itemsize}FC1", 0)
    assert np.array_equal(np.frombuffer(bytes(image.data), kind).reshape(ROWS, COLS), frame.astype(kind))


def check_cloud(cloud: Any, result: dict[str, Any]) -> None:
    check_header(cloud.header, result["time_ns"])
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
    check_header(stamped.header, result["time_ns"])
    (x, y), (fx, fy, fz) = contacts(result)[number - 1]
    force, torque = stamped.wrench.force, stamped.wrench.torque
    assert [force.x, force.y, force.z] == [fx, fy, fz]
    moments = np.cross([x * 1e-3, y * 1e-3, 0.0], [fx, fy, fz])
    assert np.allclose([torque.x, torque.y, torque.z], moments, rtol=1e-12, atol=1e-15)


def vector(own: Any) -> list[float]:
    return [own.x, own.y, own.z]


def check_arrows(array: Any, result: dict[str, Any]) -> None:
    """An arrow per contact and a line per taxel: 0.1 MPa, where no full scale is stated, are half the smaller pitch."""
    metres_per_N = 0.5e-3 * min(PITCH_MM) / (0.1 * PITCH_MM[0] * PITCH_MM[1])
    removed, *drawn = array.markers
    assert (removed.action, [own.action for own in drawn]) == (3, [0] * len(drawn))
    lines = [own for own in drawn if own.ns == "taxels"]
    arrows = [own for own in drawn if own.ns == "contacts"]
    assert len(lines) + len(arrows) == len(drawn) and len(lines) == bool(result["forces_N"]["fz"])
    found = [(start, force) for start, force in contacts(result)]
    for own in lines:
        rows, cols = np.divmod(np.arange(ROWS * COLS), COLS)
        x, y = (cols - (COLS - 1) / 2) * PITCH_MM[0], (rows - (ROWS - 1) / 2) * PITCH_MM[1]
        forces = np.stack([result["forces_N"][axis] for axis in ("fx", "fy", "fz")], axis=1)
        starts = np.stack([x, y, 0 * x], axis=1) * 1e-3
        wanted = np.stack([starts, starts + forces * metres_per_N], axis=1).reshape(-1, 3)
        assert own.type == 5 and np.allclose([vector(point) for point in own.points], wanted, rtol=1e-12, atol=1e-15)
    assert [own.id for own in arrows] == list(range(1, len(found) + 1))
    for own, (centre_mm, force_N) in zip(arrows, found, strict=True):
        check_header(own.header, result["time_ns"])
        start, end = (np.array(vector(point)) for point in own.points)
        assert own.type == 0 and np.allclose(start, [*(np.array(centre_mm) * 1e-3), 0.0], rtol=1e-12)
        assert np.allclose(end - start, np.array(force_N) * metres_per_N, rtol=1e-9, atol=1e-15)
        assert own.color.a == 1.0 and own.pose.orientation.w == 1.0 and own.scale.x > 0


def check_message(topic: str, message: Any, result: dict[str, Any], frame: np.ndarray) -> None:
    """Compares a message of a result, decoded by any reader, with its line."""
    if topic in ("/dermis/stress", "/dermis/stress_exact"):
        check_image(message, result, frame, topic)
    elif topic == "/dermis/forces":
        check_cloud(message, result)
    elif topic == "/dermis/arrows":
        check_arrows(message, result)
    else:
        check_wrench(message, result, int(topic.rsplit("/", 1)[1]))


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
            assert (schema.name, schema.encoding, channel.message_encoding) == (SCHEMAS[topic], "ros2msg", "cdr")
            decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
            assert decode is not None
            decoded = decode(message.data)
            if topic == "/dermis/result":
                written.append(json.loads(decoded.data))
                continue
            result = results[message.sequence]
            assert message.log_time == round(result["answered_s"] * 1e9)
            check_message(topic, decoded, result, frames()[message.sequence])
        assert summary.statistics.message_count == sum(counts.values())
    assert written == lines
    return counts


@pytest.mark.parametrize("name", SCENES)
def test_every_field_is_that_of_the_output(tmp_path: Path, name: str) -> None:
    path, lines = record(tmp_path, name)
    counts = check(path, lines)
    results = [line for line in lines if "sequence" in line]
    found = [len(contacts(result)) for result in results]
    wanted = {"/dermis/stress": 3, "/dermis/stress_exact": 3, "/dermis/arrows": 3, "/dermis/result": 4}
    if name != "resultants":
        wanted["/dermis/forces"] = 3
    for number in range(1, max(found) + 1):
        wanted[f"/dermis/contacts/{number}"] = sum(count >= number for count in found)
    assert counts == wanted
    assert max(found) >= (2 if name in ("contacts", "regions") else 1)


def test_every_reader_opens_a_recording_as_its_readme_says(tmp_path: Path) -> None:
    path, lines = record(tmp_path, "contacts")
    results = [line for line in lines if "sequence" in line]
    counts = check(path, lines)
    # mcap-ros2-support.
    found: dict[str, int] = {}
    for own in read_ros2_messages(str(path)):
        found[own.channel.topic] = found.get(own.channel.topic, 0) + 1
        if own.channel.topic != "/dermis/result":
            check_message(own.channel.topic, own.ros_msg, results[own.sequence_count], frames()[own.sequence_count])
    assert found == counts
    # rosbags, with the definitions of the file; the types, and what is offered to subscribers, are those of ROS 2.
    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([path]) as reader:
        number: dict[str, int] = {}
        for connection, _, raw in reader.messages():
            topic = connection.topic
            index = number[topic] = number.get(topic, -1) + 1
            message = reader.deserialize(raw, connection.msgtype)
            if topic in ("/dermis/stress", "/dermis/stress_exact", "/dermis/forces", "/dermis/arrows"):
                check_message(topic, message, results[index], frames()[index])
        assert {topic: count + 1 for topic, count in number.items()} == counts
        for connection in reader.connections:
            assert reader.typestore.hash_rihs01(connection.msgtype) == store.hash_rihs01(connection.msgtype)
            (offered,) = connection.ext.offered_qos_profiles
            assert (offered.depth, offered.reliability.name, offered.durability.name) == (10, "RELIABLE", "VOLATILE")
    with path.open("rb") as file:
        for channel in make_reader(file).get_summary().channels.values():
            assert channel.metadata["topic_type_hash"] == store.hash_rihs01(SCHEMAS[channel.topic])
    # rerun-sdk: the image as a depth image, the forces as points.
    rows: dict[str, list[np.ndarray]] = {}
    for chunk in McapReader(path).stream():
        batch = chunk.to_record_batch()
        for column in ("DepthImage:buffer", "Points3D:positions", "TextDocument:text"):
            if column in batch.schema.names:
                rows.setdefault(chunk.entity_path + " " + column, []).extend(batch.column(column).to_pylist())
    images = [np.array(own[0], np.uint8).view("<f4") for own in rows["/dermis/stress DepthImage:buffer"]]
    assert np.array_equal(images, frames().astype("<f4").reshape(3, -1))
    assert [len(own) for own in rows["/dermis/forces Points3D:positions"]] == [ROWS * COLS] * 3
    assert [json.loads(own[0]) for own in rows["/dermis/result TextDocument:text"]] == lines


def exact(path: Path, read: str) -> int:
    """Number of the frames that a reader finds in a recording whose program was killed; all of them are compared."""
    count = 0
    wanted = frames()[1].astype("<f8").tobytes()
    if read == "mcap":
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages():
                count += channel.topic == "/dermis/stress_exact" and bytes(message.data) == wanted
    elif read == "mcap-ros2-support":
        for own in read_ros2_messages(str(path)):
            count += own.channel.topic == "/dermis/stress_exact" and bytes(own.ros_msg.data) == wanted
    elif read == "rosbags":
        with AnyReader([path]) as reader:
            for connection, _, raw in reader.messages():
                if connection.topic == "/dermis/stress_exact":
                    count += bytes(reader.deserialize(raw, connection.msgtype).data) == wanted
    else:
        for chunk in McapReader(path, recover=True, include_topic_regex=["/dermis/stress_exact"]).stream():
            batch = chunk.to_record_batch()
            if "DepthImage:buffer" in batch.schema.names:
                found = batch.column("DepthImage:buffer").to_pylist()
                count += sum(np.array(own[0], np.uint8).tobytes() == wanted for own in found)
    return count


def test_a_recording_whose_program_is_killed_is_read_by_every_reader(tmp_path: Path) -> None:
    scene, path = tmp_path / "scene.toml", tmp_path / "killed.mcap"
    scene.write_text(SCENE + SCENES["search"])
    command = [os.environ["DERMIS"], "--build-dir", str(ROOT / "build"), "reconstruct", str(scene), "--stream"]
    running = subprocess.Popen(
        [*command, "--record", str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert running.stdin is not None and running.stdout is not None
    line = (json.dumps({"stress_MPa": frames()[1].ravel().tolist()}) + "\n").encode()
    for _ in range(20):
        running.stdin.write(line)
        running.stdin.flush()
        running.stdout.readline()
    time.sleep(1.0)
    running.send_signal(signal.SIGKILL)
    running.wait()
    for read in ("mcap", "mcap-ros2-support", "rosbags", "rerun-sdk"):
        assert exact(path, read) == 20, read
    # A chunk that is cut, as of a program that is killed while it writes, is found to be missing, not misread.
    path.write_bytes(path.read_bytes()[:-500])
    replayed = subprocess.run([os.environ["DERMIS"], "replay", str(path)], capture_output=True, text=True, check=False)
    assert replayed.returncode == 2 and "ends early" in replayed.stderr


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
        # The last end of the last line of taxels: the fields behind the points are counts of 0 and a boolean.
        ("/dermis/arrows", lambda data: data[:-60] + struct.pack("<d", 1.0) + data[-52:]),
        # The last bit of the last taxel, and the last value of the last point.
        ("/dermis/stress_exact", lambda data: data[:-8] + struct.pack("<d", 1e-12 + struct.unpack("<d", data[-8:])[0])),
        ("/dermis/forces", lambda data: data[:-9] + struct.pack("<d", 1.0) + data[-1:]),
        ("/dermis/forces", lambda data: data[:-1] + b"\0"),
    ]
    for topic, change in changes:
        changed = rewrite(path, topic, change)
        # The comparison fails, or already the decoder, with exceptions of its own.
        with pytest.raises(Exception):
            check(changed, lines)


KINDS = {"64FC1": "f8", "32FC1": "f4", "8UC1": "u1", "mono8": "u1"}
KINDS |= {"16UC1": "u2", "mono16": "u2", "16SC1": "i2", "32SC1": "i4"}


@pytest.mark.parametrize(
    ("compression", "encodings"),
    [(CompressionType.NONE, KINDS), (CompressionType.ZSTD, ["32FC1"]), (CompressionType.LZ4, ["16UC1"])],
)
def test_images_of_other_recorders_are_replayed(
    tmp_path: Path, compression: CompressionType, encodings: Iterable[str]
) -> None:
    schema = get_typestore(Stores.ROS2_JAZZY).generate_msgdef("sensor_msgs/msg/Image", ros_version=2)[0]
    counts = np.array([[0, 1, 2], [100, 127, 5]])
    for encoding in encodings:
        kind = KINDS[encoding]
        for big in (False, True):
            path = tmp_path / f"{encoding}-{big}.mcap"
            pixels = counts.astype((">" if big else "<") + kind)
            # Rows are padded.
            data = b"".join(row.tobytes() + b"\7\7" for row in pixels)
            image = {"height": 2, "width": 3, "encoding": encoding, "is_bigendian": big, "data": data}
            image |= {"header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "pad"}, "step": len(data) // 2}
            with path.open("wb") as file:
                writer = RosWriter(file, compression=compression)
                definition = writer.register_msgdef("sensor_msgs/msg/Image", schema)
                writer.write_message("/tactile/left", definition, image)
                writer.finish()
            command = [os.environ["DERMIS"], "replay", str(path)]
            missing = "--topic"
            if encoding == "16UC1" or big:
                command += ["--topic", "/tactile/left"]
                missing = "--mpa-per-count"
            if kind[0] != "f" or missing == "--topic":
                refused = subprocess.run(command, capture_output=True, text=True, check=False)
                assert refused.returncode == 2 and missing in refused.stderr, refused.stderr
            command += [] if "--topic" in command else ["--topic", "/tactile/left"]
            done = subprocess.run([*command, "--mpa-per-count", "0.25"], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            scale = 1.0 if kind[0] == "f" else 0.25
            assert json.loads(done.stdout)["stress_MPa"] == (counts * scale).ravel().tolist(), (encoding, big)
