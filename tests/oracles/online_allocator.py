"""Compile and call the online allocator through ctypes; geometries, instance families, certificate.

Shared by the tests of `tests/allocation` and `tests/bench/allocation_speed.py`. It shares no code with the
library's own binding, so that each checks the other.
"""

import ctypes
import hashlib
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SOURCES = HERE.parents[1] / "codegen" / "runtime"
SOLVER_FILES = tuple(sorted(path.name for path in SOURCES.glob("gnc_allocate*.c")))
FAST_FLAGS = ("-O3", "-fno-math-errno", "-fno-trapping-math")  # same words as without, but gcc vectorises
WARM, COLD, INTERIOR_POINT = 0, 1, 2
OPTIMAL, AT_ROUNDING, NOT_CERTIFIED, BAD_COMMAND, BAD_PROBLEM = range(5)


def defines(N, R, P, V, single=False, prefix="gnc_alloc"):
    """Return the compiler's -D options for one size."""
    sizes = [f"-DGNC_ALLOC_{name}={value}" for name, value in zip("NRPV", (N, R, P, V), strict=False)]
    return sizes + [f"-DGNC_ALLOC_PREFIX={prefix}"] + (["-DGNC_ALLOC_REAL_FLOAT"] if single else [])


def build(N, R, P, V, single=False, compiler="gcc", flags=("-O2",), prefix="gnc_alloc"):
    """Compile the solver and the timing loop into a shared library; return its path (cached by content)."""
    files = [SOURCES / name for name in SOLVER_FILES] + [HERE / "allocator_timing.c"]
    headers = [SOURCES / "gnc_allocate.h", SOURCES / "gnc_allocate_internal.h"]
    options = [*flags, *defines(N, R, P, V, single, prefix)]
    text = b"".join(f.read_bytes() for f in files + headers) + repr((compiler, options)).encode()
    folder = Path(tempfile.gettempdir()) / f"gnc_allocate_{os.getuid()}"
    folder.mkdir(exist_ok=True)
    library = folder / f"{hashlib.sha256(text).hexdigest()[:20]}.so"
    if not library.exists():
        partial = library.with_suffix(f".{os.getpid()}")
        subprocess.run(
            [
                compiler,
                "-std=c99",
                "-ffp-contract=off",
                "-fPIC",
                "-shared",
                f"-I{SOURCES}",
                *options,
                *map(str, files),
                "-lm",
                "-o",
                str(partial),
            ],
            check=True,
        )
        partial.replace(library)
    return library


def structures(N, R, P, V, single=False):
    """Return the ctypes classes (Problem, Result) of one size."""
    real, P1, i32 = (ctypes.c_float if single else ctypes.c_double), max(P, 1), ctypes.c_int32

    class Problem(ctypes.Structure):
        _fields_ = [
            ("A0", real * N * R),
            ("E", real * N * P1),
            ("D", real * P1 * R * V),
            ("m1", real * N),
            ("m2", real * N),
            ("preferred", real * N),
            ("h", real),
            ("tolerance", real),
            ("keep_zero_weights", i32),
        ]

    class Result(ctypes.Structure):
        _fields_ = [
            ("force", real * N),
            ("objective", real),
            ("gap", real),
            ("relative_gap", real),
            ("lam", real * V),
            ("unallocated", real * R),
            ("worst_error", real),
            ("worst_vertex", i32),
            ("saturation", i32 * N),
            ("active_set_iterations", i32),
            ("interior_point_iterations", i32),
            ("path", i32),
            ("status", i32),
        ]

    return Problem, Result


