"""Kits of a folder of models on many machines, by Ray: one task a model.

``run`` reads the models where it is called, sends each with its task, and writes each kit once: into a folder here, or from the workers into an
object store (``s3://…``, ``gs://…``, any that fsspec knows). A kit whose inputs are the same is not made again. A worker that is lost loses its
model, which is then made by another.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import threading
import time
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Mapping, Optional, Tuple

import shellock
from shellock import _native

__all__ = ["Record", "run"]

#: What a kit takes at least, and for each byte of its model's file, bytes: Ray runs no more tasks at a time than have room.
LEAST_BYTES = 700_000_000
BYTES_PER_BYTE = 12
#: Models that are read and sent ahead, for each that can be made at a time.
AHEAD = 2
#: Alarms count seconds in what may be 32 bits.
MOST_ALARM = 2e9


@dataclass
class Record:
    """What came of one model: ``status`` is verified, failed, no-plan, refused, too-long or crashed."""

    model: str
    kit: str
    status: str
    made_of: str = ""
    seconds: float = 0.0
    peak_mb: Optional[float] = None
    pieces: Optional[int] = None
    volume_ratio: Optional[float] = None
    n_warnings: int = 0
    n_problems: int = 0
    said: List[str] = field(default_factory=list)
    is_old: bool = False

    def line(self) -> str:
        pieces = f", {self.pieces} pieces" if self.pieces else ""
        why = f": {self.said[0]}" if self.said and self.status != "verified" else ""
        return f"{self.model} {self.status}{pieces}, {self.seconds:.0f} s{', as it was' if self.is_old else ''}{why}"


def _old(content: Optional[bytes], new: Record) -> Optional[Record]:
    """The record that was kept, where it is one, of the same model and made of the same."""
    if content is None:
        return None
    try:
        record = Record(**json.loads(content))
        # The table is as strict as it must be on what may stand in a record.
        _native.tables(json.dumps([asdict(record)]))
    except (ValueError, TypeError, RecursionError, _native.Refused):
        return None
    is_same = (record.model, record.kit, record.made_of) == (new.model, new.kit, new.made_of)
    return record if is_same else None


def _program() -> str:
    """What tells this program from any other: of two builds of one version, too."""
    return hashlib.sha256(Path(_native.__file__).read_bytes()).hexdigest()


class _TooLong(Exception):
    pass


@contextmanager
def _within(patience: float) -> Iterator[Callable[[Any], None]]:
    """Raises ``_TooLong`` after so many seconds: by an alarm where this is the main thread, as in Ray's tasks, and where what it gives is called."""
    began = time.monotonic()

    def watch(*_: Any) -> None:
        if time.monotonic() - began > patience:
            raise _TooLong

    has_alarm = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread() and patience < MOST_ALARM
    if not has_alarm:
        yield watch
        return
    before = signal.signal(signal.SIGALRM, watch)
    signal.setitimer(signal.ITIMER_REAL, patience + 0.01, 1.0)
    try:
        yield watch
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _make(name: str, data: bytes, options: Mapping[str, Any], patience: float, store: Optional[str], kit_name: str) -> Tuple[Dict[str, Any], Dict[str, bytes]]:
    """On a worker: the record's fields, and the kit's files where they are not in the store."""
    began = time.monotonic()
    told: Dict[str, Any] = {"said": []}
    files: Dict[str, bytes] = {}
    try:
        with _within(patience) as watch:
            kit = shellock.build(data, name=name, progress=watch, **options)
        told["status"] = "verified" if kit.passed else "failed"
        plan = kit.plan
        told["pieces"], told["volume_ratio"] = len(plan["pieces"]), plan["volume_ratio"]
        warnings = [w for w in kit.warnings if w.severity != "note"]
        told["n_problems"] = sum(w.severity == "problem" for w in warnings)
        told["n_warnings"] = len(warnings) - told["n_problems"]
        failed = [f"{c['name']}: {c['figure']}" for c in kit.checks if not c["ok"]]
        told["said"] = failed + [w.message for w in warnings]
        files = kit.files
    except _TooLong:
        told.update(status="too-long", said=[f"longer than {patience:.0f} s"])
    except shellock.NoPlanError as e:
        told.update(status="no-plan", said=[str(e)])
    except shellock.ShellockError as e:
        told.update(status="refused", said=[str(e)])
    except RuntimeError as e:
        told.update(status="crashed", said=[str(e)])
    told["seconds"] = time.monotonic() - began
    if store is not None and files:
        _Store(store).replace(kit_name, files)
        files = {}
    return told, files


