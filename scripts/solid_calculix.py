#!/usr/bin/env python3
"""Solves the case of the example `solid_case` with CalculiX (tetrahedra of 10 nodes, contact of faces) and compares.

    apt-get install calculix-ccx; pip install pytetwild pyvista scipy
    scripts/solid_calculix.py case.json FRICTION FOLDER [EDGE_MM [ENVELOPE_MM [ENERGY]]]

Meshes and CalculiX's files are kept in FOLDER.
"""
import itertools
import json
import os
import subprocess
import sys

import numpy as np
from scipy.spatial import cKDTree

EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
FACES = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]  # CalculiX's S1 to S4, outwards
NEAR_MM = 0.4  # faces that are this near to another piece may touch it
SKIN_MM = 0.1  # as `solid::laws`: contacts are as stiff as material of that depth
ASTRAY_MM = 500.0  # as `solid`: how far the load moves a piece that nothing but springs stops
SPRINGS = 40  # nodes of a piece that share that spring
SETTLING = 0.01  # as `solid`: share of the load that takes up the play


def triangles(file):
    data = open(file, "rb").read()
    n = int.from_bytes(data[80:84], "little")
    kind = np.dtype([("normal", "<3f4"), ("corners", "<9f4"), ("rest", "<u2")])
    return np.frombuffer(data[84:84 + 50 * n], kind)["corners"].reshape(-1, 3, 3).astype(float)


def tetrahedra(file, cache, edge_mm, envelope_mm, energy):
    if not os.path.exists(cache):
        import pytetwild
        points, at = np.unique(triangles(file).reshape(-1, 3), axis=0, return_inverse=True)
        size = np.linalg.norm(np.ptp(points, axis=0))
        found = pytetwild.tetrahedralize(
            points, at.reshape(-1, 3).astype(np.int32), edge_length_fac=edge_mm / size,
            epsilon=envelope_mm / size, stop_energy=energy, coarsen=True, num_threads=1)
        np.savez(cache, v=found[0], c=found[1])
    mesh = np.load(cache)
    return mesh["v"], mesh["c"]


class Piece:
    """Tetrahedra of 10 nodes; numbers of nodes and elements from the given ones on."""

    def __init__(self, points, cells, first_node, first_cell):
        x = points[cells]
        volume = np.einsum("ij,ij->i", x[:, 1] - x[:, 0], np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 0]))
        cells[volume < 0] = cells[volume < 0][:, [0, 2, 1, 3]]
        self.volume_mm3 = np.abs(volume).sum() / 6
        pairs = np.sort(cells[:, EDGES].reshape(-1, 2), axis=1)
        edges, at = np.unique(pairs, axis=0, return_inverse=True)
        self.points = np.vstack([points, points[edges].mean(axis=1)])
        self.n_corners = len(points)
        self.cells = np.hstack([cells, len(points) + at.reshape(-1, 6)])
        self.first_node, self.first_cell = first_node, first_cell
        faces = cells[:, FACES]
        key = np.sort(faces.reshape(-1, 3), axis=1)
        _, first, count = np.unique(key, axis=0, return_index=True, return_counts=True)
        outer = first[count == 1]
        self.face_cell, self.face_side = outer // 4, outer % 4
        corners = faces.reshape(-1, 3)[outer]
        middle = {e: 4 + k for k, e in enumerate(map(frozenset, EDGES))}
        six = [list(f) + [middle[frozenset((f[i], f[(i + 1) % 3]))] for i in range(3)] for f in FACES]
        self.faces = self.cells[self.face_cell[:, None], np.array(six)[self.face_side]]
        assert (self.faces[:, :3] == corners).all()
        self.centres = self.points[corners].mean(axis=1)
        self.tree = cKDTree(self.centres)

    def spot(self, p):
        """The nearest place of the surface: six nodes and their weights."""
        best = (np.inf, None, None)
        for face in self.tree.query(p, k=min(400, len(self.faces)))[1]:
            a, b, c = self.points[self.faces[face, :3]]
            w = nearest(p, a, b, c)
            d = np.linalg.norm(w[0] * a + w[1] * b + w[2] * c - p)
            if d < best[0]:
                best = (d, face, w)
        w = best[2]
        shapes = [w[i] * (2 * w[i] - 1) for i in range(3)] + [4 * w[i] * w[(i + 1) % 3] for i in range(3)]
        return self.faces[best[1]], np.array(shapes), best[0]


