"""The built wheel, in an environment of its own. SHELLOCK is the program, FIGURES a folder for figures that it makes."""

import copy
import gc
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

import shellock

PROGRAM = os.environ.get("SHELLOCK", "shellock")
FAST = {"size": "60mm", "time": 0, "method": "creases", "pieces": 4, "thickness": "2mm"}


def program(*arguments, cwd, check=True):
    return subprocess.run([PROGRAM, *map(str, arguments)], cwd=cwd, check=check, capture_output=True, text=True)


def write_ply(path, points, triangles, labels=None):
    """As the program writes PLY: doubles, and 32-bit corners."""
    head = f"ply\nformat binary_little_endian 1.0\ncomment written by shellock\nelement vertex {len(points)}\n"
    head += "property double x\nproperty double y\nproperty double z\n"
    head += f"element face {len(triangles)}\nproperty list uchar uint vertex_indices\n"
    fields = [("n", "u1"), ("v", "<u4", 3)]
    if labels is not None:
        head += "property int label\n"
        fields.append(("l", "<i4"))
    faces = np.zeros(len(triangles), dtype=fields)
    faces["n"], faces["v"] = 3, triangles
    if labels is not None:
        faces["l"] = labels
    Path(path).write_bytes((head + "end_header\n").encode() + np.asarray(points, "<f8").tobytes() + faces.tobytes())


def ball(n=24, radius=30.0):
    """A closed ball of quads in rings, cut in two: points and triangles."""
    points = [(0, 0, radius)]
    for i in range(1, n):
        t = np.pi * i / n
        points += [(radius * np.sin(t) * np.cos(2 * np.pi * j / n), radius * np.sin(t) * np.sin(2 * np.pi * j / n), radius * np.cos(t)) for j in range(n)]
    points.append((0, 0, -radius))
    at = lambda i, j: 1 + (i - 1) * n + j % n
    triangles = [(0, at(1, j), at(1, j + 1)) for j in range(n)]
    for i in range(1, n - 1):
        for j in range(n):
            triangles += [(at(i, j), at(i + 1, j), at(i + 1, j + 1)), (at(i, j), at(i + 1, j + 1), at(i, j + 1))]
    last = len(points) - 1
    triangles += [(at(n - 1, j), last, at(n - 1, j + 1)) for j in range(n)]
    return np.array(points, float), np.array(triangles)


@pytest.fixture(scope="module")
def vase(tmp_path_factory):
    """The program's own figure, as arrays."""
    folder = tmp_path_factory.mktemp("vase")
    program("figure", "vase", "--out", "vase.stl", "--size", "60", cwd=folder)
    raw = np.fromfile(folder / "vase.stl", dtype=np.uint8)[84:].reshape(-1, 50)
    corners = raw[:, 12:48].copy().view("<f4").reshape(-1, 3).astype(float)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    return points, index.reshape(-1, 3)


@pytest.fixture(scope="module")
def kit(vase):
    return shellock.design(*vase, name="vase", **FAST)


