"""Frames and results as the payloads of UDP packets: the format, and a host's side of it.

All numbers are little-endian.

| word of 32 bits | bits | meaning |
|---|---|---|
| 0 | 7:0 | the kind, `KIND_…` below |
| | 15:8 | flags |
| | 23:16 | index of the fragment |
| | 31:24 | number of fragments |
| 1 | | sequence number, chosen by the host; an answer has that of what it answers |
| of a result 2, 3 | | cycles of the core's clock since its reset when the frame's first code entered it, low word first |
| 2 or 4 … | | `FRAGMENT_WORDS` words of the payload; of the last fragment the rest |
| last | | CRC-32 of the words before it, as of Ethernet |

| kind | from | payload | flags |
|---|---|---|---|
| `FRAME` | host | codes, row-major | bits 7:4: the array, in every fragment |
| `RESULT` | core | words of forces and status | bit 0: a code was clipped |
| `SHORT_RESULT` | core | mantissas of forces, two in a word | bit 0 as above, bit 1: the last mantissa is none, bits 7:3: exponent |
| `IDENTIFY` | host | none | bits 7:4: the array whose counters are asked for |
| `IDENTITY` | core | the words of `IDENTITY`, in this order | |
| `TABLES` | host | bytes of an image, as `dermis load` makes one | bits 7:4 as above; bits 1:0: bytes of the last word that are none |
| `TABLES_TAKEN` | core | none: the fragment of this index is in the core | |

Fragments of a frame may come in any order and more than once. Of a frame that lacks one when the next begins, nothing is
solved. A sequence number that is at most `LATE` older than the newest of its array is late, and its packets are ignored. A packet whose
CRC-32 is wrong counts as lost: LiteEth does not compare UDP's checksum, and Ethernet's guards one cable only.

Each array of a core may have a host of its own. Frames of one packet may come from all of them at once; of frames of several
packets, those of one frame must come before the next one's.

A host sends a fragment of an image once the one before is taken, all with one sequence number, and again if no answer comes; the
first fragment of another number or array begins anew. Whether the image is whole, the status of the next result says. Meanwhile the core
takes no frames: their packets are lost, and counted.

An identity has the time at which it was asked for: with the times of question and answer a host knows how the core's clock and
its own differ. The counters are those of `dermis_litex.udp.FrameReceiver`, of the array that the question names.

A core of short forces sends them as mantissas of 16 bits, two in a word, the first in its low half, with one exponent per packet:
a force is about mantissa · 2^exponent. The packets of status are `RESULT`. With the largest force F of the packet, by its
absolute value, the error is at most 2^(exponent − 1), and less than F · (2^-15 + 2^-29). No mantissa saturates.

The numbers of the format are in `packets.json`, which `dermis` reads too.
"""

import json
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

LAYOUT = json.loads(Path(__file__).with_name("packets.json").read_text(encoding="utf-8"))
VERSION = LAYOUT["version"]
UDP_PORT = LAYOUT["udp_port"]
KIND_FRAME = LAYOUT["kind_frame"]
KIND_RESULT = LAYOUT["kind_result"]
KIND_SHORT_RESULT = LAYOUT["kind_short_result"]
KIND_IDENTIFY = LAYOUT["kind_identify"]
KIND_IDENTITY = LAYOUT["kind_identity"]
KIND_TABLES = LAYOUT["kind_tables"]
KIND_TABLES_TAKEN = LAYOUT["kind_tables_taken"]
HEADER_WORDS = LAYOUT["header_words"]
RESULT_HEADER_WORDS = LAYOUT["result_header_words"]
CHECK_WORDS = LAYOUT["check_words"]
# 1440 bytes: with the headers of UDP, IP and Ethernet less than 1500.
FRAGMENT_WORDS = LAYOUT["fragment_words"]
LATE = LAYOUT["late"]
ARRAY_AT = LAYOUT["array_at"]
IDENTITY = LAYOUT["identity"]
FLAG_CLIPPED = 1
FLAG_PADDED = 2
EXPONENT_AT = 3
MANTISSA_BITS = 16
WORD_BYTES = 4
BYTE = 8


