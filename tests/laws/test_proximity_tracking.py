"""Truth: the law of Sun and Zheng (2018) written again in numpy, one number the paper's data imply, closed forms."""

import ctypes

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.embedded.printer import print_function
from casadi_gnc.laws import advance
from casadi_gnc.laws.proximity_tracking import ProximityTracking
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics.proximity_motion import ProximityMotion
from casadi_gnc.mechanics.rigid_body import RigidBody
from casadi_gnc.system import assets, compilers

MU, POINT, M0 = 3.986e14, np.array([0.0, 5.0, 0.0]), 0.8 * 58.2
J0 = 0.8 * np.array([[598.3, -22.5, -51.5], [-22.5, 424.4, -27.0], [-51.5, -27.0, 263.6]])
GAINS = {
    "position_slope": 0.02,
    "attitude_slope": 0.15,
    "force_damping": 20.0,
    "torque_damping": 200.0,
    "observer_gain": 0.3,
    "compensator_gain": 1.0,
    "compensator_decay": 0.2,
}
K1, SLOPE = np.repeat([20.0, 200.0], 3), np.repeat([0.02, 0.15], 3)
#: The paper's initial data: relative state, position of the chaser, its rate.
START = np.array(
    [50 / np.sqrt(2), 0, -50 / np.sqrt(2), 0.5, -0.6, 0.7, 0.5, -0.5, 0.5, 0.02, -0.02, 0.02, *[7.078e8] * 3, 0, 0, 0]
)
LOW = np.concatenate([START[:12], np.full(3, 7.078e6 / np.sqrt(3)), [0.01, -0.02, 0.03]])


