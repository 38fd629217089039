"""Models written in Python for tests and benchmarks: the tiltrotor from docs/model.md, a planar
VTOL, the longitudinal motion of an aircraft, a magnetically suspended ball."""

import cmath
import csv
import math
from bisect import bisect_right
from math import pi
from pathlib import Path

import numpy as np

import tiltrim

DATA = Path(__file__).resolve().parents[2] / "data"

# ---- The tiltrotor, equation by equation (numbers as in docs/model.md) ---------------------------


class Polar:
    """CL, CD, CM over the full circle: the periodic cubic spline through the table's rows."""

    def __init__(self, file=DATA / "naca8h12_re150k.csv"):
        from scipy.interpolate import CubicSpline

        lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
        rows = list(csv.DictReader(lines))
        alpha = np.radians([float(row["alpha_deg"]) for row in rows])
        values = np.array([[float(row[c]) for c in ("CL", "CD", "CM")] for row in rows])
        spline = CubicSpline(alpha, values, bc_type="periodic")
        self.knots = spline.x.tolist()
        self.pieces = spline.c.transpose(1, 2, 0).tolist()  # [piece][coefficient][power]

    def __call__(self, alpha):
        alpha -= 2 * pi * math.floor((alpha.real + pi) / (2 * pi))
        piece = min(max(bisect_right(self.knots, alpha.real) - 1, 0), len(self.pieces) - 1)
        t = alpha - self.knots[piece]
        return [((a * t + b) * t + c) * t + d for a, b, c, d in self.pieces[piece]]


class Tiltrotor:
    """x' = f(x, u, p) of the closed loop in wind axes; p is ordered as in the built-in model."""

    def __init__(self):
        self.polar = Polar()

    def terms(self, x, p, of=math):
        """Rates and outputs; `of` supplies the functions, cmath for complex steps."""
        sin, cos, sqrt = of.sin, of.cos, of.sqrt
        V_err, gamma_err, theta, q, x1, x2 = x.tolist()
        (
            Vd, gamma_d, eta,
            m, Iyy, c, S, rho, g, xR, zH, Ep, rpm, R, b, cb, ab, pitch_scale, wake, CL_q, CL_de,
            CM_q, CM_de, off, blend,
            k_V, K_Ep, K_Ei, K_Lp, K_Li, k_pa, k_da, k_pe, k_de,
        ) = p.tolist()  # fmt: skip
        V, gamma = Vd - V_err, gamma_d - gamma_err
        alpha = theta - gamma
        CL, CD, CM = self.polar(alpha)
        s = authority(eta, off, blend)
        Dc = 0.5 * rho * V**2 * S * CD
        common = k_V * V_err / g + sin(gamma) + Dc / (m * g)
        theta0 = (K_Ep * (common + sin(gamma_err)) + K_Ei * x1) / (1 + Ep * K_Ep)  # (13)
        a_hat = (K_Lp * (common - sin(gamma_err)) + K_Li * x2) / (1 + K_Lp)  # (13)
        a1s = s * (a_hat + k_pa * theta + k_da * q)  # (12)
        c1 = ab * b * cb / (pi * R)
        x_ = pitch_scale * theta0
        Omega = 2 * pi * rpm / 60
        vi = 2 * Omega * R * x_ / (sqrt(1 + 32 * (x_ if x_.real >= 0 else -x_) / c1) + 1)  # (3)
        W = V + wake * vi
        Q = 0.5 * rho * W**2 * S
        qh = q * c / (2 * W)
        T = Ep * m * g * theta0  # (4)
        phi = alpha + eta - a1s
        V_rate = (T * cos(phi) - Q * CD) / m - g * sin(gamma)
        He = (k_V * V_err - V_rate) / g + sin(gamma_err)  # (7)
        Le = (k_V * V_err - V_rate) / g - sin(gamma_err)  # (7)
        delta_e = (1 - s) * (K_Lp * Le + K_Li * x2 + k_pe * theta + k_de * q)  # (9)
        L = Q * (CL + CL_q * qh + CL_de * delta_e * cos(alpha))
        Ma = Q * c * (CM + CM_q * qh + CM_de * delta_e * cos(alpha))
        gamma_rate = (T * sin(phi) + L - m * g * cos(gamma)) / (m * V)  # (2)
        q_rate = ((xR * sin(eta - a1s) - zH * sin(a1s)) * T + Ma) / Iyy
        rates = [-V_rate, -gamma_rate, q, q_rate, He, Le]  # (14)
        return rates, [theta0, a1s, delta_e, V, gamma, alpha]

    def rates(self, x, u, p):
        return self.terms(x, p)[0]

    def outputs(self, x, u, p):
        return self.terms(x, p)[1]

    def derivatives(self, x, u, p):
        """All derivatives to rounding: Im f(z + ih)/h, with negligible h."""
        h = 1e-100
        z = np.concatenate([x, p]).astype(complex)
        columns = []
        for j in range(z.size):
            ahead = z.copy()
            ahead[j] += 1j * h
            rates, outputs = self.terms(ahead[: x.size], ahead[x.size :], cmath)
            columns.append([complex(value).imag / h for value in rates + outputs])
        return np.array(columns).T


