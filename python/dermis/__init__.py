"""Forces from the normal stress on a tactile array.

>>> import dermis
>>> scene = dermis.Scene.from_name("sensor-1")
>>> frame = scene.generate([{"shape": "hertz-circle", "size_mm": [4], "normal_N": 5, "tangential_N": [1, -0.5]}])
>>> result = scene.reconstruct(frame.stress_MPa)
>>> result.resultant_N.round(2)
array([ 0.99, -0.49,  5.03])

Units are mm, N and MPa; compression is positive. Arrays are row-major: (rows, cols) or (time, rows, cols). x points
towards higher columns, y towards higher rows, both from the array's centre.
"""

from ._dermis import *
from ._dermis import __all__ as __all__