class Allocator:
    """One compiled size of the online allocator with its data and a workspace."""

    def __init__(self, N, R, P, V, single=False, compiler="gcc", flags=("-O2",), prefix="gnc_alloc"):
        self.N, self.R, self.P, self.V = N, R, P, V
        self.dtype = np.float32 if single else np.float64
        self.Problem, self.Result = structures(N, R, P, V, single)
        self.library = ctypes.CDLL(str(build(N, R, P, V, single, compiler, flags, prefix)))
        self.call = lambda name: getattr(self.library, f"{prefix}_{name}")
        size = self.call("size")
        size.restype = ctypes.c_size_t
        assert size(2) == ctypes.sizeof(self.Result)
        assert size(3) == ctypes.sizeof(self.Problem)
        self.data, self.work = ctypes.create_string_buffer(size(0)), ctypes.create_string_buffer(size(1))
        self.call("status_text").restype = ctypes.c_char_p

    def setup(self, A0, E, D, m1, m2, h, preferred=0, tolerance=0, keep_zero_weights=0):
        """Pass the problem to the set-up; return its status. Scalars stand for constant vectors."""
        p = self.Problem()

        def put(field, value, shape):
            np.ctypeslib.as_array(getattr(p, field))[...] = np.broadcast_to(np.asarray(value, float), shape)

        put("A0", A0, (self.R, self.N))
        if self.P:
            put("E", E, (self.P, self.N))
            put("D", D, (self.V, self.R, self.P))
        for field, value in (("m1", m1), ("m2", m2), ("preferred", preferred)):
            put(field, value, (self.N,))
        p.h, p.tolerance, p.keep_zero_weights = h, tolerance, keep_zero_weights
        return self.call("setup")(self.data, ctypes.byref(p))

    def _rows(self, value, width, count=None):
        shape = (width,) if count is None else (count, width)
        return None if value is None else np.ascontiguousarray(np.broadcast_to(np.asarray(value, self.dtype), shape))

    def reset(self):
        self.call("reset")(self.work)

    def solve(self, u, previous, lower, upper, max_step=None, interior_point=False):
        """Solve one command with the workspace of this object; return the ctypes result."""
        arrays = [self._rows(u, self.R)] + [self._rows(a, self.N) for a in (previous, lower, upper, max_step)]
        result = self.Result()
        name = "solve_interior_point" if interior_point else "solve"
        self.call(name)(
            self.work,
            self.data,
            *[None if a is None else a.ctypes.data_as(ctypes.c_void_p) for a in arrays],
            ctypes.byref(result),
        )
        return result

    def sequence(self, u, previous, lower, upper, max_step=None, mode=WARM, repeats=1):
        """Solve commands row by row in C; return (microseconds, structured array of results)."""
        n = len(u)
        arrays = [self._rows(u, self.R, n)] + [self._rows(a, self.N, n) for a in (previous, lower, upper, max_step)]
        time, results = np.zeros(n), (self.Result * n)()
        self.call("sequence")(
            self.data,
            n,
            *[None if a is None else a.ctypes.data_as(ctypes.c_void_p) for a in arrays],
            mode,
            repeats,
            time.ctypes.data_as(ctypes.c_void_p),
            results,
        )
        return time, np.frombuffer(results, dtype=np.dtype(self.Result)).copy()


# ---- geometry of Huang, Biggs, Duan 2020, doi:10.1016/j.ast.2019.105572, with the corrected rotation --------------


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def _rotation():
    """R_CS = Rx(60 deg) Ry(180/7 deg) Rz(45 deg), frame rotations."""
    (cx, sx), (cy, sy), (cz, sz) = [(np.cos(a), np.sin(a)) for a in (np.pi / 3, np.pi / 7, np.pi / 4)]
    return (
        np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
        @ np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
        @ np.array([[cz, sz, 0], [-sz, cz, 0], [0, 0, 1]])
    )


ROTATION = _rotation()
CENTRE_OF_MASS = np.full(3, 0.05)  # m
POSITIONS = np.repeat([[0.1, -0.1, 0.1], [0.1, 0.1, 0.1], [-0.1, -0.1, 0.1], [-0.1, 0.1, -0.1]], 3, axis=0)  # m
DIRECTIONS = np.array(
    [
        [0, 1, 0],
        [-1, 0, 0],
        [0, 0, 1],
        [-1, 0, 0],
        [0, -1, 0],
        [0, 0, -1],
        [0, 1, 0],
        [0, 0, -1],
        [1, 0, 0],
        [0, 0, 1],
        [0, -1, 0],
        [1, 0, 0],
    ],
    float,
)
E_2020 = (DIRECTIONS @ ROTATION.T).T
A0_2020 = np.cross((POSITIONS - CENTRE_OF_MASS) @ ROTATION.T, E_2020.T).T
MAX_FORCE = 3.75e-3  # N


def corners(box):
    """The 8 corners of a box: half-widths (3,) or (lower, upper) as (2, 3)."""
    box = np.asarray(box, float)
    box = np.stack([-box, box]) if box.ndim == 1 else box
    return np.array([[box[(v >> k) & 1, k] for k in range(3)] for v in range(8)])


def centre_of_mass_vertices(box):
    """D_v = -[R dr_v]x at the corners of the box of centre-of-mass errors, m."""
    return np.array([-skew(ROTATION @ dr) for dr in corners(box)])


