#!/usr/bin/env python3
"""`viwo evaluate` against the published formulas of APE and RPE: test_evaluate.py VIWO

APE: root mean square of the positions after the alignment of Umeyama without scale, here as the
largest eigenvector of Horn's matrix, and without any alignment. RPE: root mean square, and mean, of
the translations of relative motions over a path length of the reference, of all pairs: the first pose
at or beyond that length, and, as evo pairs them (--all_pairs --pairs_from_reference), the nearest one
within a tenth of it, which is nearly the same. Both trajectories have the same stamps.
"""
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile


def mul(a, b):  # quaternions x y z w
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def conj(q):
    return (-q[0], -q[1], -q[2], q[3])


def rotate(q, v):
    return mul(mul(q, (*v, 0.)), conj(q))[:3]


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def horn(reference, estimate):
    """Rotation that takes the estimate to the reference, both centred, by power iteration."""
    s = [[sum(e[i] * r[j] for r, e in zip(reference, estimate)) for j in range(3)] for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = s
    n = [[xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
         [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]]
    shift = max(sum(abs(v) for v in row) for row in n)  # all eigenvalues positive
    q = [1., .1, .2, .3]
    for _ in range(20000):
        q = [sum(a * b for a, b in zip(row, q)) + shift * v for row, v in zip(n, q)]
        length = math.sqrt(sum(v * v for v in q))
        q = [v / length for v in q]
    return (q[1], q[2], q[3], q[0])


def centred(points):
    mean = [sum(p[i] for p in points) / len(points) for i in range(3)]
    return [sub(p, mean) for p in points]


def main():
    draw = random.Random(1)
    turn = (0.1, 0.2, 0.4, math.sqrt(1 - 0.21))
    reference, estimate = [], []
    for k in range(600):
        a = 0.02 * k
        p = (5 * math.sin(a), 3 * math.cos(1.3 * a), 0.8 * math.sin(0.7 * a))
        q = (0., 0., math.sin(a / 2), math.cos(a / 2))
        reference.append((p, q))
        noisy = tuple(x + draw.gauss(0., 0.03) for x in p)
        estimate.append((tuple(x + y for x, y in zip(rotate(turn, noisy), (1., -2., 3.))), mul(turn, q)))
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for name, poses in [("r.tum", reference), ("e.tum", estimate)]:
            names.append(pathlib.Path(folder) / name)
            names[-1].write_text("".join(" ".join(repr(x) for x in (0.1 * k, *p, *q)) + "\n"
                                         for k, (p, q) in enumerate(poses)))
        told, as_it_is = [json.loads(subprocess.run(
            [sys.argv[1], "evaluate", "--reference", names[0], "--estimate", names[1], "--align",
             align], check=True, capture_output=True, text=True).stdout) for align in ("se3", "none")]
    r, e = centred([p for p, _ in reference]), centred([p for p, _ in estimate])
    rotation = horn(r, e)
    ape = rms([math.hypot(*sub(rotate(rotation, b), a)) for a, b in zip(r, e)])
    off = rms([math.hypot(*sub(b, a)) for (a, _), (b, _) in zip(reference, estimate)])
    checks = [("ate_m", told["ate_m"], ape, 1e-6), ("ate_m as it is", as_it_is["ate_m"], off, 1e-6)]
    path = [0.]
    for (p, _), (before, _) in zip(reference[1:], reference):
        path.append(path[-1] + math.hypot(*sub(p, before)))
    assert told["rpe"], told
    for length, rpe in told["rpe"].items():
        wanted = float(length)
        errors, as_evo = [], []
        for i in range(len(path)):
            def error(j):
                moved = [rotate(conj(t[i][1]), sub(t[j][0], t[i][0])) for t in (reference, estimate)]
                return math.hypot(*sub(moved[1], moved[0]))
            first = next((j for j in range(i, len(path))
                          if path[j] - path[i] >= wanted * (1 - 1e-9)), None)
            if first is not None:
                errors.append(error(first))
            nearest = min(range(i, len(path)), key=lambda j: abs(path[j] - path[i] - wanted))
            if abs(path[nearest] - path[i] - wanted) <= 0.1 * wanted:
                as_evo.append(error(nearest))
        checks += [(f"rpe {length}", rpe["rmse_m"], rms(errors), 1e-6),
                   (f"rpe {length}, mean", rpe["m"], sum(errors) / len(errors), 1e-6),
                   (f"rpe {length}, pairs of evo", rpe["rmse_m"], rms(as_evo), 0.03)]
    for name, got, wanted, tolerance in checks:
        print(f"{name}: viwo {got} formula {wanted}")
        if not math.isclose(got, wanted, rel_tol=tolerance):
            sys.exit(f"{name} differs")


if __name__ == "__main__":
    main()
