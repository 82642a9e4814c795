"""Hollow 3D-printable pieces that lock each other without glue.

>>> import shellock
>>> kit = shellock.design(points, triangles, size="150mm", printer="fdm")
>>> kit.passed
True
>>> kit.save("figure-kit")

Meshes are closed surfaces: ``points`` (n, 3) and ``triangles`` (m, 3) with indices from 0, counter-clockwise seen from outside; or a
``trimesh.Trimesh``. Options are those of ``shellock build`` (:func:`options` lists them), with ``_`` for ``-``; lengths are mm or texts with a
unit. A tuple of numbers is one value (``key=(0, 0, 50)``), a list is several. A kit has the bytes that ``shellock build`` writes of a PLY
file with the same points, triangles and labels.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native

__version__: str = _native.VERSION

# Without ``Warning``, which would hide Python's own from who imports all.
__all__ = [
    "Kit", "Finding", "Progress", "build", "design", "segment", "verify", "check", "options",
    "ShellockError", "InputError", "NoPlanError", "WriteError",
]


class ShellockError(Exception):
    """What went wrong. ``code`` is the exit code of the command line; ``at`` the place in the model's units, where there is one."""

    def __init__(self, message: str, code: int, at: Optional[Tuple[float, float, float]] = None) -> None:
        Exception.__init__(self, message)
        self.code = code
        self.at = at

    def __reduce__(self) -> Tuple[Any, ...]:
        # Else an error of a worker could not be sent, and its pool would wait for ever.
        return type(self), (str(self), self.code, self.at), self.__dict__


class InputError(ShellockError, ValueError):
    """The model or an option is wrong (code 2); the message says what to do."""


class NoPlanError(ShellockError):
    """No order and directions were found in which pieces lock (code 3)."""


class WriteError(ShellockError):
    """A file could not be written (code 4)."""


_KINDS = {2: InputError, 3: NoPlanError, 4: WriteError}


@dataclass(frozen=True)
class Progress:
    """What goes on: ``number`` of ``count`` stages (0 where they are not counted), or a ``note`` on what was decided."""

    stage: str
    number: int
    count: int
    note: Optional[str]


@dataclass(frozen=True)
class Warning:
    """What may go wrong, or should be known. ``pieces`` are numbers from 1; ``at`` is mm in assembly space."""

    code: str
    severity: str
    message: str
    pieces: Tuple[int, ...]
    at: Optional[Tuple[float, float, float]]
    settings: Tuple[str, ...] = ()  # options that can change it, most helpful first


@dataclass(frozen=True)
class Finding:
    """A claim of a certificate, whether it was ``"confirmed"``, ``"refuted"`` or is ``"unproven"`` (nothing is claimed), and the figure that decided."""

    claim: str
    verdict: str
    figure: str


class Kit:
    """A kit that is made, in memory."""

    def __init__(self, native: Any) -> None:
        self._native = native
        self._files: Optional[Dict[str, bytes]] = None
        self._pieces: Optional[List[Tuple[np.ndarray, np.ndarray]]] = None

    @property
    def passed(self) -> bool:
        """Whether every check passes."""
        return self._native.passed

    @property
    def pieces(self) -> List[Tuple[np.ndarray, np.ndarray]]:
        """For each piece, in the order in which they go in, points (n, 3) float64, mm, in place, and triangles (m, 3) uint32."""
        if self._pieces is None:
            self._pieces = self._native.pieces()
        return self._pieces

    @property
    def files(self) -> Dict[str, bytes]:
        """All files of the kit's folder, by their names there."""
        if self._files is None:
            self._files = self._native.files()
        return self._files

    @property
    def plan(self) -> Dict[str, Any]:
        """``plan.json``: order, directions, connectors, checks, what the kit bears."""
        return json.loads(self.files["plan.json"])

    @property
    def checks(self) -> List[Dict[str, Any]]:
        """``name``, ``ok`` and ``figure`` of each check of the finished pieces."""
        return self.plan["verification"]["checks"]

    @property
    def warnings(self) -> List[Warning]:
        """What matters most first."""
        def one(w: Mapping[str, Any]) -> Warning:
            at = tuple(w["at"]) if w["at"] else None
            return Warning(w["code"], w["severity"], w["message"], tuple(w["pieces"]), at, tuple(w.get("settings", ())))

        return [one(w) for w in json.loads(self._native.warnings())]

    @property
    def notes(self) -> List[str]:
        """What was done with the model and the wishes."""
        return self._native.notes

    def save(self, folder: Union[str, "os.PathLike[str]"], force: bool = False) -> None:
        """Writes the kit's folder, whole or not at all; with ``force`` it replaces an earlier kit, and nothing else ever."""
        _asked(self._native.save, os.fspath(folder), force)

    def meshes(self) -> List[Any]:
        """The pieces as ``trimesh.Trimesh``, which must be installed."""
        import trimesh

        return [trimesh.Trimesh(points, triangles, process=False) for points, triangles in self.pieces]

    def __repr__(self) -> str:
        return f"<Kit of {len(self.pieces)} pieces, {'passes every check' if self.passed else 'fails a check'}>"


