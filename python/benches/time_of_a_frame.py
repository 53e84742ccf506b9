"""Prints the seconds of the fastest of N calls of Scene.reconstruct; `make bench` compares them with Rust.

python time_of_a_frame.py SCENE_TEXT ENGINE N
"""

import sys
import time

import dermis

text, engine, calls = sys.argv[1:]
scene = dermis.Scene.from_toml(text, "sensor-1")
stress = scene.frames[0].stress_MPa
best = float("inf")
for _ in range(int(calls)):
    begin = time.perf_counter()
    scene.reconstruct(stress, engine, cross_check=0)
    best = min(best, time.perf_counter() - begin)
print(best)