def authority(eta, off, blend):
    """1 at and above the handover, 0 below; a smoothstep over `blend`."""
    if blend.real == 0:
        return 1.0 if eta.real >= off.real else 0.0
    t = (eta - off) / blend + 0.5
    if not 0 < t.real < 1:
        return 0.0 if t.real <= 0 else 1.0
    return 3 * t**2 - 2 * t**3


def tiltrotor_like(built_in, exact=False):
    """The written tiltrotor with the built-in model's signals, and nothing else from it."""
    own = Tiltrotor()
    return tiltrim.Model(
        "tiltrotor, written",
        own.rates,
        states=built_in.states,
        outputs=built_in.outputs,
        parameters=built_in.parameters,
        h=own.outputs,
        derivatives=own.derivatives if exact else None,
    )


# ---- Others --------------------------------------------------------------------------------------


def magnet():
    """An iron ball suspended below a magnet: m z'' = m g - k (i/z)²."""
    return tiltrim.Model(
        "magnet",
        lambda x, u, p: [x[1], 9.81 - p[1] * u[0] ** 2 / x[0] ** 2 / p[0]],
        states=[("gap", "m", 0.001), ("rate", "m/s", 0.1)],
        inputs=[("current", "A", 0.1)],
        parameters=[("mass", "kg", 0.01), ("k", "N m²/A²", 1e-5)],
    )


def magnet_law():
    """i = bias + k_p (z - aim) + k_d z'."""
    return tiltrim.Model(
        "law",
        None,
        inputs=[("gap", "m", 0.001), ("rate", "m/s", 0.1)],
        outputs=[("current", "A", 0.1)],
        parameters=[("bias", "A", 0.1), ("aim", "m", 0.001), ("k_p", "A/m", 10), ("k_d", "A s/m")],
        h=lambda x, u, p: [p[0] + p[2] * (u[0] - p[1]) + p[3] * u[1]],
    )


BALL = {"mass": 0.1, "k": 9.81e-5}


def held_ball(k_p=200.0, k_d=2.0):
    """The magnet with its law, as a problem: in equilibrium at 10 mm with 1 A."""
    values = {**BALL, "gap": 0.01, "bias": 1.0, "aim": 0.01, "k_p": k_p, "k_d": k_d}
    return tiltrim.Problem(
        tiltrim.close_loop(magnet(), magnet_law()),
        values,
        name="10 mm",
        free=["gap", "rate"],
        steady=["gap", "rate"],
        bounds={"gap": (0.005, 0.02)},
    )


def vtol_rates(x, u, p):
    """m vx' = -T sin θ + Dx,  m vz' = T cos θ - m g + Dz,  I q' = M - k_M vx"""
    m, g, inertia, along, across, k_M = 4.0, 9.81, 0.5, 0.02, 0.6, 0.05
    vx, vz, theta, q = x.tolist()
    thrust, moment = u.tolist()
    s, c = math.sin(theta), math.cos(theta)
    a, n = c * vx + s * vz, c * vz - s * vx  # along the rotors' plane, along their axis
    Da, Dn = -along * a * abs(a), -across * n * abs(n)
    return [
        (-thrust * s + c * Da - s * Dn) / m,
        (thrust * c + s * Da + c * Dn) / m - g,
        q,
        (moment - k_M * vx) / inertia,
    ]


def vtol():
    """A planar VTOL in forward flight, with drag along both body axes."""
    return tiltrim.Model(
        "planar VTOL",
        vtol_rates,
        states=[("vx", "m/s", 1), ("vz", "m/s", 1), ("theta", "rad", 0.1), ("q", "rad/s", 0.1)],
        inputs=[("thrust", "N", 10), ("moment", "N m", 1)],
    )


