"""The programs of docs/guide/python.md run, with options that make kits soon."""

import functools
import os
import re
import subprocess
from pathlib import Path

import pytest
import shellock

PROGRAM = os.environ.get("SHELLOCK", "shellock")
GUIDE = Path(os.environ.get("SHELLOCK_GUIDE", Path(__file__).parents[2] / "docs/guide/python.md"))
SOON = {"time": 0, "method": "creases", "pieces": 4, "thickness": "3mm"}


def test_every_program_of_the_guide_runs(tmp_path, monkeypatch):
    programs = re.findall(r"^```python\n(.*?)^```", GUIDE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    assert programs
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    subprocess.run([PROGRAM, "figure", "torus", "--out", "figure.stl", "--size", "60"], check=True, capture_output=True)
    torus = trimesh.load_mesh("figure.stl")
    for name in ["design", "build"]:
        monkeypatch.setattr(shellock, name, functools.partial(getattr(shellock, name), **SOON))
    for program in programs:
        exec(compile(program, str(GUIDE), "exec"), {"points": torus.vertices, "triangles": torus.faces})
    assert (tmp_path / "figure-kit/plan.json").is_file()
