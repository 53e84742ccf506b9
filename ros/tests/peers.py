"""Other programs that take part in the node's network: over Zenoh eclipse-zenoh itself, over DDS Cyclone DDS. Messages are taken and given
as they are on the wire, in CDR; rosbags decodes them."""

import struct
import time
from functools import cache
from typing import Any, Protocol

import zenoh
import zenoh.ext
from conftest import Node, wait
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_typestore

# The types of ROS 2; tests add those of Dermis from its definitions.
STORE = get_typestore(Stores.ROS2_JAZZY)
EMPTY, EMPTY_CDR = "std_msgs/msg/Empty", b"\0\1\0\0\0"


def dds_type(kind: str) -> str:
    package, _, name = kind.split("/")
    return f"{package}::msg::dds_::{name}_"


def ros_type(kind: str) -> str:
    return kind.replace("dds_::", "").replace("::", "/").removesuffix("_")


class Received(Protocol):
    """What a subscriber has received."""

    @property
    def samples(self) -> list[bytes]: ...

    def lost(self) -> int:
        """Messages that did not arrive, between those that did."""

    def close(self) -> None: ...


class Peer(Protocol):
    """Another program."""

    def subscribe(self, topic: str, kind: str, reliable: bool = False, latched: bool = False) -> Received: ...

    def tare(self, topic: str) -> None:
        """Sends an empty message once there is a subscriber."""

    def close(self) -> None: ...


class Raw:
    """What a subscriber of Zenoh receives, with the attachments."""

    def __init__(self, session: zenoh.Session, key: str, history: bool) -> None:
        self.samples: list[bytes] = []
        self.attachments: list[bytes] = []
        if history:
            config = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            self.own = zenoh.ext.declare_advanced_subscriber(session, key, self.take, history=config)
        else:
            self.own = session.declare_subscriber(key, self.take)

    def take(self, sample: zenoh.Sample) -> None:
        self.attachments.append(sample.attachment.to_bytes())
        self.samples.append(sample.payload.to_bytes())

    def lost(self) -> int:
        attached = [struct.unpack("<qqB16s", own) for own in self.attachments]
        numbers = [number for number, _, _, _ in attached]
        assert {length for _, _, length, _ in attached} == {16} and len({gid for _, _, _, gid in attached}) == 1
        return max(numbers) - min(numbers) + 1 - len(numbers)

    def close(self) -> None:
        self.own.undeclare()


class ZenohPeer:
    """A session of Zenoh."""

    def __init__(self, node: Node) -> None:
        config = zenoh.Config()
        for option, value in [
            ("mode", '"peer"'),
            ("connect/endpoints", f'["tcp/127.0.0.1:{node.port}"]'),
            ("listen/endpoints", '["tcp/127.0.0.1:0"]'),
            ("scouting/multicast/enabled", "false"),
        ]:
            config.insert_json5(option, value)
        self.domain, self.session = node.domain, zenoh.open(config)

    def key(self, topic: str, kind: str) -> str:
        return f"{self.domain}/{topic.lstrip('/')}/{dds_type(kind)}/{STORE.hash_rihs01(kind)}"

    def subscribe(self, topic: str, kind: str, reliable: bool = False, latched: bool = False) -> Raw:
        return Raw(self.session, self.key(topic, kind), latched)

    def tare(self, topic: str) -> None:
        publisher = self.session.declare_publisher(self.key(topic, EMPTY))
        wait(lambda: publisher.matching_status.matching)
        publisher.put(EMPTY_CDR)
        publisher.undeclare()

    def close(self) -> None:
        self.session.close()


class Cdr(IdlStruct):
    """A message of which Cyclone DDS leaves the bytes as they are."""

    def __init__(self, cdr: bytes) -> None:
        self.cdr = cdr

    def serialize(self, **_: Any) -> bytes:
        return self.cdr

    @classmethod
    def deserialize(cls, data: bytes, **_: Any) -> "Cdr":
        return Cdr(data)


@cache
def cdr_of(kind: str) -> type[Cdr]:
    """A type of which Cyclone DDS has the name alone; it must live as long as Cyclone DDS."""
    return make_idl_struct(kind.rsplit("/", 1)[1], dds_type(kind), {"any": uint8}, dataclassify=False, bases=(Cdr,))


class Reader:
    """What a reader of Cyclone DDS receives, which forgets nothing."""

    def __init__(self, participant: DomainParticipant, topic: Topic, qos: Qos) -> None:
        self.missed, self.kept = 0, []
        self.own = DataReader(participant, topic, qos=qos, listener=Listener(on_sample_lost=self.miss))

    def miss(self, _: DataReader, status: Any) -> None:
        self.missed = status.total_count

    @property
    def samples(self) -> list[bytes]:
        self.kept += [bytes(own.cdr) for own in self.own.take(1 << 16) if isinstance(own, Cdr)]
        return self.kept

    def lost(self) -> int:
        return self.missed

    def close(self) -> None:
        del self.own


# Ports that their standard gives to this computer's processes, no multicast: as ROS 2 with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
CYCLONE = """<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast>
<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""


class DdsPeer:
    """A participant of Cyclone DDS."""

    def __init__(self, node: Node) -> None:
        self.domain = Domain(node.domain, CYCLONE)
        self.participant = DomainParticipant(node.domain)
        self.topics: dict[str, Topic] = {}

    def topic(self, name: str, kind: str, reliable: bool, latched: bool) -> tuple[Topic, Qos]:
        qos = Qos(
            Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
            Policy.History.KeepAll,
            Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        )
        if name not in self.topics:
            self.topics[name] = Topic(self.participant, f"rt{name}" if name.startswith("/") else name, cdr_of(kind))
        return self.topics[name], qos

    def subscribe(self, topic: str, kind: str, reliable: bool = False, latched: bool = False) -> Reader:
        return Reader(self.participant, *self.topic(topic, kind, reliable or latched, latched))

    def tare(self, topic: str) -> None:
        own, qos = self.topic(topic, EMPTY, True, False)
        writer = DataWriter(self.participant, own, qos=qos)
        wait(writer.get_matched_subscriptions)
        writer.write(own.data_type(EMPTY_CDR))
        # It is sent before the writer goes.
        time.sleep(0.5)

    def endpoints(self) -> dict[bytes, tuple[str, str, Qos]]:
        """Identities of the writers and readers of others, with topic, type and quality."""
        found = [one for topic in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription) for one in self.builtin(topic)]
        own = self.participant.guid.bytes[:12]
        return {one.key.bytes: (one.topic_name, one.type_name, one.qos) for one in found if one.key.bytes[:12] != own}

    def builtin(self, topic: Any) -> list[Any]:
        return BuiltinDataReader(self.participant, topic).take(1 << 16)

    def close(self) -> None:
        del self.topics, self.participant, self.domain


PEERS: dict[str, type[Peer]] = {"zenoh": ZenohPeer, "dds": DdsPeer}