class _Folder:
    """Kits in a folder of this machine: each appears whole or not at all, and replaces an earlier kit and nothing else."""

    #: Where workers write to: nowhere.
    store: Optional[str] = None

    def __init__(self, out: str) -> None:
        self.out = Path(out)
        try:
            self.out.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise shellock.WriteError(f"{out}: {e.strerror}", 4) from None

    def has(self, name: str) -> bool:
        return (self.out / name).is_file()

    def read(self, name: str) -> Optional[bytes]:
        try:
            return (self.out / name).read_bytes()
        except OSError:
            return None

    def write(self, name: str, content: bytes) -> None:
        path = self.out / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise shellock.WriteError(f"{path.parent}: {e.strerror}", 4) from None
        shellock._asked(_native.write_file, str(path), content)

    def keep(self, kit: str, files: Mapping[str, bytes]) -> None:
        # First: the record of an earlier kit must not vouch for this one.
        try:
            (self.out / _native.record_path(kit)).unlink()
        except OSError:
            pass
        shellock._asked(_native.save, list(files.items()), str(self.out / kit), True)


class _Store:
    """Kits in an object store: a kit is there once its record is."""

    def __init__(self, out: str) -> None:
        try:
            import fsspec

            self.system, self.root = fsspec.core.url_to_fs(out.rstrip("/"))
        except (ImportError, ValueError) as e:
            raise shellock.InputError(f"{out}: {e}", 2) from None
        self.store = out

    def has(self, name: str) -> bool:
        return self._read(lambda path: self.system.exists(path), name)

    def read(self, name: str) -> Optional[bytes]:
        return self._read(lambda path: self.system.cat_file(path) if self.system.isfile(path) else None, name)

    def _read(self, how: Callable[[str], Any], name: str) -> Any:
        path = f"{self.root}/{name}"
        try:
            return how(path)
        except OSError as e:
            raise shellock.WriteError(f"{path}: {e}", 4) from None

    def write(self, name: str, content: bytes) -> None:
        path = f"{self.root}/{name}"
        try:
            self.system.makedirs(path.rsplit("/", 1)[0], exist_ok=True)
            self.system.pipe_file(path, content)
        except OSError as e:
            raise shellock.WriteError(f"{path}: {e}", 4) from None

    def keep(self, kit: str, files: Mapping[str, bytes]) -> None:
        """The worker wrote them."""

    def replace(self, kit: str, files: Mapping[str, bytes]) -> None:
        """Writes a kit in the place of an earlier one, whose record and files go first.

        The plan is the last that goes and the first that comes: a worker that is lost meanwhile leaves a folder that is known for a kit.
        """
        self.system.invalidate_cache()
        record = _native.record_path(kit)
        if self.has(record) or self.has(f"{kit}/plan.json"):
            if self.has(record):
                self.system.rm_file(f"{self.root}/{record}")
            for name in sorted(self._files(kit), key=lambda name: (name == f"{kit}/plan.json", name)):
                self.system.rm_file(f"{self.root}/{name}")
        for file in sorted(files, key=lambda file: (file != "plan.json", file)):
            self.write(f"{kit}/{file}", files[file])

    def _files(self, kit: str) -> List[str]:
        """Files of a kit, of any version, in its folder; the kit of another model may lie below it, and what else is there is not touched."""
        folder = f"{self.root}/{kit}/"
        within = (path[len(folder):] for path in self.system.find(folder) if path.startswith(folder))
        return [f"{kit}/{name}" for name in within if _native.is_of_kit(name)]


def _printable(name: Path) -> str:
    return os.fsencode(name.as_posix()).decode("utf-8", "replace")


def _checked(options: Mapping[str, Any], cpus: int, patience: float) -> Dict[str, Any]:
    """``options`` as JSON has them; refuses what every model would be refused for."""
    if not cpus >= 1:
        raise shellock.InputError(f"cpus: {cpus} cores are too few for a kit; give 1 or more", 2)
    if not patience > 0:
        raise shellock.InputError(f"patience: {patience} s are too few for a kit; give more than 0", 2)
    text = shellock._options(options)
    shellock._refuse_options(text)
    return json.loads(text)