def nearest(p, a, b, c):
    """Barycentric coordinates of the point of a triangle that is nearest to p."""
    u, v, n = b - a, c - a, np.cross(b - a, c - a)
    q, area = p - a, max(np.dot(n, n), 1e-30)
    t, s = np.dot(np.cross(u, q), n) / area, np.dot(np.cross(q, v), n) / area
    if s >= 0 and t >= 0 and s + t <= 1:
        return np.array([1 - s - t, s, t])
    best = (np.inf, 0, (1, 0, 0))
    for i, (x, y) in enumerate([(a, b), (b, c), (c, a)]):
        share = np.clip(np.dot(p - x, y - x) / max(np.dot(y - x, y - x), 1e-30), 0, 1)
        w = np.zeros(3)
        w[i], w[(i + 1) % 3] = 1 - share, share
        d = np.linalg.norm(x + share * (y - x) - p)
        best = min(best, (d, i, tuple(w)))
    return np.array(best[2])


def near_faces(piece, other):
    """Outer faces of a piece near another."""
    w = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
    samples = np.einsum("wk,fkx->fwx", w, other.points[other.faces[:, :3]]).reshape(-1, 3)
    own = np.einsum("wk,fkx->fwx", w, piece.points[piece.faces[:, :3]])
    d = cKDTree(samples).query(own.reshape(-1, 3), distance_upper_bound=3 * NEAR_MM)[0]
    return np.flatnonzero(d.reshape(own.shape[:2]).min(axis=1) < NEAR_MM)


