"""The topics of a node as other programs receive them: zenoh-ros2-sdk, a node of ROS 2 over Zenoh, and Zenoh's own subscribers with the
messages decoded by rosbags; every field against what `dermis reconstruct` says of the same frames."""

import math
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zenoh
import zenoh.ext
from conftest import COLS, PITCH_MM, ROWS, Node, expected, feed, frame, line, node, run, wait
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from zenoh_ros2_sdk import ROS2Publisher, ROS2Subscriber, discovery
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.qos import QosDurability, QosProfile, QosReliability
from zenoh_ros2_sdk.session import ZenohSession

MESSAGES = 1000
TYPES = {
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "contacts": "dermis_msgs/msg/Contacts",
    "arrows": "visualization_msgs/msg/MarkerArray",
    "forces": "sensor_msgs/msg/PointCloud2",
    "stress": "sensor_msgs/msg/Image",
}
STATE, PLACES, TEXT = "diagnostic_msgs/msg/DiagnosticArray", "tf2_msgs/msg/TFMessage", "std_msgs/msg/String"
PATCH = """
[[patch]]
name = "thumb"
scene = "scene.toml"
source = "thumb.pipe"
frame_id = "thumb_pad"
check_every = 0
forces = true
stress = true
pose = { parent = "palm", xyz_m = [0.01, -0.02, 0.03], rpy_rad = [0.1, -0.2, 0.3] }
"""
BEST_EFFORT = QosProfile(reliability=QosReliability.BEST_EFFORT, history_depth=1)
LATCHED = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=1)


