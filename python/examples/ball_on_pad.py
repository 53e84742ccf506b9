"""A ball that MuJoCo presses on a tactile pad and drags over it: its contact forces, and what Dermis finds of them.

MuJoCo's contact of two rigid bodies is a force at a point. Here it is spread over the circle that Hertz gives for the ball,
`Scene.stress_MPa` makes the stress at the taxels of it, noise is added, and `Scene.tracker` reconstructs the forces.

    python ball_on_pad.py --out ball.png
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

import dermis

Floats = NDArray[np.float64]

SCENE = "sensor-1"
# Metres, as MuJoCo has them.
RADIUS = 0.012
# Contact modulus of the cover in MPa, with which the ball's circle is that of Hertz.
MODULUS_MPA = 1.0
# Points that stand for the circle.
POINTS = 200
STEP_S = 0.001
END_S = 1.5
# A frame every so many steps: 100 frames/s.
STEPS = 10

WORLD = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0" cone="elliptic" impratio="10" integrator="implicitfast"/>
  <worldbody>
    <geom name="pad" type="box" friction="0.4" size="{half_x} {half_y} 0.005" pos="0 0 -0.005"/>
    <body name="ball" pos="0 0 {radius}">
      <joint name="x" type="slide" axis="1 0 0"/>
      <joint name="y" type="slide" axis="0 1 0"/>
      <joint name="z" type="slide" axis="0 0 1" damping="2"/>
      <geom name="ball" type="sphere" size="{radius}" mass="0.1" friction="0.4"/>
    </body>
  </worldbody>
  <actuator>
    <position joint="x" kp="1500" kv="40"/>
    <position joint="y" kp="1500" kv="40"/>
    <motor joint="z"/>
  </actuator>
</mujoco>
"""


@dataclass
class Run:
    """What the simulation gave, and what was reconstructed."""

    times_s: Floats
    """Times of the frames, (time,)."""
    truth_N: Floats
    """MuJoCo's force on the pad, (time, 3): x, y, normal."""
    places_mm: Floats
    """Where it acts, (time, 2)."""
    stress_MPa: Floats
    """Stress at the taxels with its noise, (time, rows, cols)."""
    results: list[dermis.Reconstruction]
    """What Dermis found in each frame."""

    @property
    def found_N(self) -> Floats:
        """Force that Dermis found, (time, 3)."""
        return np.array([result.resultant_N for result in self.results])

    @property
    def sigma_N(self) -> Floats:
        """Its standard deviation, (time, 3); NaN where there is none."""
        none = np.full(3, np.nan)
        return np.array([none if result.sigma_N is None else result.sigma_N for result in self.results])


def command(time_s: float) -> tuple[float, float, float]:
    """Where the ball is pulled, x and y in m, and how hard it is pressed, in N, at a time."""
    press = 6.0 * min(time_s / 0.3, 1.0)
    drag = max(time_s - 0.4, 0.0)
    if drag < 0.5:
        return 0.006 * drag / 0.5, 0.002 * drag / 0.5, press
    back = min((drag - 0.5) / 0.5, 1.0)
    return 0.006 * (1 - back), 0.002 + 0.002 * back, press


def force_on_pad(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Floats, Floats]:
    """MuJoCo's contact force on the pad in N, x, y and normal into the pad, and where it acts in mm; zero without contact."""
    total, moment = np.zeros(3), np.zeros(2)
    for number in range(data.ncon):
        contact = data.contact[number]
        own = np.zeros(6)
        mujoco.mj_contactForce(model, data, number, own)
        # Rows of the frame: the normal from the first geom to the second, two tangents. The force is that on the second.
        force = contact.frame.reshape(3, 3).T @ own[:3]
        if contact.geom[1] != model.geom("pad").id:
            force = -force
        force[2] = -force[2]
        total += force
        moment += force[2] * 1e3 * contact.pos[:2]
    return total, moment / total[2] if total[2] > 0 else np.zeros(2)


def simulate(scene: dermis.Scene) -> tuple[Floats, Floats, Floats]:
    """Times in s, forces on the pad in N and their places in mm."""
    half_x, half_y = (count * pitch / 2000 for count, pitch in zip((scene.cols, scene.rows), scene.pitch_mm))
    model = mujoco.MjModel.from_xml_string(WORLD.format(step=STEP_S, half_x=half_x, half_y=half_y, radius=RADIUS))
    data = mujoco.MjData(model)
    rows = []
    for step in range(round(END_S / STEP_S)):
        data.ctrl[:] = command(data.time)
        data.ctrl[2] = -data.ctrl[2]
        mujoco.mj_step(model, data)
        if step % STEPS == STEPS - 1:
            force, place = force_on_pad(model, data)
            rows.append((data.time, force, place))
    times, forces, places = zip(*rows)
    return np.array(times), np.array(forces), np.array(places)


