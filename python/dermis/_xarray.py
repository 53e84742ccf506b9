"""Datasets of xarray from results and frames: coordinates, units and times."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._dermis import FLAGS

if TYPE_CHECKING:
    from ._dermis import Contact, Frame, Reconstruction, Reconstructions

_Floats = NDArray[np.float64]
# Name, dimensions after those of time, values, unit, meaning.
_Variable = tuple[str, tuple[str, ...], Any, str, str]

_FORCE = ("axis",)
_TAXELS = ("row", "col")
# Of each contact: variable, property of Contact, its dimensions, unit, meaning.
_OF_CONTACTS: tuple[tuple[str, str, tuple[str, ...], str, str], ...] = (
    ("contact_force", "force_N", _FORCE, "N", "force of the contact"),
    ("contact_force_sigma", "sigma_N", _FORCE, "N", "standard deviation of contact_force"),
    ("contact_centre", "centre_mm", ("plane",), "mm", "centre of pressure from the centre of the array"),
    ("contact_mu", "mu", ("plane",), "1", "ratio of shear to normal force"),
    ("contact_mu_sigma", "mu_sigma", ("plane",), "1", "standard deviation of contact_mu"),
)
_AXES = ["x", "y", "z"]
_PLANE = _AXES[:2]


def _module() -> Any:
    """xarray, which nothing else of the package needs."""
    try:
        # By name: reading its types takes a checker longer than all else.
        return import_module("xarray")
    except ImportError as error:
        raise ImportError("to_xarray needs xarray, which is not installed: pip install xarray") from error


def _dataset(
    variables: Iterable[_Variable],
    times_ns: Sequence[int | None],
    names: Sequence[str],
    x_mm: _Floats,
    y_mm: _Floats,
    attributes: dict[str, str],
) -> Any:
    """A dataset with an axis of time; its coordinate is left out where a time is not known."""
    coordinates: dict[str, Any] = {
        "row": ("row", np.arange(len(y_mm)), {"long_name": "row of the array"}),
        "col": ("col", np.arange(len(x_mm)), {"long_name": "column of the array"}),
        "y_mm": ("row", y_mm, {"units": "mm", "long_name": "place of the row from the centre of the array"}),
        "x_mm": ("col", x_mm, {"units": "mm", "long_name": "place of the column from the centre of the array"}),
        "frame": ("time", np.array(names, dtype=str), {"long_name": "name of the frame"}),
    }
    if len(times_ns) and None not in times_ns:
        about = {"units": "ns", "long_name": "time of acquisition by the clock of the frames"}
        coordinates["time"] = ("time", np.array(times_ns, dtype=np.int64), about)
    arrays = {}
    for name, dimensions, values, units, meaning in variables:
        about = {"units": units, "long_name": meaning} if units else {"long_name": meaning}
        arrays[name] = (("time", *dimensions), values, about)
        if "axis" in dimensions:
            coordinates["axis"] = ("axis", _AXES, {"long_name": "component: x, y, normal"})
        if "plane" in dimensions:
            coordinates["plane"] = ("plane", _PLANE, {"long_name": "component: x, y"})
    return _module().Dataset(arrays, coordinates, attributes)


def _contacts(all_contacts: Sequence[list[Contact] | None]) -> Iterable[_Variable]:
    """The variables of contacts; the axis `contact` is as long as the most contacts of a result."""
    segmented = np.array([contacts is not None for contacts in all_contacts], dtype=bool)
    if not segmented.any():
        return
    counts = np.array([len(contacts or ()) for contacts in all_contacts], dtype=np.int64)
    most = int(counts.max())
    yield "contact_count", (), counts, "1", "number of contacts"
    yield "contacts_segmented", (), segmented, "", "whether the result segments contacts"
    for name, of, dimensions, units, meaning in _OF_CONTACTS:
        length = len(_AXES if dimensions == _FORCE else _PLANE)
        values = np.full((len(counts), most, length), np.nan)
        for time, contacts in enumerate(all_contacts):
            for number, contact in enumerate(contacts or ()):
                own = getattr(contact, of)
                if own is not None:
                    values[time, number] = own
        yield name, ("contact", *dimensions), values, units, meaning


def of_results(results: Reconstructions, x_mm: _Floats, y_mm: _Floats) -> Any:
    """The dataset of results in the order of time."""
    every = list(results)

    def variables() -> Iterable[_Variable]:
        if every and results.forces_N is not None:
            yield "force", (*_TAXELS, *_FORCE), results.forces_N, "N", "force on each taxel"
        yield "resultant", _FORCE, results.resultant_N, "N", "sum of the forces"
        yield "resultant_sigma", _FORCE, results.sigma_N, "N", "standard deviation of resultant"
        moments = [result.moment_Nmm for result in every]
        if every and all(moment is not None for moment in moments):
            yield "moment", _FORCE, np.array(moments), "N mm", "moment of the forces about the centre of the array"
        yield from _contacts(results.contacts)
        raised = [[flag in own for flag in FLAGS] for own in results.flags]
        yield "flags", ("flag",), np.array(raised, dtype=bool).reshape(-1, len(FLAGS)), "", "limitations of the result"

    names, times = [result.frame for result in every], [result.time_ns for result in every]
    attributes = {"scene": every[0].scene, "engine": every[0].engine} if every else {}
    dataset = _dataset(variables(), times, names, x_mm, y_mm, attributes)
    return dataset.assign_coords(flag=("flag", list(FLAGS), {"long_name": "name of the flag"}))


class _One:
    """One result in the place of several."""

    def __init__(self, result: Reconstruction) -> None:
        self.result = result
        self.forces_N = None if result.forces_N is None else result.forces_N[None]
        self.resultant_N = result.resultant_N[None]
        self.sigma_N = np.full((1, len(_AXES)), np.nan) if result.sigma_N is None else result.sigma_N[None]
        self.contacts = [result.contacts]
        self.flags = [result.flags]

    def __iter__(self) -> Any:
        return iter([self.result])


def of_result(result: Reconstruction, x_mm: _Floats, y_mm: _Floats) -> Any:
    """The dataset of one result, without an axis of time."""
    one: Any = _One(result)
    return of_results(one, x_mm, y_mm).isel(time=0)


def of_frames(frames: Sequence[Frame], x_mm: _Floats, y_mm: _Floats) -> Any:
    """The dataset of frames of one array."""

    def variables() -> Iterable[_Variable]:
        stress = np.stack([frame.stress_MPa for frame in frames])
        yield "stress", _TAXELS, stress, "MPa", "normal stress, compression positive; missing where a reading is"
        cells = [frame.cell_forces_N for frame in frames]
        if any(own is not None for own in cells):
            none = np.full((*stress.shape[1:], len(_AXES)), np.nan)
            known = np.stack([none if own is None else own for own in cells])
            yield "cell_force", (*_TAXELS, *_FORCE), known, "N", "true force on each cell"
        resultants = [frame.resultant_N for frame in frames]
        if any(own is not None for own in resultants):
            known = np.stack([np.full(len(_AXES), np.nan) if own is None else own for own in resultants])
            yield "resultant", _FORCE, known, "N", "true force of all contacts"

    return _dataset(variables(), [frame.time_ns for frame in frames], [frame.id for frame in frames], x_mm, y_mm, {})


def of_frame(frame: Frame, x_mm: _Floats, y_mm: _Floats) -> Any:
    """The dataset of one frame, without an axis of time."""
    return of_frames([frame], x_mm, y_mm).isel(time=0)
