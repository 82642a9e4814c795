"""Kits of a folder of models on many machines, by Ray: one task a model.

``run`` reads the models where it is called, sends each with its task, and writes each kit once: into a folder here, or from the workers into an
object store (``s3://…``, ``gs://…``, any that fsspec knows). A kit whose inputs are the same is not made again. A worker that is lost loses its
model, which is then made by another.
"""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

from shellock import _native

__all__ = ["Record", "run"]

#: What a kit takes at least, and for each byte of its model's file, bytes: Ray runs no more tasks at a time than have room.
LEAST_BYTES = 700_000_000
BYTES_PER_BYTE = 12
#: Models that are read and sent ahead, for each that can be made at a time.
AHEAD = 2


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


def _program() -> str:
    """What tells this program from any other: of two builds of one version, too."""
    return hashlib.sha256(Path(_native.__file__).read_bytes()).hexdigest()


class _TooLong(Exception):
    pass


def _make(name: str, data: bytes, options: Mapping[str, Any], patience: float, store: Optional[str]) -> Tuple[Dict[str, Any], Dict[str, bytes]]:
    """On a worker: the record's fields, and the kit's files where they are not in the store."""
    import shellock

    began = time.monotonic()

    def watch(_: Any) -> None:
        if time.monotonic() - began > patience:
            raise _TooLong

    told: Dict[str, Any] = {"said": []}
    files: Dict[str, bytes] = {}
    try:
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
        import fsspec

        for file, content in files.items():
            with fsspec.open(f"{store}/{file}", "wb") as to:
                to.write(content)
        files = {}
    return told, files


class _Folder:
    """Kits in a folder of this machine: each appears whole or not at all, and replaces an earlier kit and nothing else."""

    def __init__(self, out: str) -> None:
        self.out = Path(out)
        self.out.mkdir(parents=True, exist_ok=True)

    def kit(self, kit: Path) -> Optional[str]:
        return None

    def has(self, kit: Path) -> bool:
        return (self.out / kit / "plan.json").is_file()

    def read(self, name: str) -> Optional[bytes]:
        path = self.out / name
        return path.read_bytes() if path.is_file() else None

    def write(self, name: str, content: bytes) -> None:
        path = self.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        _native.write_file(str(path), content)

    def keep(self, kit: Path, files: Mapping[str, bytes]) -> None:
        _native.save(list(files.items()), str(self.out / kit), True)


class _Store:
    """Kits in an object store: a kit is there once its record is."""

    def __init__(self, out: str) -> None:
        import fsspec

        self.out = out.rstrip("/")
        self.system, self.root = fsspec.core.url_to_fs(self.out)

    def kit(self, kit: Path) -> Optional[str]:
        return f"{self.out}/{kit.as_posix()}"

    def has(self, kit: Path) -> bool:
        return self.system.exists(f"{self.root}/{kit.as_posix()}/plan.json")

    def read(self, name: str) -> Optional[bytes]:
        path = f"{self.root}/{name}"
        return self.system.cat_file(path) if self.system.exists(path) else None

    def write(self, name: str, content: bytes) -> None:
        path = f"{self.root}/{name}"
        self.system.makedirs(path.rsplit("/", 1)[0], exist_ok=True)
        self.system.pipe_file(path, content)

    def keep(self, kit: Path, files: Mapping[str, bytes]) -> None:
        """The worker wrote them."""


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
    """
    import ray

    options = dict(options or {})
    kits = _Store(out) if "://" in out else _Folder(out)
    made_with = hashlib.sha256(json.dumps([_program(), options], sort_keys=True).encode()).hexdigest()
    here = Path(folder)
    jobs = _native.models(folder, None if "://" in out else out)
    # One pool of threads in each worker, as large as what it may take.
    task = ray.remote(num_cpus=cpus, max_retries=retries, runtime_env={"env_vars": {"RAYON_NUM_THREADS": str(cpus)}})(_make)
    slots = max(1, int(ray.cluster_resources().get("CPU", 1) // cpus))
    most = int(max(node["Resources"].get("memory", LEAST_BYTES) for node in ray.nodes() if node["Alive"]))
    records: List[Record] = []
    pending: Dict[Any, Tuple[Record, Path]] = {}

    def ended(record: Record) -> None:
        records.append(record)
        told(record, len(records), len(jobs))

    def finish(reference: Any) -> None:
        record, kit = pending.pop(reference)
        try:
            fields, files = ray.get(reference)
            for name, value in fields.items():
                setattr(record, name, value)
            if record.status in ("verified", "failed"):
                kits.keep(kit, files)
        except ray.exceptions.RayError as e:
            record.status, record.said = "crashed", [str(e).strip().splitlines()[-1]]
        if record.status not in ("too-long", "crashed"):
            kits.write(f".batch/{kit.as_posix()}.ray.json", json.dumps(asdict(record)).encode())
        ended(record)

    for name, kit in jobs:
        data = (here / name).read_bytes()
        made_of = hashlib.sha256(hashlib.sha256(data).hexdigest().encode() + made_with.encode()).hexdigest()
        old = kits.read(f".batch/{kit.as_posix()}.ray.json")
        if old is not None:
            record = Record(**json.loads(old))
            if record.made_of == made_of and (record.status not in ("verified", "failed") or kits.has(kit)):
                record.is_old = True
                ended(record)
                continue
        # No more are sent than can soon be made: models wait here, not in the store's memory.
        while len(pending) >= AHEAD * slots:
            for reference in ray.wait(list(pending), num_returns=1)[0]:
                finish(reference)
        # What no machine has room for would wait for ever: it is tried alone on the largest.
        needs = min(LEAST_BYTES + BYTES_PER_BYTE * len(data), most)
        reference = task.options(memory=needs).remote(name.name, data, options, patience, kits.kit(kit))
        pending[reference] = (Record(name.as_posix(), kit.as_posix(), "crashed", made_of), kit)
        del data
    while pending:
        for reference in ray.wait(list(pending), num_returns=1)[0]:
            finish(reference)
    records.sort(key=lambda r: r.model)
    for name, content in _native.tables(json.dumps([asdict(r) for r in records])):
        kits.write(name, bytes(content))
    return records