def test_a_kit_has_the_bytes_that_the_command_line_writes(kit, vase, tmp_path):
    write_ply(tmp_path / "vase.ply", *vase)
    arguments = [f"--{name}={value}" for name, value in FAST.items()]
    program("build", "vase.ply", *arguments, "-o", "theirs", "--quiet", cwd=tmp_path)
    kit.save(tmp_path / "mine")
    files = lambda folder: {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    mine, theirs = files(tmp_path / "mine"), files(tmp_path / "theirs")
    assert mine.keys() == theirs.keys()
    assert [name for name in mine if mine[name] != theirs[name]] == []
    assert kit.passed and all(f.verdict != "refuted" for f in shellock.check(tmp_path / "mine"))
    with pytest.raises(shellock.InputError):
        kit.save(tmp_path / "mine")
    kit.save(tmp_path / "mine", force=True)


def test_pieces_are_closed_and_the_plan_names_them(kit):
    assert len(kit.pieces) == len(kit.plan["pieces"]) >= 3
    for points, triangles in kit.pieces:
        assert points.dtype == np.float64 and triangles.dtype == np.uint32 and points.shape[1] == triangles.shape[1] == 3
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
    assert all(w.severity in ("note", "warning", "problem") and w.message for w in kit.warnings)
    assert "Kit of" in repr(kit) and all(check["ok"] for check in kit.checks)


def test_a_kit_outlives_what_it_was_made_of(vase):
    labels = shellock.segment(*vase, **FAST)
    again = shellock.segment(vase[0].copy(), vase[1].copy(), **FAST)
    gc.collect()
    assert labels.shape == (len(vase[1]),) and labels.min() == 1 and (labels == again).all()


def test_labels_decide_where_pieces_are():
    points, triangles = ball()
    middle = points[triangles].mean(axis=1)
    labels = (middle[:, 0] > 0) * 4 + (middle[:, 1] > 0) * 2 + (middle[:, 2] > 0) + 1
    found = shellock.segment(points, triangles, labels, size=80)
    same = [(np.bincount(found[labels == k]).max() / (labels == k).sum()) for k in range(1, 9)]
    assert min(same) > 0.8


def test_trimesh_goes_in_and_comes_out(kit, vase):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(*vase, process=False)
    assert (shellock.segment(mesh, **FAST) == shellock.segment(*vase, **FAST)).all()
    assert all(m.is_watertight for m in kit.meshes())


def test_what_is_wrong_is_said_with_code_and_place():
    points, triangles = ball()
    with pytest.raises(shellock.InputError) as no_body:
        shellock.design(points, triangles[: len(triangles) // 2])
    assert no_body.value.code == 2 and no_body.value.at is not None and len(no_body.value.at) == 3
    for options, says in [({"sise": 3}, "no option"), ({"size": "big"}, "--size"), ({"printer": "fmd"}, "did you mean fdm")]:
        with pytest.raises(shellock.InputError, match=says):
            shellock.design(points, triangles, **options)
    with pytest.raises(shellock.InputError, match="there are"):
        shellock.design(points, triangles + 10_000)
    with pytest.raises(ValueError, match="whole numbers"):
        shellock.design(points, triangles.astype(float))
    with pytest.raises(shellock.InputError, match="labels"):
        shellock.segment(points, triangles, [1, 2, 3])
    with pytest.raises(shellock.InputError, match="trimesh"):
        shellock.design(points)


def box(x, y, z):
    """A closed box between two numbers on each axis."""
    corner = np.array([[(x, y, z)[k][i >> k & 1] for k in range(3)] for i in range(8)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return corner, np.array([t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def test_an_assembly_is_judged_as_the_command_line_judges_it(kit, tmp_path):
    def judged(pieces, ways, clearance=0.1):
        for k, piece in enumerate(pieces):
            write_ply(tmp_path / f"{k}.ply", *piece)
        entries = [{"file": f"{k}.ply", **({"pulled_out_along": list(way)} if way else {})} for k, way in enumerate(ways)]
        (tmp_path / "assembly.json").write_text(json.dumps({"clearance": clearance, "pieces": entries}))
        theirs = json.loads(program("verify", ".", "--json", cwd=tmp_path, check=False).stdout)
        mine = shellock.verify(pieces, ways, clearance)
        assert mine == {key: theirs[key] for key in mine}
        return mine

    # A lid on a box: the box, which is no key, moves away as well as the lid.
    loose = judged([box((0, 20), (0, 20), (0, 10)), box((0, 20), (0, 20), (10.1, 20))], [None, (0, 0, 1)])
    assert not loose["passed"] and any(f["kind"] == "loose" and f["piece"] == 1 for f in loose["findings"])
    # What a kit calls its pieces holds as an assembly of any other maker's.
    ways = [[-x for x in piece["installation_direction"]] for piece in kit.plan["pieces"]]
    assert judged(kit.pieces, ways, kit.plan["clearance"])["passed"]
    stack = [box((0, 20), (0, 20), (z, z + 9.9)) for z in (0, 10)]
    with pytest.raises(shellock.InputError, match="at least two"):
        shellock.verify(stack[:1], [None])
    with pytest.raises(shellock.InputError, match="pulled_out_along"):
        shellock.verify(stack, [None, None])


def test_options_are_those_of_the_program():
    names = [o["name"] for o in shellock.options()]
    told = program("build", "--help-all", cwd=".").stdout
    assert all(f"--{name.replace('_', '-')}" in told for name in names) and "printer" in names


def test_other_threads_go_on_and_progress_is_told_in_this_one(vase):
    counted, heard, stop = [0], [], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.002)

    other = threading.Thread(target=count)
    other.start()
    began = time.time()
    shellock.design(*vase, progress=lambda p: heard.append((p, threading.current_thread())), **FAST)
    seconds = time.time() - began
    stop.set()
    other.join()
    assert counted[0] > 20 * seconds, "the interpreter was free"
    assert {t for _, t in heard} == {threading.main_thread()}
    assert any(p.number > 10 and p.count >= p.number for p, _ in heard)


def test_what_progress_raises_ends_the_job_and_progress_is_not_called_again():
    class Enough(Exception):
        pass

    calls = []

    def enough(_):
        calls.append(time.time())
        # Long enough for the job to report further stages, which wait for their turn.
        time.sleep(0.5)
        raise Enough(len(calls))

    with pytest.raises(Enough, match="^1$"):
        shellock.design(*ball(), progress=enough, **{**FAST, "method": "auto", "pieces": 9})
    assert len(calls) == 1
    assert time.time() - calls[0] < 30, "the job stopped"


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupt_ends_it(vase):
    # Once the job is under way, however busy the machine is.
    timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))
    told = []

    def start(_):
        if not told:
            told.append(time.time())
            timer.start()

    with pytest.raises(KeyboardInterrupt):
        shellock.design(*vase, progress=start, **{**FAST, "size": "150mm", "method": "auto"})
    assert time.time() - told[0] < 10


@pytest.mark.parametrize("kind", [shellock.ShellockError, shellock.InputError, shellock.NoPlanError, shellock.WriteError])
def test_errors_can_be_sent_and_copied(kind):
    error = kind("no", 2, (1.0, 2.0, 3.0))
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error), copy.deepcopy(error)):
        assert type(again) is kind and (str(again), again.code, again.at) == ("no", 2, (1.0, 2.0, 3.0))


POOL = """
import multiprocessing, sys
import shellock
def wrong(size):
    return shellock.build(b"solid nothing\\n", name="a.stl", size=size)
if __name__ == "__main__":
    how, is_used = sys.argv[1], sys.argv[2] == "used"
    if is_used:
        try:
            wrong(3)
        except shellock.InputError:
            pass
    with multiprocessing.get_context(how).Pool(1) as pool:
        try:
            pool.apply(wrong, (3,))
        except shellock.ShellockError as e:
            print(type(e).__name__, e)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.parametrize("how, used, says", [("fork", "used", "ShellockError this process was forked"), ("fork", "unused", "InputError a.stl"), ("spawn", "used", "InputError a.stl")])
def test_a_worker_says_what_is_wrong_and_does_not_hang(how, used, says, tmp_path):
    (tmp_path / "pool.py").write_text(POOL)
    told = subprocess.run([sys.executable, tmp_path / "pool.py", how, used], capture_output=True, text=True, timeout=60)
    assert told.stdout.startswith(says), told.stderr


def test_values_of_options_may_be_of_numpy_and_are_else_refused_by_name():
    plain = lambda **options: json.loads(shellock._options(options))
    assert plain(size=np.float32(60), seed=np.array(3), key_grip=np.bool_(True)) == {"size": 60.0, "seed": 3, "key-grip": True}
    assert plain(key=(1, 2, 3.5)) == {"key": "1,2,3.5"} and plain(key=np.array([1, 2, 3])) == {"key": "1,2,3"}
    assert plain(keep_whole=[(0, 0, 9, 5), 3]) == {"keep-whole": ["0,0,9,5", 3]}
    for value in (Path("a"), Decimal(3), b"60", float("nan"), np.float64("inf"), {"a": 1}, np.array("2020", "M8")):
        with pytest.raises(shellock.InputError, match="size: this is not"):
            shellock.build(b"solid nothing\n", name="a.stl", size=value)


def test_python_keeps_its_own_warning():
    names = {}
    exec("from shellock import *", names)
    assert "Warning" not in names and "design" in names and shellock.Warning.__module__ == "shellock"