def fly(kind, samples, box=5e-3, rate=None, noise=0.0, flags=("-O2",)):
    """Close the loop at 10 Hz with the robust allocator and record what it is asked.

    kind is "detumble" or "slew"; rate in N/s; noise in rad/s and MRP units.  Returns a dict of u, previous, lower,
    upper, one row per sample.
    """
    rng = np.random.default_rng(0)
    J0 = np.diag([0.49019, 1.2089, 1.2916])
    J, T, limit, beta = 1.1 * J0, 0.1, 1.5e-3, 0.5
    invJ, invJ0 = np.linalg.inv(J), np.linalg.inv(J0)
    orbit = 5e-3 * np.cross(ROTATION @ (np.array([0, 0, -0.1]) - CENTRE_OF_MASS), ROTATION @ np.array([0, 0, 1.0]))
    allocator = Allocator(12, 3, 3, 8, flags=flags)
    allocator.setup(A0_2020, E_2020, centre_of_mass_vertices([box] * 3), 1, 1, 1e6)
    w = np.array([0.45, 0.52, 0.55]) if kind == "detumble" else np.zeros(3)
    s = np.zeros(3) if kind == "detumble" else np.array([-0.206, -0.179, 0.075])
    F, through = np.zeros(12), (1 - np.exp(-beta * T)) / T
    z = -through * w
    log = {name: [] for name in ("u", "previous", "lower", "upper")}

    def rates(t, s, w):
        a, b = np.sin(np.pi * t / 125), np.sin(np.pi * t / 200)
        d = 1e-4 * np.array([1 + a + 1.5 * b, 2 + 1.5 * a - 2 * b, -1 + 2 * a - 1.5 * b])
        G = 0.25 * ((1 - s @ s) * np.eye(3) + 2 * skew(s) + 2 * np.outer(s, s))
        return G @ w, invJ @ (-np.cross(w, J @ w) + A0_2020 @ F + orbit + d)

    for k in range(samples):
        wm, sm = w + noise * rng.normal(size=3), s + noise * rng.normal(size=3)
        known = invJ0 @ (-np.cross(wm, J0 @ wm) + orbit)
        G = 0.25 * ((1 - sm @ sm) * np.eye(3) + 2 * skew(sm) + 2 * np.outer(sm, sm))
        wanted = -0.4 * wm if kind == "detumble" else -0.12 * G.T @ sm - 0.35 * wm
        u = np.clip(J0 @ (wanted - known - z - through * wm), -limit, limit)
        step = np.inf if rate is None else rate * T
        lower, upper = np.maximum(0, F - step), np.minimum(MAX_FORCE, F + step)
        for name, value in (("u", u), ("previous", F), ("lower", lower), ("upper", upper)):
            log[name].append(np.array(value))
        F = np.array(allocator.solve(u, F, lower, upper).force)
        z = z - T * beta * (z + through * wm + known + invJ0 @ A0_2020 @ F)
        k1 = rates(k * T, s, w)
        k2 = rates((k + 0.5) * T, s + T / 2 * k1[0], w + T / 2 * k1[1])
        k3 = rates((k + 0.5) * T, s + T / 2 * k2[0], w + T / 2 * k2[1])
        k4 = rates((k + 1) * T, s + T * k3[0], w + T * k3[1])
        s = s + T / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        w = w + T / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        s = -s / (s @ s) if s @ s > 1 else s
    return {name: np.array(rows) for name, rows in log.items()}


# ---- random instances, and a certificate that does not use the solver ---------------------------------------------

SHAPES = [(4, 3), (6, 3), (8, 3), (12, 3), (16, 6), (24, 3), (24, 6)]
FAMILIES = (
    "zero",
    "no_uncertainty",
    "flat_box",
    "asymmetric_box",
    "ties",
    "unreachable",
    "stuck",
    "rate",
    "m1_zero",
    "all_zero",
    "mixed_zero",
    "h",
    "extreme_weights",
    "two_sided",
    "preferred",
    "plain",
)