def fragment_words(words):
    """Words of each fragment of a payload of `words` words."""
    counts = [FRAGMENT_WORDS] * (words // FRAGMENT_WORDS)
    rest = words % FRAGMENT_WORDS
    return counts + [rest] if rest else counts


def code_words(taxels, code_bytes):
    """Words of a frame of codes of 2 or 4 bytes."""
    return -(-taxels * code_bytes // 4)


def packets(kind, sequence, words, flags=0, array=0):
    """The packets of a payload, each as bytes; `flags` are those of the last one, `array` is in all of them."""
    counts = fragment_words(len(words))
    result = []
    for index, count in enumerate(counts):
        payload = words[index * FRAGMENT_WORDS :][:count]
        own = array << ARRAY_AT | (flags if index == len(counts) - 1 else 0)
        head = kind | own << 8 | index << 16 | len(counts) << 24
        result.append(checked(struct.pack(f"<{HEADER_WORDS + count}I", head, sequence, *payload)))
    return result


def checked(packet):
    """A packet with its CRC-32."""
    return packet + zlib.crc32(packet).to_bytes(CHECK_WORDS * WORD_BYTES, "little")


def unchecked(packet):
    """A packet without its CRC-32, None if that is wrong."""
    end = len(packet) - CHECK_WORDS * WORD_BYTES
    return packet[:end] if end >= 0 and checked(packet[:end]) == packet else None


def frame_packets(sequence, codes, code_bytes=2, array=0):
    """The packets of a frame of signed codes of an array, row-major."""
    form = {2: "h", 4: "i"}[code_bytes]
    data = struct.pack(f"<{len(codes)}{form}", *codes)
    data += bytes(-len(data) % 4)
    return packets(KIND_FRAME, sequence, struct.unpack(f"<{len(data) // 4}I", data), array=array)


def identify_packet(sequence, array=0):
    """The question for a core's identity, with the counters of an array."""
    return checked(struct.pack(f"<{HEADER_WORDS}I", KIND_IDENTIFY | array << BYTE + ARRAY_AT | 1 << 24, sequence))


def tables_packets(sequence, image, array=0):
    """The packets of an image of tables of an array."""
    empty = -len(image) % WORD_BYTES
    words = struct.unpack(f"<{(len(image) + empty) // WORD_BYTES}I", image + bytes(empty))
    return packets(KIND_TABLES, sequence, words, empty, array)


class Result(NamedTuple):
    """A result of a core: words of forces and status, flags, and the cycle in which the frame's first code entered the core."""

    sequence: int
    words: list
    flags: int
    time: int


def exponent_of(forces):
    """The exponent of a packet with these forces, signed integers of 32 bits.

    The smallest with which the largest force fits, and still does when it is rounded up: what is added to it is at least half of 2^exponent.
    """
    sizes = 0
    for force in forces:
        size = force if force >= 0 else ~force
        sizes |= size + (size >> MANTISSA_BITS - 1)
    return max(sizes.bit_length() - (MANTISSA_BITS - 1), 0)


def mantissa_of(force, exponent):
    """The nearest mantissa; of two the upper one."""
    return (force + (1 << exponent >> 1)) >> exponent


def short_counts(force_words, other_words):
    """Words of each fragment of a short result, and how many of the fragments have mantissas."""
    short = fragment_words(-(-force_words // 2))
    return short + fragment_words(other_words), len(short)


def forces_of(words, flags):
    """The forces of a packet of mantissas, as words of 32 bits."""
    exponent = flags >> EXPONENT_AT
    mantissas = struct.unpack(f"<{2 * len(words)}h", struct.pack(f"<{len(words)}I", *words))
    # A force near 2^31 that was rounded up.
    forces = [min(mantissa << exponent, 2**31 - 1) % 2**32 for mantissa in mantissas]
    return forces[:-1] if flags & FLAG_PADDED else forces


class Results:
    """Puts results together from their packets, in any order; short forces are words of 32 bits again."""

    def __init__(self):
        self.fragments = {}

    def add(self, packet):
        """Takes a packet; a `Result` once one is complete, else None. Other and damaged packets are ignored."""
        packet = unchecked(packet)
        if packet is None or len(packet) < WORD_BYTES * RESULT_HEADER_WORDS or len(packet) % WORD_BYTES:
            return None
        head, sequence, low, high, *words = struct.unpack(f"<{len(packet) // WORD_BYTES}I", packet)
        kind, flags, index, count = head.to_bytes(4, "little")
        if kind not in (KIND_RESULT, KIND_SHORT_RESULT) or index >= count:
            return None
        if kind == KIND_SHORT_RESULT:
            words = forces_of(words, flags)
        # A result that lacks a packet is given up once it is old.
        self.fragments = {key: own for key, own in self.fragments.items() if (sequence - key) % 2**32 <= LATE}
        own = self.fragments.setdefault(sequence, {})
        own[index] = words
        if len(own) < count:
            return None
        del self.fragments[sequence]
        whole = [word for index in range(count) for word in own[index]]
        return Result(sequence, whole, flags & FLAG_CLIPPED, low | high << 32)


def answer_of(packet):
    """What a core answers to a question or to tables: its kind, sequence number, index and words; None for any other packet."""
    packet = unchecked(packet)
    if packet is None or len(packet) < WORD_BYTES * HEADER_WORDS or len(packet) % WORD_BYTES:
        return None
    head, sequence, *words = struct.unpack(f"<{len(packet) // WORD_BYTES}I", packet)
    kind, _, index, _ = head.to_bytes(4, "little")
    return (kind, sequence, index, words) if kind in (KIND_IDENTITY, KIND_TABLES_TAKEN) else None
