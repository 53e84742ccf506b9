"""The topics of a node as other programs receive them over each carrier, with the messages decoded by rosbags; every field against what
`dermis reconstruct` says of the same frames."""

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import COLS, PITCH_MM, ROWS, Node, expected, feed, frame, line, node, run, wait
from cyclonedds.core import Policy
from peers import PEERS, STORE, DdsPeer, Peer, ZenohPeer, ros_type
from rosbags.typesys import get_types_from_msg
from zenoh_ros2_sdk import ROS2Subscriber, discovery
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
GRAPH = "rmw_dds_common/msg/ParticipantEntitiesInfo"
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


@pytest.fixture(scope="module", params=PEERS)
def running(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, messages: Path) -> Iterator[Node]:
    """A node over each carrier; over Zenoh with the session of zenoh-ros2-sdk, of which a program has one."""
    for name in ("Contact", "Contacts"):
        text = (messages / "dermis_msgs/msg" / f"{name}.msg").read_text()
        STORE.register(get_types_from_msg(text, f"dermis_msgs/msg/{name}"))
    with node(tmp_path_factory.mktemp("node"), PATCH, 'namespace = "/hand"\nqueue = 64', request.param) as own:
        if own.carrier == "zenoh":
            ZenohSession.get_instance("127.0.0.1", own.port)
            # Else it takes them from the network.
            get_registry().messages_dir = messages
        yield own
        if own.carrier == "zenoh":
            ZenohSession.get_instance().close()


@pytest.fixture
def peer(running: Node) -> Iterator[Peer]:
    own = PEERS[running.carrier](running)
    yield own
    own.close()


@pytest.fixture
def sdk(running: Node) -> Iterator[dict[str, list[Any]]]:
    """What subscribers of zenoh-ros2-sdk receive, a node of ROS 2 over Zenoh; over DDS there is none."""
    received: dict[str, list[Any]] = {}
    subscribers = []
    if running.carrier == "zenoh":
        # It asks the cache of what is latched where the topic has no namespace.
        topics = {"/tf_static": (PLACES, LATCHED)} | {f"/hand/thumb/{topic}": (kind, BEST_EFFORT) for topic, kind in TYPES.items()}
        for topic, (kind, qos) in topics.items():
            own = received[topic.rsplit("/", 1)[1]] = []
            subscribers.append(ROS2Subscriber(topic, kind, own.append, domain_id=running.domain, qos=qos))
            assert subscribers[-1].type_hash == STORE.hash_rihs01(kind)
    yield received
    for subscriber in subscribers:
        subscriber.close()


over_zenoh = pytest.mark.parametrize("running", ["zenoh"], indirect=True)
over_dds = pytest.mark.parametrize("running", ["dds"], indirect=True)


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


def decoded(samples: list[bytes], kind: str) -> list[Any]:
    return [STORE.deserialize_cdr(cdr, kind) for cdr in samples]


def test_every_message_of_every_type_arrives_and_is_that_of_the_result(running: Node, peer: Peer, sdk: dict[str, list[Any]]) -> None:
    raw = {topic: peer.subscribe(f"/hand/thumb/{topic}", kind) for topic, kind in TYPES.items()}
    state = peer.subscribe("/diagnostics", STATE, reliable=True)
    lines = [line(number) for number in range(MESSAGES)]
    # The first frames bring the node and its subscribers together.
    feed(running.folder / "thumb.pipe", [line(-number) for number in range(40, 0, -1)], 20.0)
    wait(lambda: all(raw[topic].samples for topic in TYPES) and all(sdk.values()))
    feed(running.folder / "thumb.pipe", lines, 60.0, lambda: len(raw["wrench"].samples), 32)
    results = expected(running.folder / "scene.toml", "".join(line(number) for number in range(-40, MESSAGES)))
    wait(lambda: len(raw["wrench"].samples) >= MESSAGES)
    for topic, kind in TYPES.items():
        for messages in (decoded(raw[topic].samples, kind), sdk.get(topic)):
            if messages is None:
                continue
            numbers = [check(topic, message, results) for message in messages]
            counted = [number for number in numbers if number >= 0]
            assert len(set(counted)) == len(counted) >= 0.999 * MESSAGES, topic
            # The comparison finds one wrong value.
            pressed = next(message for message in messages if check_number(topic, message) == 500)
            change(topic, pressed)
            with pytest.raises(AssertionError):
                check(topic, pressed, results)
    assert all([own.child_frame_id for own in message.transforms] == ["thumb_pad"] for message in sdk.get("tf_static", []))
    # Every second frame changes a flag: reliable ones have no gap.
    assert len(state.samples) >= MESSAGES * 0.6 and state.lost() == 0
    statuses = [array.status for array in decoded(state.samples, STATE)]
    values = [{pair.key: pair.value for pair in own.values} for (own,) in statuses]
    touched = ["no-contact" not in own["flags"] for own in values]
    assert any(touched) and not all(touched) and {own.name for (own,) in statuses} == {"dermis: thumb"}
    assert values[-1]["dropped"] == "0" and int(values[-1]["results"]) > MESSAGES


def check_number(topic: str, message: Any) -> int:
    header = message.markers[0].header if topic == "arrows" else message.header
    return (stamp_ns(header) - 1_700_000_000_000_000_000) // 10_000_000


