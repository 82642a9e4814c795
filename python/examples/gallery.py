"""Ten kits of the program's figures, and one page with all of them: python gallery.py OUT [SHELLOCK]"""

import html
import subprocess
import sys
from pathlib import Path

import shellock

FIGURES = ["squirrel", "cat", "teddy", "octopus", "dinosaur", "vase", "torus", "fish", "arms"]
# One kit of each, and of the first another for a filament printer.
KITS = [(figure, {}) for figure in FIGURES] + [("squirrel", {"printer": "fdm"})]
PAGE = '<!doctype html><meta charset="utf-8"><title>Kits</title><body style="display:flex;flex-wrap:wrap;font-family:sans-serif">'


def told(figure):
    """Prints how far the kit is, on one line."""
    return lambda p: print(f"\r{figure}: {p.number}/{p.count}  ", end="", flush=True) if p.number else None


def main() -> None:
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "gallery")
    program = sys.argv[2] if len(sys.argv) > 2 else "shellock"
    out.mkdir(parents=True, exist_ok=True)
    cells = []
    for figure, options in KITS:
        name = "-".join([figure, *options.values()])
        model = out / f"{figure}.stl"
        subprocess.run([program, "figure", figure, "--out", model, "--size", "120"], check=True, stdout=subprocess.DEVNULL)
        kit = shellock.build(model, size="120mm", progress=told(name), **options)
        kit.save(out / name, force=True)
        words = f"{name}: {len(kit.pieces)} pieces, {'passes every check' if kit.passed else 'fails a check'}"
        print(f"\r{words}")
        link = f'<a href="{name}/report.html"><img src="{name}/pieces.png" width="320"></a>'
        cells.append(f"<figure>{link}<figcaption>{html.escape(words)}</figcaption></figure>")
    (out / "index.html").write_text(PAGE + "".join(cells), encoding="utf-8")


if __name__ == "__main__":
    main()