def write(case, pieces, friction, file):
    """CalculiX's input; returns the pairs in contact."""
    out = []
    for i, piece in enumerate(pieces):
        out.append(f"*NODE, NSET=N{i}")
        out += [f"{piece.first_node + n},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}" for n, p in enumerate(piece.points)]
        out.append(f"*ELEMENT, TYPE=C3D10, ELSET=E{i}")
        out += [f"{piece.first_cell + n}," + ",".join(map(str, piece.first_node + c))
                for n, c in enumerate(piece.cells)]
        out.append(f"*SOLID SECTION, ELSET=E{i}, MATERIAL=M")
    stiffness = case["youngs_modulus_mpa"]
    out += ["*MATERIAL, NAME=M", "*ELASTIC", f"{stiffness},{case['poissons_ratio']}"]
    load_n = np.linalg.norm(np.array(case["forces_n"]), axis=1).sum()
    number = pieces[-1].first_cell + len(pieces[-1].cells)
    for i, piece in enumerate(pieces):
        for axis in (1, 2, 3):
            out.append(f"*ELEMENT, TYPE=SPRING1, ELSET=S{i}{axis}")
            nodes = np.linspace(0, piece.n_corners - 1, SPRINGS).astype(int)
            out += [f"{number + n},{piece.first_node + node}" for n, node in enumerate(nodes)]
            number += SPRINGS
            out += [f"*SPRING, ELSET=S{i}{axis}", f"{axis}", f"{load_n / ASTRAY_MM / SPRINGS:.6g}"]
    for i, j in itertools.combinations(range(len(pieces)), 2):
        slave, master = (i, j) if len(pieces[i].faces) > len(pieces[j].faces) else (j, i)
        sides = [near_faces(pieces[a], pieces[b]) for a, b in ((slave, master), (master, slave))]
        if not all(len(s) for s in sides):
            continue
        for own, side, name in ((slave, sides[0], "A"), (master, sides[1], "B")):
            piece = pieces[own]
            out.append(f"*SURFACE, NAME={name}{i}{j}, TYPE=ELEMENT")
            out += [f"{piece.first_cell + piece.face_cell[f]},S{piece.face_side[f] + 1}" for f in side]
        out += [f"*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE", f"A{i}{j},B{i}{j}"]
    k = stiffness / SKIN_MM
    out += ["*SURFACE INTERACTION, NAME=I", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{k},1e-6"]
    if friction > 0:
        out += ["*FRICTION", f"{friction},{k}"]
    part, x, y, z, radius = case["hold"][:5]
    held = pieces[int(part)]
    nodes = np.unique(held.faces)
    nodes = nodes[np.linalg.norm(held.points[nodes] - [x, y, z], axis=1) <= radius]
    out += ["*NSET, NSET=HELD"] + [f"{held.first_node + n}," for n in nodes]
    out += ["*BOUNDARY", "HELD,1,3"]
    pushed = pieces[case["pushed_part"]]
    force = np.zeros_like(pushed.points)
    for p, f in zip(np.array(case["pushed_at"]), np.array(case["forces_n"])):
        at, shapes, _ = pushed.spot(p)
        force[at] += shapes[:, None] * f
    for share in shares(friction):
        out += ["*STEP, INC=400", "*STATIC", "1.,1.,1e-6,1.", "*CLOAD"]
        out += [f"{pushed.first_node + n},{k + 1},{share * force[n, k]:.9g}"
                for n in np.flatnonzero(np.abs(force).max(axis=1) > 0) for k in range(3)]
        out += ["*NODE FILE, FREQUENCY=9999", "U"]
        out += [x for i in range(len(pieces)) for x in (f"*NODE PRINT, NSET=N{i}, FREQUENCY=9999", "U")]
        out.append("*END STEP")
    open(file, "w").write("\n".join(out) + "\n")


def shares(friction):
    """Shares of the load, step by step: the order matters only with friction."""
    return (SETTLING, 1.0) if friction > 0 else (1.0,)


def results(file, pieces):
    """Displacements of each piece's nodes after each step, mm; times as CalculiX counts them."""
    steps, block = {}, None
    for line in open(file):
        if "displacements" in line:
            block = steps.setdefault(float(line.split()[-1]), {})
        elif block is not None and line.strip():
            n, *u = line.split()
            block[int(n)] = [float(x) for x in u]
    return [[np.array([block[p.first_node + n] for n in range(len(p.points))]) for p in pieces]
            for _, block in sorted(steps.items())]


def main():
    case = json.load(open(sys.argv[1]))
    friction, folder = float(sys.argv[2]), sys.argv[3]
    edge_mm, envelope_mm, energy = [float(x) for x in sys.argv[4:7] + ["4", "0.015", "30"][len(sys.argv[4:7]):]]
    os.makedirs(folder, exist_ok=True)
    pieces, node, cell = [], 1, 1
    for i, file in enumerate(case["pieces"]):
        points, cells = tetrahedra(file, f"{folder}/piece-{i}.npz", edge_mm, envelope_mm, energy)
        pieces.append(Piece(points, cells, node, cell))
        node, cell = node + len(pieces[-1].points), cell + len(cells)
    name = f"{folder}/mu{friction}"
    print(f"{node - 1} nodes, {cell - 1} tetrahedra, {[round(p.volume_mm3) for p in pieces]} mm³", flush=True)
    if not os.path.exists(name + ".done"):
        write(case, pieces, friction, name + ".inp")
        with open(name + ".log", "w") as log:
            if subprocess.run(["ccx", name], stdout=log, env={**os.environ, "OMP_NUM_THREADS": "2"}).returncode:
                sys.exit("CalculiX failed: see " + name + ".log")
        open(name + ".done", "w")
    steps = results(name + ".dat", pieces)

    places = [[pieces[part].spot(np.array(p)) for part, p in zip(parts, ends)]
              for parts, ends in zip(case["parts"], case["ends_at"])]
    off = max(s[2] for ends in places for s in ends)
    print(f"places are off the tetrahedra by {off:.3f} mm at most")
    pushed = [pieces[case["pushed_part"]].spot(np.array(p)) for p in case["pushed_at"]]
    forces = np.array(case["forces_n"])
    share = np.linalg.norm(forces, axis=1) / np.linalg.norm(forces, axis=1).sum()
    parts = np.array(case["parts"])
    for load, moved in zip(shares(friction), steps):
        at = lambda part, spot: spot[1] @ moved[part][spot[0]]
        loaded = share @ np.array([at(case["pushed_part"], s) for s in pushed])
        apart = np.array([at(b, s[1]) - at(a, s[0]) for (a, b), s in zip(case["parts"], places)])
        show(f"CalculiX, load {load}", loaded, apart, parts, None)
        for run in case["runs"]:
            if run["friction"] == friction and run["load"] == load:
                ends = np.array(run["ends_mm"], dtype=float)
                ours = share @ np.array(run["pushed_mm"], dtype=float)
                show(f"ours, cells {run['cell_mm']}, load {load}", ours, ends[:, 1] - ends[:, 0], parts,
                     (loaded, apart))


def show(name, loaded, apart, parts, reference):
    """Motion of the loaded place, and the largest and the mean opening of each seam."""
    size = np.linalg.norm(apart, axis=1)
    text = f"{name}: loaded {np.linalg.norm(loaded):.3f} mm {loaded.round(3)}"
    if reference is not None:
        text += f" ({np.linalg.norm(loaded) / np.linalg.norm(reference[0]) - 1:+.1%})"
    for pair in np.unique(parts, axis=0):
        of = (parts == pair).all(axis=1)
        text += f"; {pair[0] + 1}-{pair[1] + 1} {np.nanmax(size[of]):.3f} / {np.nanmean(size[of]):.3f}"
        if reference is not None:
            its = np.linalg.norm(reference[1][of], axis=1)
            text += f" ({np.nanmax(size[of]) / its.max() - 1:+.1%} / {np.nanmean(size[of]) / its.mean() - 1:+.1%})"
    print(text, flush=True)


if __name__ == "__main__":
    main()