def test_latched_topics_are_there_for_whoever_comes_later(running: Node, peer: Peer) -> None:
    latched = {"/tf_static": PLACES, "/hand/thumb/scene": TEXT}
    for _ in range(MESSAGES):
        late = [peer.subscribe(topic, kind, latched=True) for topic, kind in latched.items()]
        wait(lambda late=late: all(own.samples for own in late))
        (places,), (scene,) = (own.samples for own in late)
        for own in late:
            own.close()
    (transform,) = STORE.deserialize_cdr(places, PLACES).transforms
    assert STORE.deserialize_cdr(scene, TEXT).data == (running.folder / "scene.toml").read_text()
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


def topics_of_the_check(running: Node) -> set[tuple[str, str]]:
    """Names and types."""
    rows = [row.split() for row in run("DERMIS_ROS", str(running.file), "--check").stdout.splitlines()]
    return {(row[1], row[2]) for row in rows}


@over_zenoh
def test_tokens_name_the_topics_of_the_check(running: Node) -> None:
    found = discovery.get_topic_names_and_types(running.domain)
    assert {(name, kind) for name, kinds in found for kind in kinds} == topics_of_the_check(running)
    quality = {"wrench": (2, 2, "1"), "scene": (1, 1, "1")}
    for topic, (reliability, durability, depth) in quality.items():
        info = discovery.get_topic_info(f"/hand/thumb/{topic}", running.domain, verbose=True)
        (own,) = info.publishers
        assert (own.node_name.strip("/"), own.node_namespace.strip("/")) == ("dermis", "hand")
        decoded = QosProfile.decode(own.qos)
        assert own.qos.startswith(f"{reliability}:{durability}:1,{depth}:")
        assert (decoded.reliability.value, decoded.durability.value) == (reliability, durability)


@over_zenoh
def test_types_have_the_published_hashes(running: Node) -> None:
    """By rosbags, from its own definitions; of Dermis' types from those that the program writes."""
    own = ZenohPeer(running)
    found = own.session.liveliness().get(f"@ros2_lv/{running.domain}/**", timeout=5.0)
    tokens = [str(reply.ok.key_expr).split("/") for reply in found]
    hashes = {parts[10]: parts[11] for parts in tokens if len(parts) > 11}
    assert len(hashes) == 9
    for name, own_hash in hashes.items():
        package, _, _, kind = name.replace("::", "/").split("/")
        assert own_hash == STORE.hash_rihs01(f"{package}/msg/{kind.rstrip('_')}"), name
    own.close()


@over_dds
def test_the_node_and_its_topics_are_found_on_dds(running: Node) -> None:
    """By Cyclone DDS: names, types and qualities of writers and readers, and that the node says which are its own."""
    own = DdsPeer(running)
    graph = own.subscribe("ros_discovery_info", GRAPH, latched=True)
    wait(lambda: graph.samples and len(own.endpoints()) == len(topics_of_the_check(running)) + 1)
    found = own.endpoints()
    (said,) = decoded(graph.samples, GRAPH)
    (one,) = said.node_entities_info_seq
    assert (one.node_namespace, one.node_name) == ("/hand", "dermis")
    gids = {bytes(gid.data) for gid in [*one.reader_gid_seq, *one.writer_gid_seq]}
    assert gids == {gid for gid, (name, _, _) in found.items() if name.startswith("rt/")}
    assert {bytes(said.gid.data[:12])} == {gid[:12] for gid in found}
    topics = {(name.removeprefix("rt"), ros_type(kind)) for name, kind, _ in found.values() if name.startswith("rt/")}
    assert topics == topics_of_the_check(running)
    reliable = {name: qos[Policy.Reliability] != Policy.Reliability.BestEffort for name, _, qos in found.values()}
    latched = {name: qos[Policy.Durability] == Policy.Durability.TransientLocal for name, _, qos in found.values()}
    quality = {name.removeprefix("rt/hand/thumb/"): (reliable[name], latched[name]) for name in reliable}
    assert quality["wrench"] == quality["contacts"] == (False, False)
    assert quality["scene"] == quality["rt/tf_static"] == quality["ros_discovery_info"] == (True, True)
    assert quality["rt/diagnostics"] == quality["tare"] == (True, False)
    own.close()


def test_tare_takes_the_zero_anew(running: Node, peer: Peer) -> None:
    wrench = peer.subscribe("/hand/thumb/wrench", TYPES["wrench"])

    def normal() -> float:
        return float(decoded(wrench.samples[-1:], TYPES["wrench"])[0].wrench.force.z)

    moved = frame(0) * 0 + 0.05
    feed(running.folder / "thumb.pipe", [line(2, moved)] * 20, 100.0)
    wait(lambda: len(wrench.samples) >= 10)
    assert normal() > 1.0
    peer.tare("/hand/thumb/tare")
    # The message is there before the frames of the new zero.
    time.sleep(0.5)
    feed(running.folder / "thumb.pipe", [line(2, moved)] * 40, 100.0)
    running.wait_for("zero taken from 16 frames")
    assert abs(normal()) < 1e-9
    feed(running.folder / "thumb.pipe", [line(2, moved + frame(2))] * 20, 100.0)
    wanted = expected(running.folder / "scene.toml", line(2))
    wait(lambda: abs(normal() - next(iter(wanted.values()))["resultant_N"][2]) < 1e-6)