def _jobs(folder: str, out: Optional[str]) -> List[Tuple[Path, Path]]:
    jobs = shellock._asked(_native.models, folder, out)
    if not jobs:
        raise shellock.InputError(f"{folder} contains no model", 2)
    return jobs


def run(
    folder: str,
    out: str,
    options: Optional[Mapping[str, Any]] = None,
    *,
    cpus: int = 1,
    patience: float = 300.0,
    retries: int = 3,
    told: Callable[[Record, int, int], Any] = lambda record, number, of: None,
) -> List[Record]:
    """Makes kits of all models below ``folder``; Ray must be initialised. Returns their records in the order of their names.

    ``options`` are those of ``shellock.build``. ``cpus`` are taken for each kit; ``patience`` is the longest time for one, s; a model whose worker is lost
    is made again up to ``retries`` times. ``told`` hears of each record as it comes, with its number and how many there are. Writes ``batch.csv`` and ``batch.html``.

    Raises ``shellock.InputError`` before anything is sent where the folder holds no model or an option is wrong, and ``shellock.WriteError`` where records
    cannot be written, or a store does not let them be read. What goes wrong with one model is said in its record.
    """
    options = _checked(options or {}, cpus, patience)
    jobs = _jobs(folder, None if "://" in out else out)
    import ray

    kits: Any = _Store(out) if "://" in out else _Folder(out)
    made_with = hashlib.sha256(json.dumps([_program(), options], sort_keys=True).encode()).hexdigest()
    here = Path(folder)
    # One pool of threads in each worker, as large as what it may take.
    task = ray.remote(num_cpus=cpus, max_retries=retries, runtime_env={"env_vars": {"RAYON_NUM_THREADS": str(cpus)}})(_make)
    slots = max(1, int(ray.cluster_resources().get("CPU", 1) // cpus))
    most = int(max(node["Resources"].get("memory", LEAST_BYTES) for node in ray.nodes() if node["Alive"]))
    records: List[Record] = []
    pending: Dict[Any, Record] = {}

    def ended(record: Record) -> None:
        records.append(record)
        told(record, len(records), len(jobs))

    def finish(reference: Any) -> None:
        record, is_kept = pending.pop(reference), True
        try:
            fields, files = ray.get(reference)
            if fields["status"] in ("verified", "failed"):
                kits.keep(record.kit, files)
            for name, value in fields.items():
                setattr(record, name, value)
        except ray.exceptions.RayError as e:
            record.said = (str(e).strip().splitlines() or [type(e).__name__])[-1:]
        except shellock.ShellockError as e:
            # Of the place for the kit, not of the model: another time it may be free.
            record.status, record.said, is_kept = "refused" if e.code == 2 else "crashed", [str(e)], False
        if is_kept and record.status not in ("too-long", "crashed"):
            kits.write(_native.record_path(record.kit), json.dumps(asdict(record)).encode())
        ended(record)

    for name, kit in jobs:
        record = Record(_printable(name), _printable(kit), "refused")
        if record.model != name.as_posix():
            record.said = ["its name is no UTF-8; rename it"]
            ended(record)
            continue
        try:
            data = (here / name).read_bytes()
        except OSError as e:
            record.said = [f"it cannot be read: {e.strerror}"]
            ended(record)
            continue
        record.made_of = hashlib.sha256(hashlib.sha256(data).hexdigest().encode() + made_with.encode()).hexdigest()
        old = _old(kits.read(_native.record_path(record.kit)), record)
        if old is not None and (old.status not in ("verified", "failed") or kits.has(f"{old.kit}/plan.json")):
            old.is_old = True
            ended(old)
            continue
        record.status = "crashed"
        # No more are sent than can soon be made: models wait here, not in the store's memory.
        while len(pending) >= AHEAD * slots:
            for reference in ray.wait(list(pending), num_returns=1)[0]:
                finish(reference)
        # What no machine has room for would wait for ever: it is tried alone on the largest.
        needs = min(LEAST_BYTES + BYTES_PER_BYTE * len(data), most)
        reference = task.options(memory=needs).remote(name.name, data, options, patience, kits.store, record.kit)
        pending[reference] = record
        del data
    while pending:
        for reference in ray.wait(list(pending), num_returns=1)[0]:
            finish(reference)
    records.sort(key=lambda r: r.model)
    for name, content in shellock._asked(_native.tables, json.dumps([asdict(r) for r in records])):
        kits.write(name, bytes(content))
    return records