def make(*printed: str, hold: float = 0.0, **changes) -> ProximityTracking:
    body = ProximityMotion(RigidBody(ca.DM(J0)), M0, POINT, MU)
    return ProximityTracking(body=body, hold=hold, printed=frozenset(printed), **{**GAINS, **changes})


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def by_hand(y: np.ndarray, z: np.ndarray, zeta: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return u_0, z' and zeta' (eqs 15 .. 22), gravity as the paper writes it."""
    re, se, ve, we, r, w = y.reshape(6, 3)
    n, across = se @ se, np.array([[0, -se[2], se[1]], [se[2], 0, -se[0]], [-se[1], se[0], 0]])
    turn = np.eye(3) + (8 * across @ across - 4 * (1 - n) * across) / (1 + n) ** 2
    kinematics = ((1 - n) * np.eye(3) + 2 * across + 2 * np.outer(se, se)) / 4
    a, arm = w - we, turn @ POINT
    mu, mu_t = MU / np.linalg.norm(r) ** 3, MU / np.linalg.norm(r - re - arm) ** 3
    g = np.cross(w, ve) + np.cross(a, np.cross(a, arm)) + mu * r + mu_t * arm - mu_t * (r - re)
    s = np.concatenate([ve, we]) + SLOPE * np.concatenate([re, se])
    force = -M0 * g + 0.02 * M0 * (ve - np.cross(w, re))
    torque = -np.cross(w, J0 @ w) - J0 @ np.cross(w, we) + 0.15 * J0 @ kinematics @ we
    known, momentum = np.concatenate([force, torque]), np.concatenate([M0 * s[:3], J0 @ s[3:]])
    estimate = z + 0.3 * momentum
    wanted = -np.concatenate([re, kinematics.T @ se]) - K1 * s + zeta - known - estimate
    return wanted, -0.3 * z - 0.3 * (known + u + 0.3 * momentum), -0.2 * zeta + (u - wanted)


def test_first_command_is_that_of_the_printed_data():
    """Computed independently from the paper's data with z(0) = zeta(0) = 0."""
    law = make("observer_start")
    m = law.start(0.0, ca.DM(START))
    assert not np.any(values(m)[:12])
    expected = [-76.746, 17.637, 42.033, -32.576, 35.333, -33.197]
    assert np.allclose(values(law.command(0.0, ca.DM(START), m)), expected, atol=5e-4)


def test_law_is_the_hand_written_one(rng):
    """Gravity by hand loses 1e-16 of 8 m/s^2 on 47 kg; everything else rounds at 1e-14."""
    law = make("observer_start")
    for _ in range(20):
        y = LOW * rng.uniform(-1.5, 1.5, 18)
        z, zeta, u = rng.normal(size=(3, 6))
        m = law.memory.pack(observer=ca.DM(z), missing=ca.DM(zeta), attitude=ca.DM(y[3:6]))
        wanted, observer, missing = by_hand(y, z, zeta, u)
        found = law.command(0.0, ca.DM(y), m)
        rate = law.memory.split(law.rate(0.0, ca.DM(y), m, found, ca.DM(u)))
        assert np.allclose(values(found), wanted, rtol=1e-12, atol=1e-11)
        assert np.allclose(values(rate.observer), observer, rtol=1e-12, atol=1e-11)
        assert np.allclose(values(rate.missing), missing, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("hold", [0.0, 0.01, 1.0])
@pytest.mark.parametrize("switch_above", [None, 1.05])
def test_first_estimate_is_zero(hold, switch_above):
    law = make(hold=hold, switch_above=switch_above)
    y = ca.DM(START)
    m = law.jump(0.0, y, law.start(0.0, y))
    shown = law.show(0.0, y, m)
    assert np.allclose(values(ca.vertcat(shown["force_estimate"], shown["torque_estimate"])), 0, atol=1e-14)
    started = np.linalg.norm(values(shown["tracked_attitude"]))
    assert started == pytest.approx(np.sqrt(1.1) if switch_above is None else 1 / np.sqrt(1.1), rel=1e-14)


def test_printed_start_claims_a_disturbance():
    """z(0) = 0 estimates Gamma M_0 s(0): on the first axis 0.3 * 46.56 * (0.5 + 0.02 * 35.36) N."""
    law = make("observer_start")
    shown = law.show(0.0, ca.DM(START), law.start(0.0, ca.DM(START)))
    assert values(shown["force_estimate"])[0] == pytest.approx(0.3 * 46.56 * 1.207107, rel=1e-6)
    s = np.array([0.02, -0.02, 0.02]) + 0.15 * np.array([0.5, -0.6, 0.7])
    assert np.allclose(values(shown["torque_estimate"]), 0.3 * J0 @ s, rtol=1e-12)


def turned(s: np.ndarray) -> np.ndarray:
    y = LOW.copy()
    y[3:6] = s
    return y


def test_estimate_does_not_jump_where_the_set_changes():
    """Beyond 1.05 the short way is taken; z moves by what Gamma M_0 Lambda_2 (sigma - shadow) would have made."""
    axis = np.array([0.6, -0.48, 0.64])
    law = make(switch_above=1.05, hold=0.01)
    y = ca.DM(turned(1.04 * axis))
    m = law.memory.pack(observer=ca.DM([1.0, -2, 3, 4, -5, 6]), missing=ca.DM.ones(6), attitude=ca.DM(1.03 * axis))
    kept = law.jump(0.0, y, m)
    assert np.allclose(values(law.memory.split(kept).attitude), 1.04 * axis, atol=1e-15)
    y = ca.DM(turned(1.06 * axis))
    before, after = law.show(0.0, y, kept), law.show(0.0, y, law.jump(0.0, y, kept))
    assert np.allclose(values(after["tracked_attitude"]), -axis / 1.06, atol=1e-15)
    for name in ("force_estimate", "torque_estimate"):
        assert np.allclose(values(before[name]), values(after[name]), rtol=0, atol=1e-12), name
    assert law.memory.split(law.jump(0.0, y, kept)).observer[3:].shape == (3, 1)
    # Without the move of z the estimate would jump by some 20 N m on an axis.
    step = values(law.memory.split(law.jump(0.0, y, kept)).observer) - values(law.memory.split(kept).observer)
    expected = law.observer.through * J0 @ (0.15 * (1.06 + 1 / 1.06) * axis)
    assert np.allclose(step[3:], expected, rtol=1e-12)
    assert np.abs(step[3:]).max() > 15
    assert not np.any(step[:3])


@pytest.mark.parametrize("switch_above", [None, 1.05])
def test_which_set_is_measured_does_not_matter(switch_above, rng):
    """Sensors that flip to the shadow near half a turn give the same commands as those that do not."""
    law, axis = make(switch_above=switch_above, hold=0.01), np.array([0.6, -0.48, 0.64])
    m = [law.start(0.0, ca.DM(turned(0.97 * axis)))] * 2
    for size in np.linspace(0.97, 1.04, 15):
        s = size * axis + 1e-3 * rng.normal(size=3)
        commands = []
        for i, measured in enumerate((s, -s / (s @ s))):
            y = ca.DM(turned(measured))
            m[i] = law.jump(0.0, y, m[i])
            commands.append(values(law.command(0.0, y, m[i])))
        assert np.allclose(*commands, rtol=1e-12, atol=1e-11)
        assert np.linalg.norm(values(law.memory.split(m[1]).attitude) - s) < 1e-14


def test_long_way_is_kept_without_switching_until_it_is_a_full_turn():
    law = make()
    axis = np.array([0.6, -0.48, 0.64])
    m = law.start(0.0, ca.DM(turned(axis)))
    for angle in np.linspace(np.pi, 1.95 * np.pi, 20):
        s = ca.DM(np.tan(angle / 4) * axis)
        y = ca.DM(turned(values(attitude.short_way(s))))
        m = law.jump(0.0, y, m)
        assert np.allclose(values(law.memory.split(m).attitude), values(s), rtol=1e-12)
    y = ca.DM(turned(np.zeros(3)))
    assert np.all(np.isfinite(values(law.command(0.0, y, law.jump(0.0, y, m)))))


@pytest.mark.parametrize("hold", [0.01, 1.0])
def test_memory_advances_exactly(hold):
    """Held input: z' = -G (z + known), zeta' = -K_3 zeta + missing have exponentials as solutions."""
    law = make(hold=hold, switch_above=1.05)
    y, u = ca.DM(LOW), ca.DM([1.0, -2, 3, -1, 2, 0.5])
    m = law.jump(0.0, y, law.start(0.0, y))
    m = law.memory.pack(**{**vars(law.memory.split(m)), "missing": ca.DM([1.0, 2, -3, 0, 1, 1])})
    wanted = law.command(0.0, y, m)
    moved, rate = law.memory.split(advance(law, 0.0, y, m, wanted, u)), law.memory.split(law.rate(0.0, y, m, wanted, u))
    now = law.memory.split(m)
    for name, pole in (("observer", 0.3), ("missing", 0.2)):
        expected = values(getattr(now, name)) - np.expm1(-pole * hold) / pole * values(getattr(rate, name))
        assert np.allclose(values(getattr(moved, name)), expected, rtol=1e-13), name
    assert np.all(values(moved.attitude) == values(now.attitude))


def test_estimate_finds_a_constant_disturbance_with_its_pole():
    """A body without gravity, target at rest: M_0 e_2' = u + d, so the estimate is d (1 - e^(-Gamma t))."""
    body = ProximityMotion(RigidBody(ca.DM(J0)), M0, POINT, 0.0)
    law = ProximityTracking(body=body, hold=0.1, **GAINS)
    push, effort, h = np.array([0.3, -0.2, 0.5, 0.0, 0.0, 0.0]), np.zeros(6), 0.1
    y = np.concatenate([np.zeros(12), [7e6, 0, 0], np.zeros(3)])
    m = law.start(0.0, ca.DM(y))
    for k in range(100):
        shown = law.show(0.0, ca.DM(y), m)
        expected = push[:3] * -np.expm1(-0.3 * h * k)
        # s also grows by Lambda r_e, whose rate changes over the hold: an error of Lambda h/2 of the push.
        assert np.allclose(values(shown["force_estimate"]), expected, atol=1e-3 * np.abs(push).max()), k
        m = advance(law, 0.0, ca.DM(y), m, ca.DM(effort), ca.DM(effort))
        y[:3] += h * y[6:9] + h * h / 2 * push[:3] / M0
        y[6:9] += h * push[:3] / M0


def test_frame_rate_as_printed_moves_the_feed_forward():
    """(11) with S(omega_e) in C_1: h_s differs by M_0 Lambda_1 (omega - omega_e) x r_e."""
    y, change = ca.DM(LOW), values(make("frame_rate").known(make().inputs.split(ca.DM(LOW))))
    change -= values(make().known(make().inputs.split(y)))
    expected = 0.02 * M0 * np.cross(LOW[15:] - LOW[9:12], LOW[:3])
    assert np.allclose(change, [*expected, 0, 0, 0], atol=1e-10)


def test_a_constant_radius_of_the_orbit_changes_gravity():
    """mu_t = mu_g/r_o^3 for a target that is not there: the pull differs by that of the tide at the error's height."""
    radius = float(np.linalg.norm(LOW[12:15]))
    body = ProximityMotion(RigidBody(ca.DM(J0)), M0, POINT, MU, radius)
    now = make().inputs.split(ca.DM(LOW))
    change = values(body.gravity(now) - make().body.gravity(now))
    assert 1e-5 < np.linalg.norm(change) < 1e-4  # 3 mu |q| = 1.7e-4 for 50 m along the radius


def test_single_precision_keeps_the_command():
    """The step in C, float throughout, on relative inputs: 1e-4 N and N m of double over a whole approach."""
    law = make(hold=0.01, switch_above=1.05)
    y, m = law.inputs.symbol("y"), law.memory.symbol("m")
    jumped = law.jump(0.0, y, m)
    step = ca.Function("step", [y, m], [ca.cse(law.command(0.0, y, jumped))], ["y", "m"], ["u"])
    text = "#include <math.h>\ntypedef float gnc_real;\n" + print_function(step, maths="libm", real="float")
    text += "void call(const gnc_real *y, const gnc_real *m, gnc_real *u) { step(y, m, u); }\n"
    library = compilers.compiled(text, include=assets.folder("codegen") / "runtime", flags=("-O2", "-fno-builtin"))
    run, worst = ctypes.CDLL(str(library)).call, 0.0
    for seen, memory in approach(law):
        single = [np.array(column, dtype=np.float32) for column in (seen, memory, np.zeros(6))]
        run(*(ctypes.c_void_p(column.ctypes.data) for column in single))
        worst = max(worst, np.abs(single[2] - values(step(seen, memory))).max())
    assert 1e-7 < worst < 1e-4


def approach(law: ProximityTracking) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return measurements and memories of a rough 120 s approach of the believed craft itself."""
    y, m = law.inputs.symbol("y"), law.memory.symbol("m")
    now = law.inputs.split(y)
    jumped = law.jump(0.0, y, m)
    wanted = law.command(0.0, y, jumped)
    limits = ca.DM([20, 20, 20, 10, 10, 10])
    u = ca.if_else(wanted > limits, limits, ca.if_else(wanted < -limits, -limits, wanted))
    turn = law.body.body.acceleration(None, now.rate, u[3:])
    slopes = ca.vertcat(
        law.body.error_rate(now), law.body.acceleration(now, u), -ca.cross(now.rate, now.position), turn
    )
    moved = ca.vertcat(y + 0.1 * slopes, advance(law, 0.0, y, jumped, wanted, u))
    loop = ca.Function("loop", [ca.vertcat(y, m)], [moved]).mapaccum(1200)
    first = np.concatenate([LOW, values(law.start(0.0, ca.DM(LOW)))])
    passed = np.array(loop(first)).T
    return [(row[:18], row[18:]) for row in (first, *passed[::10])]
