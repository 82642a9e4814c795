"""Ray of two workers on this machine: one is killed in the middle."""

import csv
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

ray = pytest.importorskip("ray")

import shellock_ray  # noqa: E402
from shellock import _native  # noqa: E402

PROGRAM = os.environ.get("SHELLOCK", "shellock")
OPTIONS = {"size": "60mm", "time": 0, "method": "creases", "pieces": 4, "thickness": "2mm"}
FIGURES = ["torus", "vase"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    for figure in FIGURES:
        subprocess.run([PROGRAM, "figure", figure, "--out", folder / f"{figure}.stl", "--size", "60"], check=True, capture_output=True)
    (folder / "below").mkdir()
    (folder / "below" / "broken.stl").write_text("solid nothing\n")
    return folder


@pytest.fixture(scope="module")
def cluster():
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def files(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(Path(folder).rglob("*")) if p.is_file() and ".batch" not in p.parts and not p.name.startswith("batch.")}


def workers():
    """Processes of Ray that make a kit now."""
    found = []
    for process in Path("/proc").iterdir():
        try:
            if process.name.isdigit() and b"ray::_make" in (process / "cmdline").read_bytes():
                found.append(int(process.name))
        except OSError:
            pass
    return found


def test_a_worker_that_is_killed_costs_nothing_but_time(folder, cluster, tmp_path):
    killed, heard = [], []

    def kill():
        until = time.monotonic() + 60
        while not workers() and time.monotonic() < until:
            time.sleep(0.05)
        time.sleep(1.0)
        for pid in workers()[:1]:
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    records = shellock_ray.run(str(folder), str(tmp_path / "ray"), OPTIONS, told=lambda r, number, of: heard.append((r.model, number, of)))
    killer.join()
    assert killed
    assert [r.model for r in records] == ["below/broken.stl"] + sorted(f"{f}.stl" for f in FIGURES)
    assert sorted(model for model, _, _ in heard) == [r.model for r in records] and [n for _, n, _ in heard] == [1, 2, 3]
    arguments = [f"--{name}={value}" for name, value in OPTIONS.items()]
    batch = subprocess.run([PROGRAM, "batch", folder, "--out", tmp_path / "batch", "--quiet", *arguments], capture_output=True, text=True)
    assert batch.returncode == 1, batch.stderr
    theirs = {row["model"]: row["status"] for row in csv.DictReader((tmp_path / "batch" / "batch.csv").open())}
    assert {r.model: r.status for r in records} == theirs and list(theirs.values()).count("verified") == 2
    mine, theirs = files(tmp_path / "ray"), files(tmp_path / "batch")
    assert mine.keys() == theirs.keys() and len(mine) > 20
    assert [name for name in mine if mine[name] != theirs[name]] == []
    # Again: nothing is made.
    again = shellock_ray.run(str(folder), str(tmp_path / "ray"), OPTIONS)
    assert all(r.is_old for r in again) and [r.status for r in again] == [r.status for r in records]


def test_an_object_store_has_the_same_files(folder, cluster, tmp_path):
    pytest.importorskip("fsspec")
    (tmp_path / "store").mkdir()
    records = shellock_ray.run(str(folder), f"file://{tmp_path}/store", OPTIONS)
    assert [r.status for r in records].count("verified") == 2
    assert (tmp_path / "store" / "batch.csv").is_file()
    assert {p.parent.name for p in (tmp_path / "store").rglob("plan.json")} == set(FIGURES)


def test_what_is_wrong_with_one_model_is_told_in_its_row(folder, cluster, tmp_path):
    models, out = tmp_path / "models", tmp_path / "kits"
    models.mkdir()
    for name in ("foreign", "good"):
        (models / f"{name}.stl").write_bytes((folder / "torus.stl").read_bytes())
    names = ["foreign.stl", "good.stl"]
    (out / "foreign").mkdir(parents=True)
    (out / "foreign" / "notes.txt").write_text("mine")
    (out / ".batch").mkdir()
    (out / _native.record_path("good")).write_text('{"model": "go')
    if sys.platform == "linux":
        Path(os.fsdecode(os.fsencode(models) + b"/na\xffme.stl")).write_bytes(b"solid nothing\n")
        names.append("na\ufffdme.stl")
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        (models / "secret.stl").write_bytes(b"")
        (models / "secret.stl").chmod(0)
        names.append("secret.stl")
    records = shellock_ray.run(str(models), str(out), {**OPTIONS, "pieces": np.int64(4)})
    assert [r.model for r in records] == names
    assert [r.status for r in records] == ["refused", "verified"] + ["refused"] * (len(names) - 2) and all(r.said for r in records if r.status == "refused")
    assert (out / "batch.csv").is_file() and (out / "foreign" / "notes.txt").read_text() == "mine"
    # Once the place is free, it is made.
    (out / "foreign" / "notes.txt").unlink()
    again = shellock_ray.run(str(models), str(out), OPTIONS)
    assert [(r.status, r.is_old) for r in again[:2]] == [("verified", False), ("verified", True)]
