"""Simulated studies, forces along a path and schedules of palpate, in memory.

The functions do what the commands of the program do, with the same numbers to the bit, and return the columns of the
program's CSV files as a dict of one-dimensional numpy arrays: float64, int64, bool or text. A missing number is NaN, a
missing text "". Lengths are in metres, times in seconds, forces in newtons.

What the program would refuse raises InputError, a ValueError, with the program's words. simulate() and render() release
the interpreter's lock, so that a concurrent.futures.ThreadPoolExecutor uses all processors, and end at Ctrl-C.

    >>> import palpate
    >>> person = palpate.settings()
    >>> person["motor"]["slide_speed_m_per_s"] = 0.04
    >>> trials = palpate.simulate("protocols/quick.json", person, participants=2, seed=5)
    >>> trials["response_time"][trials["correct"]].mean()
"""

import json
import os
import sys
import warnings
from typing import Any, Dict, Mapping, Optional, Union

import numpy
from numpy.typing import NDArray

try:
    from ._palpate import DEFAULT_VERSION, Document, InputError, __version__
    from . import _palpate
except ModuleNotFoundError as error:
    raise ImportError(
        f"palpate is here ({os.path.dirname(__file__)}), but its compiled part was not built for Python "
        f"{sys.version_info.major}.{sys.version_info.minor}. Build it from palpate's sources, where python3-dev, "
        "pybind11-dev and python3-numpy are installed:\n"
        "  cmake --preset release -DPALPATE_PYTHON=ON && cmake --build --preset release --target palpate_python\n"
        "and import it with PYTHONPATH=.build/release/runner/python") from error

from .client import AsyncClient, Client, Clock, ServeError

__all__ = ["AsyncClient", "Client", "Clock", "InputError", "ServeError", "render", "schedule", "settings", "simulate", "__version__"]

Path = Union[str, "os.PathLike[str]"]
Columns = Dict[str, NDArray[Any]]

POSE_COLUMNS = ("t", "tip_x", "tip_y", "tip_z", "tail_x", "tail_y", "tail_z")
SIDE_COLUMNS = ("side_x", "side_y", "side_z")


def _plain(value: Any) -> Any:
    """Numbers and arrays of numpy in a document."""
    if isinstance(value, (numpy.generic, numpy.ndarray)):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"no value of JSON: {value!r}")


def _text(document: Mapping[str, Any]) -> str:
    return json.dumps(document, default=_plain, ensure_ascii=False, allow_nan=False)


def _document(given: Union[Path, Mapping[str, Any]], name: str) -> Document:
    if isinstance(given, Mapping):
        return Document(_text(given), name)
    path = os.fspath(given)
    return Document(_palpate.read(path), path)


def simulate(
    protocol: Union[Path, Mapping[str, Any]],
    settings: Optional[Mapping[str, Any]] = None,
    participants: int = 7,
    seed: int = 1,
) -> Columns:
    """A study with simulated participants, as `palpate simulate` and `palpate export --format csv` would give it.

    protocol: the file, or its content as a dict; meshes that a dict names are looked for in the working folder.
        protocol_sha256 is of the file's bytes, or of the dict as json.dumps(..., ensure_ascii=False) writes it.
    settings: of the simulated participant, complete, as settings() gives them; None: the program's default version.
    participants: 1 to 100000, numbered from 1.
    seed: of the participants, from 0; the order of trials follows the protocol's own.

    Returns the columns of trials.csv, a row a completed trial, practice included: by participant, session and trial.
    Materials that the protocol lets the device limit are limited, with a warning that says which.
    Raises InputError for what the program refuses, RuntimeError where a simulation comes to no end.
    """
    text = _palpate.settings(DEFAULT_VERSION) if settings is None else _text(settings)
    columns, limited = _palpate.simulate(_document(protocol, "protocol"), text, participants, seed)
    for sentence in limited:
        warnings.warn(sentence, stacklevel=2)
    return columns


def render(scene: Union[Path, Mapping[str, Any]], trajectory: Union[Path, Mapping[str, Any], NDArray[Any]],
           renderer: str) -> Columns:
    """Forces on the hand along a path of the stylus, as `palpate render` gives them.

    scene: the file (or a mesh file alone), or its content as a dict; meshes that a dict names are looked for in the
        working folder.
    trajectory: a CSV file, or columns by name (a dict, or a structured array as numpy.genfromtxt(names=True) gives it):
        t (s, ascending), tip_x, tip_y, tip_z, tail_x, tail_y, tail_z (m) and, for a tool's +x, side_x, side_y, side_z.
    renderer: "point" or "ray".

    Returns the columns of the program's output, a row a pose: t, force_x, ... (N), torque_x, ... (N m), ideal tip and
    tail, the deepest contact, the devices' shares, depth (m), contacts, contact_type, object, faults.
    """
    document = _document(scene, "scene")
    if isinstance(trajectory, (str, os.PathLike)):
        return _palpate.render_file(document, os.fspath(trajectory), renderer)
    given = trajectory.dtype.names or () if isinstance(trajectory, numpy.ndarray) else tuple(trajectory)
    names = POSE_COLUMNS + (SIDE_COLUMNS if any(name in given for name in SIDE_COLUMNS) else ())
    missing = [name for name in names if name not in given]
    if missing:
        raise InputError("trajectory: (columns): expected " + ", ".join(names) + "; missing: " + ", ".join(missing))
    return _palpate.render(document, [numpy.asarray(trajectory[name], dtype=numpy.float64) for name in names], renderer)


def schedule(protocol: Union[Path, Mapping[str, Any]], participant: int) -> Columns:
    """The trials that a participant (1, 2, ...) will get, in order, as `palpate schedule --format csv` prints them."""
    return _palpate.schedule(_document(protocol, "protocol"), participant)


def settings(version: int = DEFAULT_VERSION) -> Dict[str, Any]:
    """The frozen settings of a version of the simulated participant with every key, to be changed and given to simulate().

    version: 1, 2 or 3. Names of settings end in their unit; runner/participants/README.md says what they are.
    """
    values: Dict[str, Any] = json.loads(_palpate.settings(version))
    return values
