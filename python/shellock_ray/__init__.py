"""Kits of a folder of models on many machines, by Ray: one task a model.

``run`` reads the models where it is called, sends each with its task, and writes each kit once: into a folder here, or from the workers into an
object store (``s3://…``, ``gs://…``, any that fsspec knows). A kit whose inputs are the same is not made again. A worker that is lost loses its
model, which is then made by another.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

__all__ = ["Record", "run"]

ENDINGS = {".stl", ".obj", ".ply", ".off", ".3mf", ".glb", ".gltf", ".gz", ".zip"}
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
    pieces: Optional[int] = None
    warnings: int = 0
    said: List[str] = field(default_factory=list)
    is_old: bool = False

    def line(self) -> str:
        pieces = f", {self.pieces} pieces" if self.pieces else ""
        why = f": {self.said[0]}" if self.said and self.status != "verified" else ""
        return f"{self.model} {self.status}{pieces}, {self.seconds:.0f} s{', as it was' if self.is_old else ''}{why}"


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
        told["pieces"] = len(kit.plan["pieces"])
        warnings = [w for w in kit.warnings if w.severity != "note"]
        told["warnings"] = len(warnings)
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


def models(folder: Path, out: Optional[Path]) -> List[Tuple[Path, Path]]:
    """All models below ``folder`` but for what lies in ``out``, each with the path of its kit: as ``shellock batch`` names them."""
    found = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        is_hidden = any(part.startswith(".") for part in name.parts)
        if path.is_file() and path.suffix.lower() in ENDINGS and not is_hidden and not (out and out in path.resolve().parents):
            found.append(name)
    stems = [name.with_suffix("") for name in found]
    kit = lambda name: name.with_suffix("") if stems.count(name.with_suffix("")) == 1 else name.with_name(name.name.replace(".", "-"))
    return [(name, kit(name)) for name in found]


class _Folder:
    """Kits in a folder of this machine: each appears whole or not at all."""

    def __init__(self, out: str) -> None:
        self.out = Path(out)
        (self.out / ".batch").mkdir(parents=True, exist_ok=True)

    store = None

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
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".shellock-")
        with os.fdopen(handle, "wb") as to:
            to.write(content)
        os.replace(temporary, path)

    def keep(self, kit: Path, files: Mapping[str, bytes]) -> None:
        import shutil

        to = self.out / kit
        to.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(dir=to.parent, prefix=".shellock-"))
        try:
            for name, content in files.items():
                (temporary / name).parent.mkdir(parents=True, exist_ok=True)
                (temporary / name).write_bytes(content)
            temporary.chmod(0o755)
            if to.exists():
                if not (to / "plan.json").is_file():
                    raise FileExistsError(f"{to} holds files that are no kit; choose another folder")
                shutil.rmtree(to)
            temporary.rename(to)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)


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
    is made again up to ``retries`` times. ``told`` hears of each record as it comes, with its number and how many there are. Writes ``batch.csv``.
    """
    import ray

    import shellock

    options = dict(options or {})
    kits = _Store(out) if "://" in out else _Folder(out)
    made_with = hashlib.sha256(json.dumps([shellock.__version__, options], sort_keys=True).encode()).hexdigest()
    here = Path(folder)
    jobs = models(here, None if "://" in out else Path(out).resolve())
    # One pool of threads in each worker, as large as what it may take.
    task = ray.remote(num_cpus=cpus, max_retries=retries, runtime_env={"env_vars": {"RAYON_NUM_THREADS": str(cpus)}})(_make)
    slots = max(1, int(ray.cluster_resources().get("CPU", 1) // cpus))
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
        except (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError, ray.exceptions.RayTaskError) as e:
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
        needs = LEAST_BYTES + BYTES_PER_BYTE * len(data)
        reference = task.options(memory=needs).remote(name.name, data, options, patience, kits.kit(kit))
        pending[reference] = (Record(name.as_posix(), kit.as_posix(), "crashed", made_of), kit)
        del data
    while pending:
        for reference in ray.wait(list(pending), num_returns=1)[0]:
            finish(reference)
    records.sort(key=lambda r: r.model)
    kits.write("batch.csv", _table(records))
    return records


def _table(records: List[Record]) -> bytes:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["model", "status", "kit", "pieces", "seconds", "warnings", "said"])
    for r in records:
        said = r.said[0].replace("\n", " ") if r.said else ""
        table.writerow([r.model, r.status, r.kit, r.pieces or "", f"{r.seconds:.1f}", r.warnings, said])
    return text.getvalue().encode()
