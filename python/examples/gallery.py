"""Kits of the program's figures, and one page with all of them: python gallery.py OUT [SHELLOCK]"""

import html
import subprocess
import sys
from pathlib import Path

import shellock

FIGURES = ["squirrel", "cat", "teddy", "octopus", "dinosaur", "vase", "torus", "fish", "arms"]


def main() -> None:
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery")
    program = sys.argv[2] if len(sys.argv) > 2 else "shellock"
    out.mkdir(parents=True, exist_ok=True)
    cells = []
    for figure in FIGURES:
        model = out / f"{figure}.stl"
        subprocess.run([program, "figure", figure, "--out", model, "--size", "120"], check=True, stdout=subprocess.DEVNULL)
        kit = shellock.build(model, size="120mm", progress=lambda p: print(f"\r{figure}: {p.number}/{p.count}  ", end="") if p.number else None)
        kit.save(out / figure, force=True)
        verdict = "passes every check" if kit.passed else "fails a check"
        print(f"\r{figure}: {len(kit.pieces)} pieces, {verdict}")
        cells.append(f'<figure><a href="{figure}/report.html"><img src="{figure}/pieces.png" width="320"></a><figcaption>{html.escape(figure)}: {len(kit.pieces)} pieces, {verdict}</figcaption></figure>')
    (out / "index.html").write_text(f'<!doctype html><meta charset="utf-8"><title>Kits</title><body style="display:flex;flex-wrap:wrap;font-family:sans-serif">{"".join(cells)}', encoding="utf-8")


if __name__ == "__main__":
    main()
