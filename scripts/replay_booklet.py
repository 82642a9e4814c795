#!/usr/bin/env python3
"""Assembles a kit by its booklet alone, and says how many steps are right.

    scripts/replay_booklet.py KIT

Reads the text of KIT/instructions.pdf as a person would, page by page: a number, "from below and behind", "the key,
from below: it locks all". A step is right where the number is that of the piece that goes in then, and the words are
within 50 degrees of the way that plan.json has for it (two sides are named of three, so words are up to 45 degrees
off). Exit code 1 where fewer than 95 % are. Needs nothing but Python.
"""
import json
import math
import re
import sys
import zlib
from pathlib import Path

SIDES = {
    "above": (0, 0, 1),
    "below": (0, 0, -1),
    "the front": (0, -1, 0),
    "behind": (0, 1, 0),
    "its left": (1, 0, 0),
    "its right": (-1, 0, 0),
}
MOST_DEG = 50


def texts(pdf):
    """All lines of text, in order."""
    for stream in re.finditer(rb"stream\r?\n(.*?)endstream", pdf, re.S):
        try:
            content = zlib.decompress(stream[1])
        except zlib.error:
            continue
        for line in re.findall(rb"\(((?:\\.|[^\\)])*)\) Tj", content):
            yield line.decode("cp1252")


def steps(lines):
    """Number and words of each step."""
    lines = list(lines)
    for number, words in zip(lines, lines[1:]):
        if number.isdigit() and (words == "begin with this piece" or re.match(r"(the key, )?from ", words)):
            yield int(number), words


def towards(words):
    """Where the piece comes from; None for the first."""
    match = re.match(r"(?:the key, )?from ([^:]*)", words)
    if not match:
        return None
    named = [SIDES[side] for side in SIDES if side in match[1]]
    total = [sum(axis) for axis in zip(*named)]
    return [x / math.hypot(*total) for x in total]


def standing(up, v):
    """As the thing stands in the pictures: up is z."""
    axis = max(range(3), key=lambda k: up[k])
    x, y, z = v
    return [(-z, y, x), (x, -z, y), (x, y, z)][axis]


def main(kit):
    plan = json.loads((kit / "plan.json").read_text())
    pieces = {p["id"]: p for p in plan["pieces"]}
    told = list(steps(texts((kit / "instructions.pdf").read_bytes())))
    right = 0
    for i, (number, words) in enumerate(told):
        is_next = i < len(plan["installation_order"]) and plan["installation_order"][i] == number
        way = standing(plan["up"], pieces[number]["installation_direction"]) if number in pieces else None
        source = towards(words)
        angle = 0.0
        if source and way:
            angle = math.degrees(math.acos(max(-1, min(1, -sum(a * b for a, b in zip(source, way))))))
        is_right = is_next and way is not None and angle <= MOST_DEG
        right += is_right
        print(f"{'ok  ' if is_right else 'WRONG'} {number:3} {words} ({angle:.0f} degrees off)")
    n = len(plan["installation_order"])
    print(f"{right} of {n} steps right")
    return 0 if right >= 0.95 * n and len(told) == n else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])) if len(sys.argv) == 2 else __doc__)