def aircraft_rates(x, u, p):
    """A light aircraft including stall: attached-flow lift below and flat-plate lift beyond it.
    Its parameters are of no particular aircraft.
    """
    m, g, S, c, inertia, rho = 13.5, 9.81, 0.55, 0.19, 1.135, 1.2682
    CL0, CLa, CLq, CLd = 0.28, 3.45, 0.0, -0.36
    CDp, oswald, aspect = 0.0437, 0.9, 15.24
    Cm0, Cma, Cmq, Cmd = -0.02338, -0.38, -3.6, -0.5
    blend, stall, most_thrust = 50.0, 0.4712, 60.0
    V, gamma, theta, q = x.tolist()
    throttle, elevator = u.tolist()
    alpha = theta - gamma
    Q, qh = 0.5 * rho * V * V * S, c * q / (2 * V)
    down, up = math.exp(-blend * (alpha - stall)), math.exp(blend * (alpha + stall))
    beyond = (1 + down + up) / ((1 + down) * (1 + up))
    flat = 2 * math.copysign(1, alpha) * math.sin(alpha) ** 2 * math.cos(alpha)
    linear = CL0 + CLa * alpha
    L = Q * ((1 - beyond) * linear + beyond * flat + CLq * qh + CLd * elevator)
    D = Q * (CDp + linear**2 / (math.pi * oswald * aspect))
    T = most_thrust * throttle
    return [
        (T * math.cos(alpha) - D) / m - g * math.sin(gamma),
        (T * math.sin(alpha) + L) / (m * V) - g * math.cos(gamma) / V,
        q,
        Q * c * (Cm0 + Cma * alpha + Cmq * qh + Cmd * elevator) / inertia,
    ]


def glider_rates(x, u, p):
    """An aircraft with a drag polar, in numpy's functions alone: one point, or one in each column."""
    m, g, S, c, inertia, rho, power = 13.5, 9.81, 0.55, 0.19, 1.135, 1.2682, 60.0
    V, gamma, theta, q = x
    throttle, elevator = u
    alpha = theta - gamma
    Q = 0.5 * rho * V * V * S
    CL = 0.28 + 3.45 * alpha - 0.36 * elevator
    lift, drag = Q * CL, Q * (0.0437 + CL**2 / 43.0)
    thrust = power * throttle
    return [
        (thrust * np.cos(alpha) - drag) / m - g * np.sin(gamma),
        (thrust * np.sin(alpha) + lift) / (m * V) - g * np.cos(gamma) / V,
        q,
        Q * c * (-0.02338 - 0.38 * alpha - 0.5 * elevator - 1.8 * c * q / V + p[0] * alpha) / inertia,
    ]


def glider(vectorized, derivatives="complex"):
    """The same as a model, with its aerodynamic center's position as a parameter."""
    return tiltrim.Model(
        "numpy aircraft",
        glider_rates,
        states=[("V", "m/s", 1), ("gamma", "rad", 0.1), ("theta", "rad", 0.1), ("q", "rad/s", 0.1)],
        inputs=[("throttle", "", 0.1), ("elevator", "rad", 0.1)],
        parameters=[("shift", "", 0.1)],
        derivatives=derivatives,
        vectorized=vectorized,
    )


def aircraft():
    """Its longitudinal motion."""
    return tiltrim.Model(
        "light aircraft",
        aircraft_rates,
        states=[("V", "m/s", 1), ("gamma", "rad", 0.1), ("theta", "rad", 0.1), ("q", "rad/s", 0.1)],
        inputs=[("throttle", "", 0.1), ("elevator", "rad", 0.1)],
    )


def problems_with_an_equilibrium():
    """Three models at several conditions each: {model: [(problem, unknowns' ranges)]}. Each has an
    equilibrium within its bounds; the problem's guess is near it."""
    written = []
    for h in range(0, 121, 12):
        t = min(max((h - 20) / 100, 0.0), 1.0)
        V = 2 + 13 * (3 * t**2 - 2 * t**3)
        tilt = 90 * (1 - 3 * (h / 120) ** 2 + 2 * (h / 120) ** 3)
        condition = tiltrim.tiltrotor(V, tilt, tilt)
        if not tiltrim.trim(condition):
            continue
        written.append(
            tiltrim.Problem(tiltrotor_like(condition.model), condition.guess, spec=condition.spec)
        )
    flying = tiltrim.TrimSpec(
        free=["theta", "thrust", "moment"],
        steady=["vx", "vz", "q"],
        bounds={"theta": (-1.2, 1.2), "thrust": (0, 80), "moment": (-5, 5)},
    )
    level = tiltrim.TrimSpec(
        free=["theta", "throttle", "elevator"],
        steady=["V", "gamma", "q"],
        bounds={"theta": (-0.6, 0.6), "throttle": (0, 1), "elevator": (-0.5, 0.5)},
    )
    return {
        "tiltrotor": written,
        "planar VTOL": [
            tiltrim.Problem(vtol(), {"vx": vx, "thrust": 40.0}, spec=flying)
            for vx in (0, 4, 8, 12, 16, 20)
        ],
        "light aircraft": [
            tiltrim.Problem(aircraft(), {"V": V, "gamma": gamma, "theta": gamma}, spec=level)
            for V, gamma in ((15, -0.05), (15, 0.0), (18, 0.05), (25, -0.05), (25, 0.1), (35, 0.05))
        ],
    }
