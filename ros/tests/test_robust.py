"""Patches that stall, flood, send rubbish or fail harm no other, and what is wrong in a patch file is said."""

import os
import random
import socket
import subprocess
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from conftest import COLS, PATIENCE_S, ROWS, SCENE, feed, line, node, run, wait
from peers import PEERS, STORE, DdsPeer, ZenohPeer
from test_topics import STATE, TYPES

PATCHES = "".join(
    f'[[patch]]\nname = "{name}"\nscene = "scene.toml"\nsource = "{source}"\ncheck_every = 0\n'
    for name, source in [
        ("good", "good.pipe"),
        ("flood", "flood.pipe"),
        ("rubbish", "rubbish.pipe"),
        ("stalled", "stalled.pipe"),
        ("absent", "serial:no-such-port"),
        ("again", "again.pipe"),
    ]
)
FLOOD = 10**6
FRAMES = 300
PACKETS = 20_000


def values(status: object) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


@pytest.mark.parametrize("carrier", PEERS)
def test_a_patch_that_floods_stalls_or_sends_rubbish_harms_no_other(tmp_path: Path, carrier: str) -> None:
    with node(tmp_path, PATCHES, "queue = 8", carrier) as own:
        peer = PEERS[carrier](own)
        wrench = {name: peer.subscribe(f"/{name}/wrench", TYPES["wrench"]) for name in ("good", "flood", "again")}
        state = peer.subscribe("/diagnostics", STATE, reliable=True)
        feed(tmp_path / "good.pipe", [line(0)] * 20, 50.0)
        wait(lambda: wrench["good"].samples)
        before = len(wrench["good"].samples)

        def flood() -> None:
            with (tmp_path / "flood.pipe").open("w") as file:
                text = (",".join(["0"] * ROWS * COLS) + "\n") * 100
                for _ in range(FLOOD // 100):
                    file.write(text)

        def rubbish() -> None:
            with (tmp_path / "rubbish.pipe").open("wb") as file:
                noise = bytes((7 * k * k + k // 3) % 256 for k in range(1 << 16))
                for _ in range(100):
                    file.write(noise)
                file.write(b"1," * (1 << 20))

        def stall() -> None:
            with (tmp_path / "stalled.pipe").open("w") as file:
                file.write(line(0)[:40])
                file.flush()
                done.wait()

        done = threading.Event()
        others = [threading.Thread(target=one, daemon=True) for one in (flood, rubbish, stall)]
        for one in others:
            one.start()
        feed(tmp_path / "good.pipe", [line(number) for number in range(FRAMES)], 50.0, lambda: len(wrench["good"].samples), 4)
        wait(lambda: len(wrench["good"].samples) - before >= FRAMES)
        assert len(wrench["good"].samples) - before == FRAMES
        others[0].join(120.0)
        assert not others[0].is_alive() and wrench["flood"].samples
        # A source that ends is opened again, and the patch goes on.
        for number in range(1, 4):
            feed(tmp_path / "again.pipe", [line(2)] * 10, 20.0)
            wait(lambda number=number: sum("again: the source has ended" in said for said in own.said) == number)
        wait(lambda: len(wrench["again"].samples) >= 25)
        done.set()

        def report() -> dict[str, object]:
            """The newest report of all patches from now on."""
            before = len(state.samples)
            while True:
                wait(lambda: len(state.samples) > before)
                array = STORE.deserialize_cdr(state.samples[before], STATE)
                if len(array.status) == 6:
                    return {one.name.removeprefix("dermis: "): one for one in array.status}
                before += 1

        found = report()
        flooded = values(found["flood"])
        assert int(flooded["results"]) + int(flooded["dropped"]) <= FLOOD and int(flooded["dropped"]) > FLOOD // 2
        assert int(values(found["rubbish"])["refused"]) > 100 and "results" in values(found["rubbish"])
        assert found["absent"].level == 2 and "no-such-port" in found["absent"].message
        assert values(found["good"])["dropped"] == "0" and int(values(found["again"])["source opened"]) >= 3
        peer.close()
    assert any("absent" in said and "tried again" in said for said in own.said)


def spoiled(packet: bytes, chance: random.Random) -> bytes:
    """A packet with some other bytes, perhaps cut, perhaps as if from another process."""
    own = bytearray(packet)
    for _ in range(chance.choice([0, 1, 2, 8, 50])):
        own[chance.randrange(len(own))] = chance.choice([0, 1, 0x7F, 0xFF, chance.randrange(256)])
    if chance.random() < 0.5:
        own[8:20] = chance.randbytes(12)
    return bytes(own[: chance.randrange(1, len(own) + 1)] if chance.random() < 0.2 else own)


def test_packets_that_are_none_of_dds_harm_no_message(tmp_path: Path) -> None:
    """Sent to all its ports; they are made of those that the node and Cyclone DDS announce themselves with."""
    with node(tmp_path, '[[patch]]\nname = "a"\nscene = "scene.toml"\nsource = "a.pipe"\ncheck_every = 0\n', "queue = 8", "dds") as own:
        # As the sixth process of this computer, to whose port every other one announces itself.
        ports, chance = 7400 + 250 * own.domain, random.Random(1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.bind(("127.0.0.1", ports + 10 + 2 * 5))
            sender.settimeout(PATIENCE_S)
            peer, packets = DdsPeer(own), []
            while len({len(packet) for packet in packets}) < 2:
                packets.append(sender.recv(1 << 16))
            for number in range(PACKETS):
                sender.sendto(spoiled(chance.choice(packets), chance), ("127.0.0.1", ports + chance.choice([0, 1, 10, 11])))
                # So that they are read.
                time.sleep(0.01 if number % 50 == 0 else 0.0)
        wrench = peer.subscribe("/a/wrench", TYPES["wrench"])
        feed(tmp_path / "a.pipe", [line(0)] * 20, 50.0)
        wait(lambda: wrench.samples)
        before = len(wrench.samples)
        feed(tmp_path / "a.pipe", [line(number) for number in range(100)], 50.0, lambda: len(wrench.samples), 4)
        wait(lambda: len(wrench.samples) - before >= 100)
        peer.close()


def test_a_core_behind_ethernet_that_dies_harms_no_other(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    patch = '[[patch]]\nname = "{0}"\nscene = "scene.toml"\nsource = "{0}.pipe"\n'
    with ExitStack() as stack:
        cores = {}
        for name in ("whole", "dying"):
            command = [os.environ["DERMIS"], "board", str(scene), "--udp", "127.0.0.1:0"]
            core = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True))
            stack.callback(core.kill)
            assert core.stdout is not None
            cores[name] = core, core.stdout.readline().strip()
        patches = "".join(patch.format(name) + f'board = "{port}"\n' for name, (_, port) in cores.items())
        own = stack.enter_context(node(tmp_path, patches + patch.format("computed") + 'engine = "fixed"\n'))
        peer = ZenohPeer(own)
        stack.callback(peer.close)
        wrench = {name: peer.subscribe(f"/{name}/wrench", TYPES["wrench"]) for name in (*cores, "computed")}
        feed(tmp_path / "dying.pipe", [line(number) for number in range(20)], 20.0)
        wait(lambda: wrench["dying"].samples)
        cores["dying"][0].kill()
        failing = threading.Thread(target=feed, args=(tmp_path / "dying.pipe", [line(number) for number in range(80)], 20.0), daemon=True)
        failing.start()
        for name in ("whole", "computed"):
            samples = wrench[name].samples
            feed(tmp_path / f"{name}.pipe", [line(0)] * 20, 50.0)
            wait(lambda samples=samples: samples)
            before = len(samples)
            feed(tmp_path / f"{name}.pipe", [line(number) for number in range(100)], 50.0, lambda samples=samples: len(samples), 4)
            wait(lambda samples=samples, before=before: len(samples) - before >= 100)
            assert len(samples) - before == 100, name
        own.wait_for("no answer to frame_for_forces")
        failing.join(60.0)


def refused(tmp_path: Path, text: str) -> str:
    (tmp_path / "scene.toml").write_text("[sensor]\nrows = 2\ncols = 2\npitch_x_mm = 4\npitch_y_mm = 4\nthickness_mm = 3\n")
    path = tmp_path / "hand.toml"
    path.write_text(text)
    error = run("DERMIS_ROS", str(path), "--check", code=2).stderr
    assert error.startswith(f"error: {path}: "), error
    return error.removeprefix(f"error: {path}: ").strip()


def test_what_is_wrong_in_a_patch_file_is_said_with_field_and_value(tmp_path: Path) -> None:
    patch = '[[patch]]\nname = "a"\nscene = "scene.toml"\nsource = "-"\n'
    cases = {
        "": "patch = 0 patches is not allowed; it must be 1 to 1024 of [[patch]]",
        "[node": "line 1: ",
        '[node]\ntitle = "x"\n' + patch: "line 2, node.title: unknown field title; there are name, namespace",
        "[node]\ndomain = 300\n" + patch: "node.domain = 300 is not allowed; it must be 0 to 232",
        "[node]\nrate_Hz = 0\n" + patch: "node.rate_Hz = 0 is not allowed; it must be a number above 0",
        '[node]\ncarrier = "mqtt"\n' + patch: 'line 2, node.carrier: "mqtt" where zenoh or dds is wanted',
        "[node]\ninterfaces = []\n" + patch: "node.interfaces = [] is not allowed; it must be a list of addresses",
        '[node]\ninterfaces = ["lo"]\n' + patch: "line 2, node.interfaces[0]: ",
        '[node]\nlisten = ["udp/1.2.3.4:5"]\n' + patch: 'node.listen = "udp/1.2.3.4:5" is not allowed; it must be a list of',
        patch.replace('"a"', '"9a"'): 'patch[0].name = "9a" is not allowed; it must be letters, digits and underscores',
        patch + patch: 'patch[1].name = "a" is not allowed; it must be another one than that of patch[0]',
        patch + patch.replace('"a"', '"b"'): 'patch[1].source = "-" is not allowed; it must be another one than',
        patch.replace("scene.toml", "none.toml"): "patch[0].scene: ",
        patch + 'estimator = "best"\n': 'patch[0].estimator = "best" is not allowed; it must be "search", "evidence"',
        patch + 'engine = "rtl"\n': 'patch[0]: engine = "rtl" is not allowed; it must be "golden" or "fixed"',
        patch + 'pose = { xyz_m = [0, 1] }\n': "patch[0].pose.xyz_m",
        patch + "pose = { rpy_rad = [0, nan, 0] }\n": "patch[0].pose = NaN is not allowed; it must be finite numbers",
        patch.replace('"-"', '"udp://9000"'): "patch[0].source = ",
        '[[patch]]\nname = "a"\nsource = "-"\n': "scene is missing",
    }
    for text, wanted in cases.items():
        assert wanted in refused(tmp_path, text), (text, refused(tmp_path, text))
    assert run("DERMIS_ROS", str(tmp_path / "none.toml"), code=2).stderr.startswith(f"error: {tmp_path / 'none.toml'}: ")


def test_an_address_that_is_taken_is_said(tmp_path: Path) -> None:
    with node(tmp_path, '[[patch]]\nname = "a"\nscene = "scene.toml"\nsource = "a.pipe"\n') as first:
        error = run("DERMIS_ROS", str(first.file), code=2).stderr
        assert "node.listen" in error and str(first.port) in error
        # One that this computer does not have: of those that documentation may use.
        first.file.write_text(first.file.read_text().replace("[node]", '[node]\ninterfaces = ["127.0.0.1", "198.51.100.1"]'))
        error = run("DERMIS_ROS", str(first.file), "--carrier", "dds", code=2).stderr
        assert error.startswith("error: node.interfaces = 198.51.100.1: "), error


def test_a_recording_is_published_at_its_pace_and_ends_the_node(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    run("DERMIS", "generate", "eight-by-eight", "--press", "hold", "--rate", "10", "--duration", "2", "--out", str(tmp_path / "press.mcap"))
    file = tmp_path / "hand.toml"
    file.write_text('[node]\nconnect = []\n[[patch]]\nname = "a"\nscene = "eight-by-eight"\nsource = "press.mcap"\nestimator = "search"\n')
    assert not scene.exists()
    said = run("DERMIS_ROS", str(file)).stderr
    assert "a: 21 results; 0 lines refused, 0 dropped" in said, said
    file.write_text(file.read_text().replace("press.mcap", "none.mcap"))
    said = run("DERMIS_ROS", str(file)).stderr
    assert "none.mcap: No such file" in said, said