def instance(rng, family, N, R=3, count=6):
    """Draw one problem and some commands: (problem tuple), u, previous, lower, upper, max_step or None."""
    if N == 12 and R == 3 and rng.random() < 0.6:
        A0, E, top, size = A0_2020, E_2020.copy(), MAX_FORCE, 6e-4
    else:
        position, e = rng.uniform(-0.3, 0.3, (N, 3)), rng.normal(size=(N, 3))
        e /= np.linalg.norm(e, axis=1)[:, None]
        A0, E = np.cross(position, e).T, e.T.copy()
        top = 10 ** rng.uniform(-3, 1)
        size = 0.1 * top
        A0 = np.vstack([A0, 0.3 * E]) if R == 6 else A0
    box = np.full(3, rng.choice([1e-3, 5e-3, 2e-2, 5e-2]))
    h, m1, m2, preferred = 1e6, np.ones(N), np.ones(N), np.zeros(N)
    lower, upper, step = np.zeros(N), np.full(N, top), None
    u, previous = rng.normal(size=(count, R)) * size, rng.uniform(0, top, (count, N))
    if family == "zero":
        u[:] = 0
        previous[: count // 2] = 0
    elif family == "no_uncertainty":
        box = 0 * box
    elif family == "flat_box":
        box[rng.integers(3)] = 0
    elif family == "asymmetric_box":
        box = np.stack([-box * rng.uniform(0, 2, 3), box * rng.uniform(0, 2, 3)])
    elif family == "ties":
        u *= 0.2
        m2[:] = 0
    elif family == "unreachable":
        u *= 10
    elif family == "stuck":
        k = rng.permutation(N)[: max(1, N // 3)]
        upper[k[::2]] = 0
        lower[k[1::2]] = top
    elif family == "rate":
        step = np.full(N, top * 10 ** rng.uniform(-3, 0))
        if rng.random() < 0.5:
            previous = rng.uniform(-top, 2 * top, (count, N))
    elif family == "m1_zero":
        m1[:] = 0
    elif family == "all_zero":
        m1[:], m2[:] = 0, 0
    elif family == "mixed_zero":
        m1 *= rng.random(N) < 0.5
        m2 *= rng.random(N) < 0.5
    elif family == "h":
        h = 10 ** rng.uniform(2, 9)
    elif family == "extreme_weights":
        m1, m2 = 10 ** rng.uniform(-6, 6, N), 10 ** rng.uniform(-6, 6, N)
    elif family == "two_sided":
        lower = -upper
    elif family == "preferred":
        preferred = rng.uniform(0, top, N)
    D = centre_of_mass_vertices(box)
    D = np.concatenate([D, np.zeros((8, 3, 3))], axis=1) if R == 6 else D
    return (A0, E, D, m1, m2, h, preferred), u, previous, lower, upper, step


def effective_box(lower, upper, previous, step):
    if step is None:
        return lower, upper
    return (
        np.minimum(np.maximum(lower, previous - step), upper),
        np.maximum(np.minimum(upper, previous + step), lower),
    )


def certificate(problem, u, previous, lower, upper, force, lam, number=np.longdouble):
    """Duality gap, objective and rounding scale, in higher precision, from the data alone."""
    A0, E, D, m1, m2, h, preferred = [np.asarray(x, number) for x in problem]
    u, previous, lower, upper, F, lam = [np.asarray(x, number) for x in (u, previous, lower, upper, force, lam)]
    assert (lower <= F).all()
    assert (upper >= F).all()
    assert (lam >= 0).all()
    lam = lam / lam.sum()
    B = [A0 + D[v] @ E if E.size else A0 for v in range(len(D))]
    r = np.stack([b @ F - u for b in B])
    q = h * (r * r).sum(axis=1)
    g = (
        2 * m1 * (F - preferred)
        + 2 * m2 * (F - previous)
        + sum(2 * h * w * (b.T @ e) for w, b, e in zip(lam, B, r, strict=False))
    )
    curvature = m1 + m2
    with np.errstate(all="ignore"):
        d = np.where(
            curvature > 0, -g / (2 * np.where(curvature > 0, curvature, 1)), np.where(g > 0, lower - F, upper - F)
        )
    d = np.clip(d, lower - F, upper - F)
    gap = (lam * (q.max() - q)).sum() - (g * d + curvature * d * d).sum()
    objective = (m1 * (F - preferred) ** 2 + m2 * (F - previous) ** 2).sum() + q.max()
    width = upper - lower
    scale = (
        h * max(max(((u - b @ lower) ** 2).sum() for b in B), ((A0 * width) ** 2).sum())
        + (m1 * (abs(lower - preferred) + width) ** 2 + m2 * (abs(lower - previous) + width) ** 2).sum()
    )
    return gap, objective, scale


def gaps_of_floats(problem, u, previous, lower, upper, step, results):
    """Return the relative gap of each answer of a solver of floats, for the problem as floats state it."""

    def rounded(value):
        return None if value is None else np.asarray(np.asarray(value, np.float32), float)

    problem = [rounded(part) for part in problem]
    u, previous, lower, upper, step = (rounded(part) for part in (u, previous, lower, upper, step))
    if not (problem[3] + problem[4]).any():
        problem[3] = np.full(len(problem[3]), np.float32(1e-5) * problem[5] * (problem[0] ** 2).sum())
    found = []
    for k, r in enumerate(results):
        limits = [bound[k] if bound.ndim > 1 else bound for bound in (lower, upper)]
        box = effective_box(*limits, previous[k], step)
        force = np.clip(np.asarray(r["force"], float), *box)  # a bound of the rate box may be rounded
        gap, f, _ = certificate(problem, u[k], previous[k], *box, force, np.asarray(r["lam"], float))
        found.append(float(gap / f) if f > 0 else 0.0)
    return found
