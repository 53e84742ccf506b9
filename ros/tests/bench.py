"""How many patches of 10 by 10 taxels the computer holds, with the network: results, loss and latency as `dermis-ros --measure` prints
them, over CARRIER if that is set, else over Zenoh. A number of patches is held where at most 0.1 % of the frames are lost and 99.9 % of
the results are there within 20 ms."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

SCENE = "sensor-1-noisy"
RATES_HZ = (100, 1000)
SECONDS = 10
LOST_PERCENT, LATENCY_MS = 0.1, 20.0


def measured(folder: Path, rate_Hz: int, patches: int, engine: str) -> str:
    """The line of all patches, each with the same recording."""
    recording = folder / f"{rate_Hz}.mcap"
    if not recording.exists():
        press = ["--press", "hold", "--rate", str(rate_Hz), "--duration", "2", "--out", str(recording)]
        subprocess.run([os.environ["DERMIS"], "generate", SCENE, *press], check=True, capture_output=True)
    file = folder / "patches.toml"
    file.write_text(
        f'[node]\nconnect = []\ncarrier = "{os.environ.get("CARRIER", "zenoh")}"\n'
        + "".join(
            f'[[patch]]\nname = "p{number}"\nscene = "{SCENE}"\nsource = "{recording.name}"\nrepeat = true\n'
            f'estimator = "network"\nengine = "{engine}"\ncheck_every = 0\n'
            for number in range(patches)
        )
    )
    command = [os.environ["DERMIS_ROS"], str(file), "--measure", str(SECONDS)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1]


def held(line: str) -> bool:
    words = line.split()
    lost, latency = float(words[words.index("%") - 1]), float(words[-2])
    return lost <= LOST_PERCENT and latency <= LATENCY_MS


def main() -> None:
    numbers = [int(own) for own in sys.argv[1:]]
    with tempfile.TemporaryDirectory() as name:
        for rate_Hz in RATES_HZ:
            for patches in numbers or [number * 100 // rate_Hz for number in (50, 100, 150, 200, 300, 400)]:
                line = measured(Path(name), rate_Hz, patches, "golden")
                print(f"{rate_Hz:5} Hz  {patches:4} patches  {'held' if held(line) else 'not held':8}  {line}", flush=True)


if __name__ == "__main__":
    main()
