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


TOKEN = re.compile(rb"/(\w+) [\d.]+ Tf|(BT)\b|(ET)\b|<([0-9A-Fa-f]*)>|(\()")
ESCAPES = {ord("n"): 10, ord("r"): 13, ord("t"): 9, ord("b"): 8, ord("f"): 12}


def objects(pdf):
    """Dictionary and unpacked stream of each object, by its number."""
    found = {}
    for number, body in re.findall(rb"^(\d+) 0 obj\n(.*?)\nendobj", pdf, re.S | re.M):
        head, _, stream = body.partition(b"stream\n")
        stream = stream.removesuffix(b"\nendstream")
        found[int(number)] = head, zlib.decompress(stream) if b"/FlateDecode" in head else stream
    return found


def reference(head, key):
    """Number of the object that a dictionary names."""
    return int(re.search(rb"/" + key + rb" (\d+) 0 R", head)[1])


def letters(table):
    """Text of each glyph of a font, from its table (ToUnicode)."""
    found = {}
    for block in re.findall(rb"beginbfchar(.*?)endbfchar", table, re.S):
        for glyph, text in re.findall(rb"<(\w+)>\s*<(\w+)>", block):
            found[int(glyph, 16)] = bytes.fromhex(text.decode()).decode("utf-16-be")
    for block in re.findall(rb"beginbfrange(.*?)endbfrange", table, re.S):
        for first, last, text in re.findall(rb"<(\w+)>\s*<(\w+)>\s*<(\w+)>", block):
            for i in range(int(first, 16), int(last, 16) + 1):
                found[i] = chr(int(text, 16) + i - int(first, 16))
    return found


def font_of(found, number):
    """Text of each glyph of a font, and how many bytes name a glyph."""
    head = found[number][0]
    return letters(found[reference(head, b"ToUnicode")][1]), 2 if b"/Type0" in head else 1


def literal(content, at):
    """Bytes of a string in parentheses that begins before `at`, and where it ends."""
    made, depth = bytearray(), 1
    while True:
        byte = content[at]
        at += 1
        if byte == ord("\\"):
            digits = re.compile(rb"[0-7]{1,3}").match(content, at)
            made.append(int(digits[0], 8) if digits else ESCAPES.get(content[at], content[at]))
            at = digits.end() if digits else at + 1
            continue
        depth += (byte == ord("(")) - (byte == ord(")"))
        if depth == 0:
            return bytes(made), at
        made.append(byte)


def lines_of(content, fonts):
    """Lines of text that a page's drawing has, in order."""
    at, line, (font, width) = 0, "", ({}, 1)
    while token := TOKEN.search(content, at):
        at = token.end()
        name, begins, ends, digits, _ = token.groups()
        if name:
            font, width = fonts[name]
        elif begins:
            line = ""
        elif ends:
            yield line
        else:
            shown, at = (bytes.fromhex(digits.decode()), at) if digits is not None else literal(content, at)
            glyphs = (int.from_bytes(shown[i : i + width], "big") for i in range(0, len(shown), width))
            line += "".join(font.get(glyph, "?") for glyph in glyphs)


def texts(pdf):
    """All lines of text, in order."""
    found = objects(pdf)
    for head, _ in list(found.values()):
        if not re.search(rb"/Type /Page\b", head):
            continue
        fonts = re.search(rb"/Font\s*<<(.*?)>>", head, re.S)
        named = re.findall(rb"/(\w+) (\d+) 0 R", fonts[1] if fonts else b"")
        tables = {name: font_of(found, int(n)) for name, n in named}
        yield from lines_of(found[reference(head, b"Contents")][1], tables)


def steps(lines):
    """Number and words of each step."""
    lines = list(lines)
    for number, words in zip(lines, lines[1:]):
        if number.isdigit() and (words == "start with this piece" or re.match(r"(the key, )?from ", words)):
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