def design(
    vertices: Any,
    faces: Any = None,
    labels: Optional[Sequence[int]] = None,
    *,
    name: str = "model",
    progress: Optional[Callable[[Progress], Any]] = None,
    **options: Any,
) -> Kit:
    """Makes the kit of a closed surface.

    ``vertices`` is (n, 3), ``faces`` (m, 3); or ``vertices`` is a trimesh and ``faces`` is left out. ``labels`` (m,) says of each face to which
    piece it belongs. ``progress`` is called in this thread. Other threads of the interpreter go on meanwhile; Ctrl-C ends it.

    Raises :class:`InputError` for a model or option that is wrong, :class:`NoPlanError` where no plan is found.
    """
    points, triangles = _mesh(vertices, faces)
    native = _computed(_native.design, points, triangles, _labels(labels, len(triangles)), f"{name}.ply", _options(options), _listener(progress))
    return Kit(native)


def build(
    file: Union[str, "os.PathLike[str]", bytes],
    *,
    name: Optional[str] = None,
    progress: Optional[Callable[[Progress], Any]] = None,
    **options: Any,
) -> Kit:
    """Makes the kit of a model's file (3MF, STL, OBJ, PLY, OFF, glTF, GLB), which may be given by its bytes and ``name``.

    The kit has the bytes that ``shellock build`` writes of that file.
    """
    if isinstance(file, bytes):
        data, name = file, name or "model"
    else:
        path = Path(file)
        data, name = path.read_bytes(), name or path.name
    return Kit(_computed(_native.build, data, name, _options(options), _listener(progress)))


def segment(
    vertices: Any,
    faces: Any = None,
    labels: Optional[Sequence[int]] = None,
    *,
    progress: Optional[Callable[[Progress], Any]] = None,
    **options: Any,
) -> np.ndarray:
    """Divides the surface: for each face the number of its piece, (m,) uint32 from 1. Same arguments as :func:`design`."""
    points, triangles = _mesh(vertices, faces)
    found = _computed(_native.segment, points, triangles, _labels(labels, len(triangles)), _options(options), _listener(progress))
    return np.asarray(found, dtype=np.uint32)


def verify(pieces: Sequence[Any], pulled_out_along: Sequence[Optional[Sequence[float]]], clearance: float = 0.1) -> Dict[str, Any]:
    """Whether any assembly goes together in this order and nothing but the last piece comes out.

    ``pieces`` are closed meshes in place, mm: pairs (points, triangles) or trimeshes, first to last; ``pulled_out_along`` is the way out of each,
    ``None`` for the first; ``clearance`` is the gap between mating faces, mm. Returns ``passed``, ``checks`` and ``findings``.
    """
    meshes = [_mesh(*p) if isinstance(p, (tuple, list)) else _mesh(p, None) for p in pieces]
    ways = [None if way is None else [float(x) for x in way] for way in pulled_out_along]
    return json.loads(_computed(_native.verify, meshes, ways, float(clearance)))


def check(folder: Union[str, "os.PathLike[str]"]) -> List[Finding]:
    """Checks the certificate of a finished kit's folder with exact arithmetic, by none of the code that made it."""
    return [Finding(*f) for f in _asked(_native.check, os.fspath(folder))]


