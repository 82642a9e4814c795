"""What the batch by Ray does without Ray: records, stores, words."""

import json
import os
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest

import shellock
import shellock_ray
from shellock import _native
from shellock_ray import __main__ as program

RECORD = shellock_ray.Record("a.stl", "a", "verified", "inputs", pieces=4)
OF_A = _native.record_path("a")


def content(record):
    return json.dumps(asdict(record)).encode()


def test_a_record_is_taken_where_it_is_one_of_the_same():
    assert shellock_ray._old(content(RECORD), RECORD) == RECORD
    assert shellock_ray._old(content(replace(RECORD, made_of="others")), RECORD) is None
    fields = asdict(RECORD)
    wrong = [{**fields, "status": "fine"}, {**fields, "said": 3}, {**fields, "colour": 1}, {"model": "a.stl"}, [], 3, None]
    for foreign in [None, b"", content(RECORD)[:40], b"\xff\xfe", *(json.dumps(w).encode() for w in wrong)]:
        assert shellock_ray._old(foreign, RECORD) is None


def names(folder):
    return {p.relative_to(folder).as_posix() for p in Path(folder).rglob("*") if p.is_file()}


def test_a_store_has_no_file_of_an_earlier_kit(tmp_path):
    pytest.importorskip("fsspec")
    store = shellock_ray._Store(f"file://{tmp_path}")
    earlier = {"plan.json": b"1", "pieces/piece-01.stl": b"1", "pieces/piece-07.stl": b"1", "stress.svg": b"1"}
    store.replace("a", earlier)
    store.write(OF_A, content(RECORD))
    # A kit of another model below it, and what is of no kit.
    store.replace("a/b", earlier)
    (tmp_path / "a" / "notes.txt").write_text("mine")
    below = {f"a/b/{name}" for name in earlier} | {"a/notes.txt"}
    assert names(tmp_path) == below | {f"a/{name}" for name in earlier} | {OF_A}
    store.replace("a", {"plan.json": b"2", "pieces/piece-01.stl": b"2"})
    assert names(tmp_path) == below | {"a/plan.json", "a/pieces/piece-01.stl"}
    assert (tmp_path / "a" / "plan.json").read_bytes() == b"2"


def test_a_store_keeps_what_is_no_kit(tmp_path):
    pytest.importorskip("fsspec")
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "report.html").write_text("mine")
    shellock_ray._Store(f"file://{tmp_path}").replace("a", {"plan.json": b"1"})
    assert names(tmp_path) == {"a/plan.json", "a/report.html"}


def test_a_lost_writer_leaves_a_folder_that_is_known_for_a_kit(tmp_path, monkeypatch):
    pytest.importorskip("fsspec")
    store = shellock_ray._Store(f"file://{tmp_path}")
    store.replace("a", {"plan.json": b"1", "pieces/piece-07.stl": b"1"})
    left = []
    write = store.write

    def lost(name, content):
        if len(left) == 2:
            raise KeyboardInterrupt
        left.append(name)
        write(name, content)

    monkeypatch.setattr(store, "write", lost)
    with pytest.raises(KeyboardInterrupt):
        store.replace("a", {"pieces/piece-05.stl": b"2", "pieces/piece-06.stl": b"2", "plan.json": b"2"})
    assert names(tmp_path) == {"a/plan.json", "a/pieces/piece-05.stl"}
    monkeypatch.undo()
    store.replace("a", {"plan.json": b"3"})
    assert names(tmp_path) == {"a/plan.json"}


def test_records_of_any_kits_have_short_names_of_their_own():
    kits = ["a/b", "a-b", "a b", "ä", "a" * 300, "a" * 301, "x/" * 200]
    paths = {_native.record_path(kit) for kit in kits}
    assert len(paths) == len(kits) and all(len(path.split("/")) == 2 and len(path) < 100 for path in paths)


def test_a_kit_takes_the_place_of_an_earlier_one_and_of_no_other_files(tmp_path):
    words = ["plan.json", "stress.json", "assembly.3mf", "pieces/piece-12.stl", "plates/plate-1.3mf"]
    assert all(_native.is_of_kit(word) for word in words) and not _native.is_of_kit("notes.txt")
    for word in words:
        (tmp_path / "a" / word).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "a" / word).write_bytes(b"")
    folder = shellock_ray._Folder(str(tmp_path))
    folder.write(OF_A, content(RECORD))
    folder.keep("a", {"plan.json": b"2"})
    assert names(tmp_path) == {"a/plan.json"}
    (tmp_path / "a" / "notes.txt").write_text("mine")
    with pytest.raises(shellock.InputError, match="notes.txt"):
        folder.keep("a", {"plan.json": b"3"})


def test_options_given_several_times_are_a_list_and_flags_are_booleans():
    assert program._options(["keep-whole=1", "keep-whole=2", "key-grip=true", "no-repair=false", "play-together", "size=15cm"]) == {
        "keep_whole": ["1", "2"], "key_grip": True, "no_repair": False, "play_together": True, "size": "15cm"}


@pytest.mark.parametrize("words, says", [
    (["nofolder"], "nofolder"), (["."], "contains no model"), ([".", "--option", "sise=3"], 'no option "sise"'), ([".", "--option", "size=big"], "--size"),
    ([".", "--cpus", "0"], "1 or more"), ([".", "--patience", "0"], "more than 0"),
])
def test_what_is_wrong_is_said_in_a_line(words, says, tmp_path):
    told = subprocess.run([sys.executable, "-m", "shellock_ray", *words, "--out", "kits"], cwd=tmp_path, capture_output=True, text=True)
    assert told.returncode == 2 and says in told.stderr and told.stderr.startswith("error: ") and told.stderr.count("\n") == 1
    assert not (tmp_path / "kits").exists()


def test_run_refuses_in_its_own_words(tmp_path):
    (tmp_path / "a.stl").write_text("solid nothing\n")
    for folder, options in [("nofolder", {}), (str(tmp_path), {"sise": 3}), (str(tmp_path), {"size": b"60"})]:
        with pytest.raises(shellock.InputError):
            shellock_ray.run(folder, str(tmp_path / "kits"), options)
    (tmp_path / "file").write_text("")
    with pytest.raises(shellock.WriteError):
        shellock_ray._Folder(str(tmp_path / "file"))
    with pytest.raises(shellock.InputError, match="nosuch"):
        shellock_ray._Store("nosuch://kits")