def stress_of(scene: dermis.Scene, forces_N: Floats, places_mm: Floats) -> Floats:
    """Stress at the taxels: each force spread over the circle of Hertz's contact, in which all points have equal shares."""
    share = (np.arange(POINTS) + 0.5) / POINTS
    # Of the load up to a radius r of the circle a: 1 - (1 - r²/a²)^(3/2). The golden angle spreads the points.
    radius = np.sqrt(1 - (1 - share) ** (2 / 3))
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(POINTS)
    unit = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    circle_mm = np.cbrt(0.75 * np.maximum(forces_N[:, 2], 0) * 1e3 * RADIUS / MODULUS_MPA)
    at_mm = places_mm[:, None, :] + circle_mm[:, None, None] * unit
    shares_N = np.repeat(forces_N[:, None, :] / POINTS, POINTS, axis=1)
    return scene.stress_MPa(shares_N, at_mm=at_mm)


def run(noise: float) -> Run:
    """Simulates and reconstructs; `noise` is the standard deviation of the stress over its largest value."""
    scene = dermis.Scene.from_name(SCENE)
    times, forces, places = simulate(scene)
    stress = stress_of(scene, forces, places)
    stress = stress + np.random.default_rng(1).normal(scale=noise * stress.max(), size=stress.shape)
    with scene.tracker() as tracker:
        # One frame, one result: the scene averages none.
        results = [tracker.push(frame, time_ns=round(1e9 * time)) for time, frame in zip(times, stress)]
    return Run(times, forces, places, stress, [result for result in results if result is not None])


def table(result: Run) -> str:
    """Every tenth of a second the force of MuJoCo, that of Dermis and its standard deviation, in N."""
    lines = ["| t, s | MuJoCo x, y, normal | Dermis x, y, normal | σ x, y, normal |", "|---:|---:|---:|---:|"]

    def triple(values: Floats) -> str:
        return ", ".join(f"{value:.2f}" for value in values + 0.0)

    for time in range(9, len(result.results), 10):
        cells = triple(result.truth_N[time]), triple(result.found_N[time]), triple(result.sigma_N[time])
        lines.append(f"| {result.times_s[time]:.1f} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(result: Run) -> str:
    """Median error of shear and normal force over MuJoCo's force, of the frames that press with at least 1 N."""
    pressed = result.truth_N[:, 2] >= 1
    size = np.linalg.norm(result.truth_N[pressed], axis=1)
    off = result.found_N[pressed] - result.truth_N[pressed]
    shear, normal = np.linalg.norm(off[:, :2], axis=1) / size, np.abs(off[:, 2]) / size
    inside = (np.abs(off) < 2 * result.sigma_N[pressed]).mean()
    return (
        f"{pressed.sum()} frames: median error of the shear {100 * np.median(shear):.1f} %, of the normal force "
        f"{100 * np.median(normal):.1f} % of the force; {100 * inside:.0f} % of the components within 2 σ"
    )


def draw(result: Run, path: Path) -> None:
    """Writes a picture: the forces over time, and the stress of one frame with the forces found in it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    scene = dermis.Scene.from_name(SCENE)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained", width_ratios=(3, 2))
    for axis, (name, colour) in enumerate(zip(("x", "y", "normal"), ("tab:blue", "tab:green", "tab:red"))):
        left.plot(result.times_s, result.truth_N[:, axis], color=colour, label=f"{name}, MuJoCo")
        found, sigma = result.found_N[:, axis], result.sigma_N[:, axis]
        left.plot(result.times_s, found, ".", markersize=3, color=colour, label=f"{name}, Dermis ± 2 σ")
        left.fill_between(result.times_s, found - 2 * sigma, found + 2 * sigma, color=colour, alpha=0.25, linewidth=0)
    left.set(xlabel="time, s", ylabel="force on the pad, N")
    left.legend(fontsize="small")
    frame = int(np.argmax(np.linalg.norm(result.truth_N[:, :2], axis=1)))
    places, forces = scene.positions_mm, result.results[frame].forces_N
    assert forces is not None
    image = right.pcolormesh(places[0, :, 0], places[:, 0, 1], result.stress_MPa[frame], cmap="viridis")
    right.quiver(places[..., 0], places[..., 1], forces[..., 0], forces[..., 1], color="white")
    right.set(title=f"t = {result.times_s[frame]:.2f} s: stress, and shear found", xlabel="x, mm", ylabel="y, mm", aspect="equal")
    figure.colorbar(image, label="MPa")
    # The same file from the same numbers; letters as text.
    plt.rcParams |= {"svg.hashsalt": "ball on pad", "svg.fonttype": "none"}
    figure.savefig(path, dpi=120, metadata={"Date": None} if path.suffix == ".svg" else None)
    plt.close(figure)


def main() -> None:
    """Prints the table and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--noise", type=float, default=0.001, help="noise of the stress over its largest value (0.001)")
    parser.add_argument("--out", type=Path, help="picture to write, .png or .svg")
    options = parser.parse_args()
    if not 0 <= options.noise <= 1:
        parser.error(f"--noise {options.noise} is not allowed; it must be from 0 to 1")
    result = run(options.noise)
    print(f"{table(result)}\n\n{summary(result)}.")
    if options.out:
        draw(result, options.out)


if __name__ == "__main__":
    main()
