#!/usr/bin/env python3
"""Solves the case of the example `shell_free_form` with Kratos' ShellThinElement3D3N and compares.

    pip install KratosMultiphysics KratosStructuralMechanicsApplication KratosLinearSolversApplication
    scripts/shell_kratos.py case.json
"""
import json
import sys

import KratosMultiphysics as Kratos
import KratosMultiphysics.LinearSolversApplication as LinearSolvers
import KratosMultiphysics.StructuralMechanicsApplication as Structural
import numpy as np

MOVES = [Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Y, Kratos.DISPLACEMENT_Z]
TURNS = [Kratos.ROTATION_X, Kratos.ROTATION_Y, Kratos.ROTATION_Z]
REACTIONS = [Kratos.REACTION_X, Kratos.REACTION_Y, Kratos.REACTION_Z]
MOMENTS = [Kratos.REACTION_MOMENT_X, Kratos.REACTION_MOMENT_Y, Kratos.REACTION_MOMENT_Z]


def solve(case):
    """Displacements (mm) of the points, and von Mises stress (MPa) at the worse face of each triangle's centre."""
    part = Kratos.Model().CreateModelPart("shell")
    for variable in (Kratos.DISPLACEMENT, Kratos.ROTATION, Kratos.REACTION, Kratos.REACTION_MOMENT,
                     Structural.POINT_LOAD, Kratos.VOLUME_ACCELERATION):
        part.AddNodalSolutionStepVariable(variable)
    part.ProcessInfo[Kratos.DOMAIN_SIZE] = 3
    material = part.CreateNewProperties(1)
    material[Kratos.YOUNG_MODULUS] = case["youngs_modulus_mpa"]
    material[Kratos.POISSON_RATIO] = case["poissons_ratio"]
    material[Kratos.THICKNESS] = case["wall_mm"]
    material[Kratos.DENSITY] = 0.0
    material[Kratos.CONSTITUTIVE_LAW] = Structural.LinearElasticPlaneStress2DLaw()
    for at, point in enumerate(case["points"]):
        part.CreateNewNode(at + 1, *point)
    for at, corners in enumerate(case["triangles"]):
        part.CreateNewElement("ShellThinElement3D3N", at + 1, [v + 1 for v in corners], material)
    for dof, reaction in zip(MOVES + TURNS, REACTIONS + MOMENTS):
        Kratos.VariableUtils().AddDof(dof, reaction, part)
    for v in case["held"]:
        for dof in MOVES + TURNS:
            part.GetNode(v + 1).Fix(dof)
    for at, force in enumerate(case["forces_n"]):
        if any(force):
            part.CreateNewCondition("PointLoadCondition3D1N", at + 1, [at + 1], material)
            part.GetNode(at + 1).SetSolutionStepValue(Structural.POINT_LOAD, force)
    part.SetBufferSize(2)
    solver = LinearSolvers.SparseLUSolver()
    strategy = Kratos.ResidualBasedLinearStrategy(
        part, Kratos.ResidualBasedIncrementalUpdateStaticScheme(),
        Kratos.ResidualBasedBlockBuilderAndSolver(solver), False, False, False, False)
    strategy.Initialize()
    strategy.Solve()
    moves = np.array([list(node.GetSolutionStepValue(Kratos.DISPLACEMENT)) for node in part.Nodes])
    stress = [max(von_mises(element, face, part.ProcessInfo) for face in
                  (Structural.SHELL_STRESS_TOP_SURFACE, Structural.SHELL_STRESS_BOTTOM_SURFACE))
              for element in part.Elements]
    return moves, np.array(stress)


def von_mises(element, face, info):
    """Of the mean over the triangle, where stresses are linear."""
    s = np.mean([np.array(m) for m in element.CalculateOnIntegrationPoints(face, info)], axis=0)
    return np.sqrt(s[0, 0] ** 2 - s[0, 0] * s[1, 1] + s[1, 1] ** 2 + 3 * s[0, 1] ** 2)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        case = json.load(file)
    moves, stress = solve(case)
    ours, our_stress = np.array(case["moves_mm"]), np.array(case["von_mises_mpa"])
    size, our_size = np.linalg.norm(moves, axis=1), np.linalg.norm(ours, axis=1)
    print(f"{len(case['points'])} points; ours, Kratos, ratio")
    rows = [("largest displacement, mm", our_size.max(), size.max())]
    rows += [(f"{p} % stress, MPa", np.percentile(our_stress, p), np.percentile(stress, p)) for p in (50, 90, 99, 100)]
    for name, a, b in rows:
        print(f"{name}: {a:.5g}, {b:.5g}, {a / b:.4f}")
    in_the_mean = np.percentile(case["held_in_the_mean_mpa"], (50, 90, 99, 100))
    print(f"stress where the region holds in the mean, MPa: {np.round(in_the_mean, 3)}")
    print(f"difference of displacements: {np.linalg.norm(ours - moves) / np.linalg.norm(moves):.4f} of their norm")


if __name__ == "__main__":
    main()
