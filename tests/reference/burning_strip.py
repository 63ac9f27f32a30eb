"""The burning paper's step written a second time, in plain Python: the cases of tests/reference/cases.

  burning_strip.py           writes the cases
  burning_strip.py --check   compares what is there with what it would write

It shares nothing with the program: loops over a sheet of 3 x 2 cells, dense systems, Gaussian elimination. Equations
(eq.) are the paper's as docs/theory.md reads them. NAME.obj is the mesh, NAME.params.json the input, NAME.expected.json
the result. Particles are the mesh's vertices, then one lattice point a cell. Springs are numbered within their colour:
red cell by cell and corner by corner, blue in the order in which a walk round the cells first meets the edges, green
in the order of the blue edges that they cross, yellow cell by cell.
"""

import json
import math
import pathlib
import sys

CASES = pathlib.Path(__file__).resolve().parent / "cases"
NX, NY, EDGE = 3, 2, 0.2
COLOURS = "RGBY"


def plus(a, b, factor=1.0):
    return [p + factor * q for p, q in zip(a, b)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def length(a):
    return math.sqrt(dot(a, a))


def solve(matrix, right):
    """Gaussian elimination with the largest pivot."""
    n = len(right)
    rows = [list(row) + [value] for row, value in zip(matrix, right)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            if factor:
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    result = [0.0] * n
    for k in reversed(range(n)):
        result[k] = (rows[k][n] - sum(rows[k][j] * result[j] for j in range(k + 1, n))) / rows[k][k]
    return result


class Sheet:
    """The body-centred-square shell of a flat grid (section 3.2)."""

    def __init__(self, thickness, density):
        self.points = [[i * EDGE, j * EDGE, 0.0] for j in range(NY + 1) for i in range(NX + 1)]
        self.cells = []
        for j in range(NY):
            for i in range(NX):
                first = j * (NX + 1) + i
                self.cells.append([first, first + 1, first + NX + 2, first + NX + 1])
        self.corners = len(self.points)
        rest = [list(point) for point in self.points]
        for cell in self.cells:
            rest.append([sum(self.points[p][c] for p in cell) / 4 for c in range(2)] + [thickness])
        self.particles = len(rest)
        self.mass = [0.0] * self.particles
        for c, cell in enumerate(self.cells):
            self.mass[self.lattice(c)] += density * EDGE * EDGE / 2
            for p in cell:
                self.mass[p] += density * EDGE * EDGE / 8
        # Springs, and the triangles that share each: 4 c + k is corners k and k + 1 of cell c with its middle.
        self.springs = {colour: [] for colour in COLOURS}
        self.triangles = {colour: [] for colour in COLOURS}
        at_edge = {}
        for c, cell in enumerate(self.cells):
            for k in range(4):
                self.add("R", cell[k], self.lattice(c), [4 * c + k, 4 * c + (k + 3) % 4])
                at_edge.setdefault(frozenset((cell[k], cell[(k + 1) % 4])), []).append(4 * c + k)
            for k in range(2):
                self.add("Y", cell[k], cell[k + 2], range(4 * c, 4 * c + 4))
        for edge, triangles in at_edge.items():
            self.add("B", *sorted(edge), triangles)
            if len(triangles) == 2:
                self.add("G", self.lattice(triangles[0] // 4), self.lattice(triangles[1] // 4), triangles)
        self.initial_length = {colour: [length(plus(rest[a], rest[b], -1)) for a, b in self.springs[colour]]
                               for colour in COLOURS}

    def lattice(self, cell):
        return self.corners + cell

    def add(self, colour, a, b, triangles):
        self.springs[colour].append((a, b))
        self.triangles[colour].append(list(triangles))


class Run:
    """The state of a sheet, and its steps."""

    def __init__(self, sheet, case):
        self.sheet, self.p = sheet, case["params"]
        self.x = [list(row) for row in case["x0"]]
        self.v = [list(row) for row in case["v0"]]
        self.rest = [list(row) for row in case["x0"]]
        self.temperature = list(case["T0"])
        self.mass = list(sheet.mass)
        self.mass_change = [0.0] * sheet.particles
        self.time = 0.0
        self.triangle_lives = [True] * (4 * len(sheet.cells))
        self.lives = {colour: [True] * len(sheet.springs[colour]) for colour in COLOURS}
        self.target = {colour: list(sheet.initial_length[colour]) for colour in COLOURS}

    def umbrella(self):
        """E_i, and the pairs that conduct with 1/d_ij (eq. 3)."""
        e, pairs = [0.0] * self.sheet.particles, []
        for colour in COLOURS:
            for s, (a, b) in enumerate(self.sheet.springs[colour]):
                if self.lives[colour][s]:
                    d = length(plus(self.x[a], self.x[b], -1))
                    e[a] += d
                    e[b] += d
                    pairs.append((a, b, 1 / d))
        return e, pairs

    def heat(self):
        h, p = self.p["h"], self.p
        for ball in p["balls"]:
            centre = plus(ball["centre"], ball["velocity"], self.time)
            for i in range(self.sheet.particles):
                near = 1 - dot(plus(self.x[i], centre, -1), plus(self.x[i], centre, -1)) / ball["radius"] ** 2
                if near > 0 and self.mass[i] > 0:
                    share = (1 - math.exp(-ball["rate"] * h)) * near * near
                    self.temperature[i] += share * max(ball["T"] - self.temperature[i], 0)
        for i in range(self.sheet.particles):
            if self.mass[i] > 0:
                self.temperature[i] -= p["eta"] * self.mass_change[i] / self.sheet.mass[i]
        # E_i/2 (T_i' - T_i) = h alpha sum_j (T_j' - T_i')/d_ij: eq. 2 and 3 by backward Euler.
        e, pairs = self.umbrella()
        n = self.sheet.particles
        matrix = [[0.0] * n for _ in range(n)]
        for i in range(n):
            matrix[i][i] = e[i] / 2 if e[i] > 0 else 1.0
        right = [matrix[i][i] * self.temperature[i] for i in range(n)]
        for a, b, inverse in pairs:
            weight = h * p["alpha"] * inverse
            for row, column in ((a, b), (b, a)):
                matrix[row][row] += weight
                matrix[row][column] -= weight
        self.temperature = solve(matrix, right)

    def burn(self):
        p = self.p
        for i in range(self.sheet.particles):
            mu = p["mu"] * p["layer_mu"][1 if i >= self.sheet.corners else 0]
            excess = max(self.temperature[i] - p["T_ignition"], 0)
            least = min(self.mass[i], p["m_min"] * self.sheet.mass[i])
            after = max(self.mass[i] - mu * p["h"] * self.sheet.mass[i] * excess, least)  # eq. 4
            self.mass_change[i], self.mass[i] = after - self.mass[i], after
        volume = []
        for i in range(self.sheet.particles):
            ratio = self.mass[i] / self.sheet.mass[i] if self.mass[i] > 0 else p["m_min"]
            burnt = min(max((1 - ratio) / (1 - p["m_min"]), 0), 1)
            volume.append(min(ratio / (1 + (p["rho_ratio"] - 1) * burnt), 1))  # eq. 5
        for colour in COLOURS:
            for s, (a, b) in enumerate(self.sheet.springs[colour]):
                self.target[colour][s] = self.sheet.initial_length[colour][s] * (volume[a] + volume[b]) / 2  # eq. 6

    def level(self):
        return [m / initial - self.p["m_loss"] for m, initial in zip(self.mass, self.sheet.mass)]

    def ablate(self):
        level = self.level()
        for c, cell in enumerate(self.sheet.cells):
            for k in range(4):
                points = [cell[k], cell[(k + 1) % 4], self.sheet.lattice(c)]
                if all(level[i] < 0 for i in points):
                    self.triangle_lives[4 * c + k] = False
        has_springs = [False] * self.sheet.particles
        for colour in COLOURS:
            for s, (a, b) in enumerate(self.sheet.springs[colour]):
                self.lives[colour][s] = any(self.triangle_lives[t] for t in self.sheet.triangles[colour][s])
                if self.lives[colour][s]:
                    has_springs[a] = has_springs[b] = True
        for i in range(self.sheet.particles):
            if not has_springs[i]:
                self.mass[i] = self.mass_change[i] = 0.0

    def error(self):
        """||C|| (eq. 10)."""
        total = 0.0
        for colour in COLOURS:
            for s, (a, b) in enumerate(self.sheet.springs[colour]):
                if self.lives[colour][s]:
                    arm = plus(self.x[a], self.x[b], -1)
                    total += (dot(arm, arm) / self.target[colour][s] - self.target[colour][s]) ** 2
        return math.sqrt(total)

    def project(self, colour, inverse_mass):
        """x -= W J^T lambda with (J W J^T + shift) lambda = w C (eq. 16, 17, 19)."""
        springs = [(s, a, b) for s, (a, b) in enumerate(self.sheet.springs[colour])
                   if self.lives[colour][s] and inverse_mass[a] + inverse_mass[b] > 0]
        if not springs:
            return
        gradient, right = [], []
        weight = self.p["weights"].get(colour, 1.0)
        for s, a, b in springs:
            arm = plus(self.x[a], self.x[b], -1)
            target = self.target[colour][s]
            gradient.append([2 / target * value for value in arm])
            right.append(weight * (dot(arm, arm) / target - target))
        matrix = [[0.0] * len(springs) for _ in springs]
        for i, (_, a, b) in enumerate(springs):
            for j, (_, c, d) in enumerate(springs):
                shared = sum(sign * inverse_mass[p] for p, q, sign in
                             ((a, c, 1), (a, d, -1), (b, c, -1), (b, d, 1)) if p == q)
                matrix[i][j] = shared * dot(gradient[i], gradient[j])
        # Relative to the largest entry of a spring between particles of half the mean mass.
        left = [mass for mass in self.mass if mass > 0]
        half_mean_mass = sum(left) / len(left) / 2
        living = [(a, b, self.target[colour][s]) for s, (a, b) in enumerate(self.sheet.springs[colour])
                  if self.lives[colour][s]]
        arms = [(plus(self.x[a], self.x[b], -1), target) for a, b, target in living]
        shift = self.p["reg"] * 2 / half_mean_mass * max(4 * dot(arm, arm) / target ** 2 for arm, target in arms)
        for i in range(len(springs)):
            matrix[i][i] += shift
        multipliers = solve(matrix, right)
        for (_, a, b), g, multiplier in zip(springs, gradient, multipliers):
            self.x[a] = plus(self.x[a], g, -inverse_mass[a] * multiplier)
            self.x[b] = plus(self.x[b], g, inverse_mass[b] * multiplier)

    def touch(self, held, correct):
        """Calls correct(i, normal, gap) for particles that may move and spheres."""
        for sphere in self.p["spheres"]:
            for i in range(self.sheet.particles):
                arm = plus(self.x[i], sphere["centre"], -1)
                if not held[i]:
                    correct(i, [value / length(arm) for value in arm], length(arm) - sphere["radius"])

    def push_out(self, i, normal, gap):
        if gap < 0:
            self.x[i] = plus(self.x[i], normal, -gap)

    def stop(self, i, normal, gap):
        if gap < 1e-9 and dot(self.v[i], normal) < 0:
            self.v[i] = plus(self.v[i], normal, -dot(self.v[i], normal))

    def step(self):
        p, h, n = self.p, self.p["h"], self.sheet.particles
        self.heat()
        self.burn()
        self.ablate()
        start = [list(row) for row in self.x]
        held = [i in p["fixed"] or self.mass[i] == 0 for i in range(n)]
        for i in range(n):
            self.v[i] = [math.exp(-p["damping"] * h) * value for value in plus(self.v[i], p["gravity"], h)]  # eq. 8
            if self.mass[i] == 0:
                self.v[i] = [0.0] * 3
            self.x[i] = list(self.rest[i]) if i in p["fixed"] else plus(self.x[i], self.v[i], h)  # eq. 9
        moved = [list(row) for row in self.x]
        inverse_mass = [0.0 if held[i] else 1 / self.mass[i] if p["mass_weighted"] else 1.0 for i in range(n)]
        for _ in range(p["max_iter"]):
            for colour in p["order"]:
                self.project(colour, inverse_mass)
            self.touch(held, self.push_out)
        for i in range(n):
            self.v[i] = ([value / h for value in plus(self.x[i], start[i], -1)] if held[i] else
                         plus(self.v[i], plus(self.x[i], moved[i], -1), 1 / h))  # eq. 13
        self.touch(held, self.stop)
        self.time += h
        return self.error()

    def cut(self):
        """Number and area of the drawn triangles whose level is at least 0, cut where it passes 0."""
        level, count, area = self.level(), 0, 0.0
        for c, cell in enumerate(self.sheet.cells):
            middle = [sum(self.x[p][k] for p in cell) / 4 for k in range(3)]
            for k in range(4):
                if not self.triangle_lives[4 * c + k]:
                    continue
                polygon = []
                corners = [(self.x[cell[k]], level[cell[k]]), (self.x[cell[(k + 1) % 4]], level[cell[(k + 1) % 4]]),
                           (middle, level[self.sheet.lattice(c)])]
                for (a, m_a), (b, m_b) in zip(corners, corners[1:] + corners[:1]):
                    if m_a >= 0:
                        polygon.append(a)
                    if (m_a >= 0) != (m_b >= 0):
                        polygon.append(plus(a, plus(b, a, -1), m_a / (m_a - m_b)))
                for b, d in zip(polygon[1:], polygon[2:]):
                    count += 1
                    area += length(cross(plus(b, polygon[0], -1), plus(d, polygon[0], -1))) / 2
        return count, area


def wave(k, amplitude):
    """Numbers without a pattern."""
    return amplitude * math.sin(12.9898 * k + 78.233)


def case_of(name):
    """The input of a case."""
    sheet = Sheet(0.1, 0.7)
    places = sheet.points + [[sum(sheet.points[p][c] for p in cell) / 4 for c in range(2)] + [0.1]
                             for cell in sheet.cells]
    burns_away = name.startswith("A3")
    ball = {"centre": [0.15, 0.1, 0.05], "velocity": [4.0, 1.0, 0.0], "radius": 0.35, "T": 1100.0, "rate": 150.0}
    params = {"h": 0.002, "gravity": [0.5, 0.0, -3.0], "damping": 4.0, "alpha": 0.4, "eta": 250.0, "T_ignition": 480.0,
              "mu": 0.6 if burns_away else 0.05, "m_min": 0.25, "m_loss": 0.6 if burns_away else 0.0,
              "rho_ratio": 0.45, "layer_mu": [1.0, 0.7], "balls": [ball], "max_iter": 4, "threshold": 0.0,
              "order": "RGBY", "weights": {"B": 0.8, "Y": 0.5}, "pins": "exact", "fixed": [11],
              "mass_weighted": True, "reg": 0.01, "planes": [],
              "spheres": [] if burns_away else [{"centre": [0.3, 0.2, -0.101], "radius": 0.1}]}
    return sheet, {"thickness": 0.1, "areal_density": 0.7,
                   "x0": [plus(place, [wave(3 * i + c, 0.004) for c in range(3)]) for i, place in enumerate(places)],
                   "v0": [[wave(100 + 3 * i + c, 0.3) for c in range(3)] for i in range(sheet.particles)],
                   "T0": [400 + wave(200 + i, 90) for i in range(sheet.particles)], "steps": 4, "params": params}


def result_of(sheet, case):
    run = Run(sheet, case)
    e, pairs = run.umbrella()
    squares = [(value / 1000) ** 2 for value in run.temperature]
    laplacian = [0.0] * sheet.particles
    for a, b, inverse in pairs:
        laplacian[a] += 2 / e[a] * inverse * (squares[b] - squares[a])
        laplacian[b] += 2 / e[b] * inverse * (squares[a] - squares[b])
    result = {"n_particles": sheet.particles, "n_springs": {c: len(sheet.springs[c]) for c in COLOURS},
              "l0_sum": {c: sum(sheet.initial_length[c]) for c in COLOURS}, "m0": sheet.mass, "umbrella_E": e,
              "umbrella_L_of_T2": laplacian, "per_step": [{"err": run.step()} for _ in range(case["steps"])]}
    dead = {c: [s for s, lives in enumerate(run.lives[c]) if not lives] for c in COLOURS}
    result.update({"x": run.x, "v": run.v, "T": run.temperature, "m": run.mass, "target_lengths": run.target,
                   "dead_springs": dead, "alive_count": {c: sum(run.lives[c]) for c in COLOURS}})
    result["cut_triangles"], result["cut_area"] = run.cut()
    return result


def differences(a, b, place=""):
    """Where two trees of numbers differ by more than rounding."""
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        return [fault for key in a for fault in differences(a[key], b[key], f"{place}.{key}")]
    if isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        return [fault for i, pair in enumerate(zip(a, b)) for fault in differences(*pair, f"{place}[{i}]")]
    numbers = isinstance(a, (int, float)) and isinstance(b, (int, float))
    same = abs(a - b) <= 1e-11 * max(1.0, abs(b)) if numbers else a == b
    return [] if same else [f"{place}: {a!r}, expected {b!r}"]


def main():
    faults = []
    for name in ("A1_strip", "A3_strip"):
        sheet, case = case_of(name)
        obj = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in sheet.points)
        obj += "".join("f " + " ".join(str(p + 1) for p in cell) + "\n" for cell in sheet.cells)
        for ending, tree in (("params", case), ("expected", result_of(sheet, case))):
            path = CASES / f"{name}.{ending}.json"
            if "--check" in sys.argv:
                faults += differences(json.loads(path.read_text(encoding="utf-8")), tree, path.name)
            else:
                CASES.mkdir(exist_ok=True)
                (CASES / f"{name}.obj").write_text(obj, encoding="utf-8")
                path.write_text(json.dumps(tree, indent=1) + "\n", encoding="utf-8")
    for fault in faults:
        print(fault)
    sys.exit(1 if faults else 0)


main()