def options() -> List[Dict[str, Any]]:
    """All options of :func:`design`: ``name``, ``group``, ``help``, ``kind``, ``choices``, ``default``."""
    listed = json.loads(_native.options())
    for option in listed:
        option["name"] = option["name"].replace("-", "_")
        del option["value"]
    return listed


def _mesh(vertices: Any, faces: Any) -> Tuple[np.ndarray, np.ndarray]:
    if faces is None:
        if not (hasattr(vertices, "vertices") and hasattr(vertices, "faces")):
            raise InputError("give vertices and faces, or a trimesh", 2)
        vertices, faces = vertices.vertices, vertices.faces
    points = np.ascontiguousarray(vertices, dtype=np.float64)
    triangles = np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise InputError(f"vertices are {points.shape} and faces {triangles.shape}; (n, 3) and (m, 3) are needed", 2)
    if not np.issubdtype(triangles.dtype, np.integer):
        raise InputError(f"faces are {triangles.dtype}; whole numbers are needed", 2)
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise InputError(f"faces name points from {triangles.min()} to {triangles.max()}; there are {len(points)}, from 0", 2)
    return points, np.ascontiguousarray(triangles, dtype=np.uint32)


def _labels(labels: Optional[Sequence[int]], n: int) -> Optional[np.ndarray]:
    if labels is None:
        return None
    array = np.asarray(labels)
    if array.shape != (n,) or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"labels are {array.dtype} {array.shape}; whole numbers ({n},) are needed, one a face", 2)
    bounds = np.iinfo(np.int32)
    if n and (array.min() < bounds.min or array.max() > bounds.max):
        raise InputError("labels are 32-bit whole numbers", 2)
    return np.ascontiguousarray(array, dtype=np.int32)


def _options(options: Mapping[str, Any]) -> str:
    return json.dumps({name.replace("_", "-"): _plain(name, value) for name, value in options.items()}, sort_keys=True)


def _plain(name: str, value: Any) -> Any:
    """What JSON has for a value of an option; a tuple or an array of numbers is one value, with commas."""
    if isinstance(value, np.ndarray):
        value = value.item() if value.ndim == 0 else [tuple(row) for row in value] if value.ndim == 2 else tuple(value)
    for kind, plain in ((np.bool_, bool), (np.integer, int), (np.floating, float), (np.str_, str)):
        if isinstance(value, kind):
            value = plain(value)
    if value is None or isinstance(value, (bool, int, str)) or isinstance(value, float) and math.isfinite(value):
        return value
    if isinstance(value, (tuple, list)):
        parts = [_plain(name, v) for v in value]
        is_one = isinstance(value, tuple) and parts and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in parts)
        return ",".join(map(str, parts)) if is_one else parts
    raise InputError(f"{name}: this is not a valid value: {value!r}", 2)


def _refuse_options(options: str) -> None:
    """Raises what any model would be refused for with these options."""
    def said(options: str) -> Any:
        try:
            return _native.build(b"", "model.ply", options, None)
        except _native.Refused as refused:
            return refused.args

    # Options are looked at before the model, which is refused as nothing is in it.
    if said(options) != said("{}"):
        _asked(_native.build, b"", "model.ply", options, None)


def _listener(progress: Optional[Callable[[Progress], Any]]) -> Optional[Callable[..., None]]:
    if progress is None:
        return None
    return lambda stage, number, count, note: progress(Progress(stage, number, count, note))


def _asked(ask: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return ask(*arguments)
    except _native.Refused as refused:
        code, message, at = refused.args
        raise _KINDS.get(code, ShellockError)(message, code, at) from None


_was_used = False
_is_forked = False


def _after_fork() -> None:
    global _is_forked
    _is_forked = _was_used


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


def _computed(ask: Callable[..., Any], *arguments: Any) -> Any:
    """:func:`_asked`, of what shares its work among threads: they are not there in a forked process, which would wait for them for ever."""
    global _was_used
    if _is_forked:
        raise ShellockError('this process was forked after shellock was used; start workers with multiprocessing.get_context("spawn")', 1)
    _was_used = True
    return _asked(ask, *arguments)