@pytest.fixture(scope="module")
def messages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The definitions that the program writes."""
    folder = tmp_path_factory.mktemp("messages")
    run("DERMIS_ROS", "--messages", str(folder))
    return folder


@pytest.fixture(scope="module")
def store(messages: Path) -> Any:
    """The types of ROS 2, and those of Dermis from its definitions."""
    own = get_typestore(Stores.ROS2_JAZZY)
    for name in ("Contact", "Contacts"):
        text = (messages / "dermis_msgs/msg" / f"{name}.msg").read_text()
        own.register(get_types_from_msg(text, f"dermis_msgs/msg/{name}"))
    return own


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory, messages: Path) -> Iterator[Node]:
    """A node, and the session of zenoh-ros2-sdk, of which a program has one."""
    with node(tmp_path_factory.mktemp("node"), PATCH, 'namespace = "/hand"\ndomain = 7\nqueue = 64') as own:
        ZenohSession.get_instance("127.0.0.1", own.port)
        # Else it takes them from the network.
        get_registry().messages_dir = messages
        yield own
        ZenohSession.get_instance().close()


class Raw:
    """What a subscriber of Zenoh itself receives on a topic, with the attachments."""

    def __init__(self, session: zenoh.Session, key: str, history: bool = False) -> None:
        self.samples: list[zenoh.Sample] = []
        if history:
            config = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            self.own = zenoh.ext.declare_advanced_subscriber(session, key, self.samples.append, history=config)
        else:
            self.own = session.declare_subscriber(key, self.samples.append)

    def attachments(self) -> list[tuple[int, int, bytes]]:
        found = []
        for sample in self.samples:
            sequence, time_ns, length, gid = struct.unpack("<qqB16s", sample.attachment.to_bytes())
            assert length == 16
            found.append((sequence, time_ns, gid))
        return found


def key(store: Any, topic: str, kind: str) -> str:
    package, _, name = kind.split("/")
    return f"7/{topic.lstrip('/')}/{package}::msg::dds_::{name}_/{store.hash_rihs01(kind)}"


def session(own: Node) -> zenoh.Session:
    config = zenoh.Config()
    for option, value in [
        ("mode", '"peer"'),
        ("connect/endpoints", f'["tcp/127.0.0.1:{own.port}"]'),
        ("listen/endpoints", '["tcp/127.0.0.1:0"]'),
        ("scouting/multicast/enabled", "false"),
    ]:
        config.insert_json5(option, value)
    return zenoh.open(config)


def stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def vector(own: Any) -> list[float]:
    return [own.x, own.y, own.z]


def check_wrench(message: Any, result: dict[str, Any]) -> None:
    assert vector(message.wrench.force) == result["resultant_N"]
    assert vector(message.wrench.torque) == [1e-3 * moment for moment in result["wrench"]["moment_Nmm"]]


def check_contacts(message: Any, result: dict[str, Any]) -> None:
    assert (message.name, message.estimator, message.flags) == ("thumb", "search", result["flags"])
    (whole,) = result["subarrays"]
    present = "no-contact" not in result["flags"]
    assert len(message.contacts) == len(result.get("tracks", [])) == int(present)
    if present:
        (own,), (track,) = message.contacts, result["tracks"]
        x_mm, y_mm = whole["compression_centroid_mm"]
        assert vector(own.position) == [1e-3 * x_mm, 1e-3 * y_mm, 0.0]
        assert [*own.shear, own.normal_force] == result["resultant_N"]
        assert (own.number, own.age, own.load_ratio) == (track["number"], track["age"], track["load_ratio"])
        shear, normal = whole.get("shear_sigma_N", [math.nan] * 2), whole.get("normal_sigma_N", math.nan)
        assert np.array_equal(own.sigma, [*shear, normal], equal_nan=True)
        assert np.array_equal(own.load_ratio_sigma, track.get("load_ratio_sigma", math.nan), equal_nan=True)
        assert own.moving == {None: 0, False: 1, True: 2}[track.get("moving")]


def check_arrows(message: Any, result: dict[str, Any]) -> None:
    metres_per_N = 0.5e-3 * min(PITCH_MM) / (0.1 * PITCH_MM[0] * PITCH_MM[1])
    removed, *drawn = message.markers
    arrows = [own for own in drawn if own.ns == "contacts"]
    (lines,) = [own for own in drawn if own.ns == "taxels"]
    assert removed.action == 3 and len(arrows) == int("no-contact" not in result["flags"])
    ends = np.array([vector(point) for point in lines.points]).reshape(-1, 2, 3)
    forces = np.stack([result["forces_N"][axis] for axis in ("fx", "fy", "fz")], axis=1)
    assert np.allclose(ends[:, 1] - ends[:, 0], forces * metres_per_N, rtol=1e-9, atol=1e-15)
    for own in arrows:
        start, end = (np.array(vector(point)) for point in own.points)
        assert np.allclose(end - start, np.array(result["resultant_N"]) * metres_per_N, rtol=1e-9, atol=1e-15)


def check_forces(message: Any, result: dict[str, Any]) -> None:
    kinds = {7: "<f4", 8: "<f8"}
    point = np.dtype(
        {
            "names": [own.name for own in message.fields],
            "formats": [kinds[own.datatype] for own in message.fields],
            "offsets": [own.offset for own in message.fields],
            "itemsize": message.point_step,
        }
    )
    points = np.frombuffer(bytes(message.data), point)
    assert (message.height, message.width, len(points)) == (ROWS, COLS, ROWS * COLS)
    for axis in ("fx", "fy", "fz"):
        assert points[axis].tolist() == result["forces_N"][axis]


def check_stress(message: Any, number: int) -> None:
    assert (message.height, message.width, message.encoding) == (ROWS, COLS, "32FC1")
    assert np.array_equal(np.frombuffer(bytes(message.data), "<f4").reshape(ROWS, COLS), frame(number).astype("<f4"))


def check(topic: str, message: Any, results: dict[int, dict[str, Any]]) -> int:
    """Compares a message with the result of its frame; returns the number of the frame."""
    header = message.markers[0].header if topic == "arrows" else message.header
    assert header.frame_id == "thumb_pad"
    number = (stamp_ns(header) - 1_700_000_000_000_000_000) // 10_000_000
    result = results[stamp_ns(header)]
    checks = {"wrench": check_wrench, "contacts": check_contacts, "arrows": check_arrows, "forces": check_forces}
    check_stress(message, number) if topic == "stress" else checks[topic](message, result)
    return number


def change(topic: str, message: Any) -> None:
    """Changes one value by little."""
    if topic == "wrench":
        message.wrench.torque.x += 1e-9
    elif topic == "contacts":
        message.contacts[0].normal_force += 1e-9
    elif topic == "arrows":
        message.markers[-1].points[-1].z += 1e-4
    else:
        taxel, changed = 20, bytearray(message.data)
        inside = {"forces": lambda: next(own.offset for own in message.fields if own.name == "fz"), "stress": lambda: 0}
        step = message.point_step if topic == "forces" else 4
        changed[taxel * step + inside[topic]()] ^= 1
        message.data = np.frombuffer(bytes(changed), np.uint8)


def test_every_message_of_every_type_arrives_and_is_that_of_the_result(running: Node, store: Any) -> None:
    received: dict[str, list[Any]] = {topic: [] for topic in TYPES}
    places: list[Any] = []
    own = session(running)
    raw = {topic: Raw(own, key(store, f"/hand/thumb/{topic}", kind)) for topic, kind in TYPES.items()}
    state = Raw(own, key(store, "/diagnostics", STATE))
    # zenoh-ros2-sdk asks the cache of what is latched where the topic has no namespace.
    sdk = [ROS2Subscriber("/tf_static", PLACES, places.append, domain_id=7, qos=LATCHED)]
    for topic, kind in TYPES.items():
        name = f"/hand/thumb/{topic}"
        sdk.append(ROS2Subscriber(name, kind, received[topic].append, domain_id=7, qos=BEST_EFFORT))
        assert sdk[-1].type_hash == store.hash_rihs01(kind)
    lines = [line(number) for number in range(MESSAGES)]
    # The first frames bring the node and its subscribers together.
    feed(running.folder / "thumb.pipe", [line(-number) for number in range(40, 0, -1)], 20.0)
    wait(lambda: all(received[topic] and raw[topic].samples for topic in TYPES))
    feed(running.folder / "thumb.pipe", lines, 60.0, lambda: len(raw["wrench"].samples), 32)
    results = expected(running.folder / "scene.toml", "".join(line(number) for number in range(-40, MESSAGES)))
    wait(lambda: len(raw["wrench"].samples) >= MESSAGES)
    for topic, kind in TYPES.items():
        decoded = [store.deserialize_cdr(sample.payload.to_bytes(), kind) for sample in raw[topic].samples]
        for messages in (received[topic], decoded):
            numbers = [check(topic, message, results) for message in messages]
            counted = [number for number in numbers if number >= 0]
            assert len(set(counted)) == len(counted) >= 0.999 * MESSAGES, topic
            # The comparison finds one wrong value.
            pressed = next(message for message in messages if check_number(topic, message) == 500)
            change(topic, pressed)
            with pytest.raises(AssertionError):
                check(topic, pressed, results)
        assert len({gid for _, _, gid in raw[topic].attachments()}) == 1
    assert [transform.child_frame_id for message in places for transform in message.transforms] == ["thumb_pad"]
    # Every second frame changes a flag: reliable ones have no gap.
    sequence = [number for number, _, _ in state.attachments()]
    assert len(sequence) >= MESSAGES * 0.6 and sequence == list(range(sequence[0], sequence[0] + len(sequence)))
    statuses = [store.deserialize_cdr(own.payload.to_bytes(), STATE).status for own in state.samples]
    values = [{pair.key: pair.value for pair in own.values} for (own,) in statuses]
    touched = ["no-contact" not in own["flags"] for own in values]
    assert any(touched) and not all(touched) and {own.name for (own,) in statuses} == {"dermis: thumb"}
    assert values[-1]["dropped"] == "0" and int(values[-1]["results"]) > MESSAGES
    for subscriber in sdk:
        subscriber.close()
    own.close()


def check_number(topic: str, message: Any) -> int:
    header = message.markers[0].header if topic == "arrows" else message.header
    return (stamp_ns(header) - 1_700_000_000_000_000_000) // 10_000_000


def test_latched_topics_are_there_for_whoever_comes_later(running: Node, store: Any) -> None:
    own = session(running)
    places = key(store, "/tf_static", PLACES)
    scene = key(store, "/hand/thumb/scene", TEXT)
    for _ in range(10):
        late = [Raw(own, place, history=True) for place in (places, scene)]
        wait(lambda: all(one.samples for one in late))
        for one in late:
            one.own.undeclare()
    (transform,) = store.deserialize_cdr(late[0].samples[0].payload.to_bytes(), PLACES).transforms
    text = store.deserialize_cdr(late[1].samples[0].payload.to_bytes(), TEXT).data
    assert text == (running.folder / "scene.toml").read_text()
    assert (transform.header.frame_id, transform.child_frame_id) == ("palm", "thumb_pad")
    assert vector(transform.transform.translation) == [0.01, -0.02, 0.03]
    w, x, y, z = (getattr(transform.transform.rotation, name) for name in "wxyz")
    # Roll, pitch and yaw of that quaternion.
    angles = [
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(2 * (w * y - z * x)),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    ]
    assert np.allclose(angles, [0.1, -0.2, 0.3], atol=1e-12)
    # The cache answers each time: nothing of what is reliable is lost.
    for place in (places, scene):
        answers = [len(list(own.get(f"{place}/@adv/**?_anyke", timeout=5.0))) for _ in range(MESSAGES)]
        assert answers == [1] * MESSAGES
    own.close()


def test_tokens_name_the_topics_of_the_check(running: Node) -> None:
    table = run("DERMIS_ROS", str(running.file), "--check").stdout
    rows = [row.split() for row in table.splitlines()]
    wanted = {(row[1], row[2]) for row in rows}
    assert {(name, kind) for name, kinds in discovery.get_topic_names_and_types(7) for kind in kinds} == wanted
    quality = {"wrench": (2, 2, "1"), "scene": (1, 1, "1")}
    for topic, (reliability, durability, depth) in quality.items():
        info = discovery.get_topic_info(f"/hand/thumb/{topic}", 7, verbose=True)
        (own,) = info.publishers
        assert (own.node_name.strip("/"), own.node_namespace.strip("/")) == ("dermis", "hand")
        decoded = QosProfile.decode(own.qos)
        assert own.qos.startswith(f"{reliability}:{durability}:1,{depth}:")
        assert (decoded.reliability.value, decoded.durability.value) == (reliability, durability)


def test_types_have_the_published_hashes(store: Any, messages: Path, running: Node) -> None:
    """By rosbags, from its own definitions; of Dermis' types from those that the program writes."""
    own = session(running)
    tokens = [str(reply.ok.key_expr).split("/") for reply in own.liveliness().get("@ros2_lv/7/**", timeout=5.0)]
    hashes = {parts[10]: parts[11] for parts in tokens if len(parts) > 11}
    assert len(hashes) == 9
    for name, own_hash in hashes.items():
        package, _, _, kind = name.replace("::", "/").split("/")
        assert own_hash == store.hash_rihs01(f"{package}/msg/{kind.rstrip('_')}"), name
    own.close()


def test_tare_takes_the_zero_anew(running: Node, store: Any) -> None:
    own = session(running)
    wrench = Raw(own, key(store, "/hand/thumb/wrench", TYPES["wrench"]))

    def normal() -> float:
        return float(store.deserialize_cdr(wrench.samples[-1].payload.to_bytes(), TYPES["wrench"]).wrench.force.z)

    moved = frame(0) * 0 + 0.05
    feed(running.folder / "thumb.pipe", [line(2, moved)] * 20, 100.0)
    wait(lambda: len(wrench.samples) >= 10)
    assert normal() > 1.0
    tare = ROS2Publisher("/hand/thumb/tare", "std_msgs/msg/Empty", msg_definition="", domain_id=7)
    wait(lambda: tare.pub.matching_status.matching)
    tare.publish(structure_needs_at_least_one_member=0)
    # The message is there before the frames of the new zero.
    time.sleep(0.5)
    feed(running.folder / "thumb.pipe", [line(2, moved)] * 40, 100.0)
    running.wait_for("zero taken from 16 frames")
    assert abs(normal()) < 1e-9
    feed(running.folder / "thumb.pipe", [line(2, moved + frame(2))] * 20, 100.0)
    wanted = expected(running.folder / "scene.toml", line(2))
    wait(lambda: abs(normal() - next(iter(wanted.values()))["resultant_N"][2]) < 1e-6)
    tare.close()
    own.close()
