#!/usr/bin/env python3
"""Flights of the closed loop by SciPy, implemented independently of the C++ from the equations.

  flight_scipy.py          self-tests: data/reference_cases.json, energy, the bumpless handover
  flight_scipy.py --write  data/reference_flights.json
  flight_scipy.py --time   seconds and evaluations for the whole transition, as one line of JSON

SI units and radians. Numbers in parentheses are equations of docs/model.md.
"""

import argparse
import json
import platform
import re
import time
from bisect import bisect_right
from dataclasses import asdict, dataclass, replace
from math import atan2, copysign, cos, hypot, inf, pi, radians, sin, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, fsolve

DATA = Path(__file__).resolve().parent.parent / "data"
CASES = json.loads((DATA / "reference_cases.json").read_text())
CRAFT = CASES["aircraft"]
STATES = ["u", "w", "theta", "q", "x1", "x2", "distance", "height", "thrust_work", "drag_work"]
THETA, PITCH_RATE, X2, HEIGHT = (STATES.index(name) for name in ("theta", "q", "x2", "height"))

ACTUATORS = ["theta0", "a1s", "delta_e"]
END = {-1: "lower", 1: "upper"}
LIMITS = [(0.0, 1.0), (-0.35, 0.35), (-0.53, 0.53)]
ANTI_WINDUP = 1.0  # s
NUDGE, FIRST_INSTANT = 1e-14, 1e-9  # m/s, s: from rest
LOST = 3.0  # rad, of theta
KINKS = [20.0, 120.0]  # m, where the schedule is not smooth
REFERENCE = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.02}
COARSER = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-11, "max_step": 0.05}
TIMED = {"method": "RK45", "rtol": 1e-9, "atol": 1e-9, "max_step": inf}
VERSIONS = {
  "python": platform.python_version(),
  "numpy": np.__version__,
  "scipy": scipy.__version__,
}


# The schedule


def tilt(h):
  return pi * (h**3 / 1728000 - h**2 / 9600 + 1 / 2)  # (16)


def corridor(h):
  """Vd, gamma_d, eta over height."""
  eta = tilt(min(max(h, 0.0), 120.0))
  t = min(max((h - 20.0) / 100.0, 0.0), 1.0)
  Vd = 2 + 13 * (3 * t**2 - 2 * t**3)
  return Vd, eta, eta


CYCLIC_OFF = radians(CRAFT["cyclic_off_deg"])
HAND_OVER_HEIGHT = brentq(lambda h: tilt(h) - CYCLIC_OFF, 0.0, 120.0, xtol=1e-14)


# The wind: forward, up [m/s] and their rates [m/s²]


def calm(t):
  return 0.0, 0.0, 0.0, 0.0


@dataclass(frozen=True)
class Gust:
  """Upwards, one minus cosine."""

  peak: float  # m/s
  begin: float  # s
  length: float  # s

  def __call__(self, t):
    if not self.begin < t < self.begin + self.length:
      return calm(t)
    omega = 2 * pi / self.length
    phase = omega * (t - self.begin)
    return 0.0, self.peak / 2 * (1 - cos(phase)), 0.0, self.peak / 2 * omega * sin(phase)


# The aircraft


def load_polar(path):
  """CL, CD, CM of alpha: a periodic C2 cubic spline through the nodes."""
  rows = [line for line in path.read_text().splitlines() if not line.startswith("#")]
  table = np.array([[float(v) for v in line.split(",")] for line in rows[1:]])
  spline = CubicSpline(np.radians(table[:, 0]), table[:, 1:], bc_type="periodic")
  nodes = spline.x.tolist()
  pieces = np.transpose(spline.c, (1, 2, 0)).tolist()

  def polar(alpha):
    alpha = (alpha + pi) % (2 * pi) - pi
    i = min(max(bisect_right(nodes, alpha) - 1, 0), len(pieces) - 1)
    d = alpha - nodes[i]
    (a3, a2, a1, a0), (b3, b2, b1, b0), (c3, c2, c1, c0) = pieces[i]
    CL = ((a3 * d + a2) * d + a1) * d + a0
    CD = ((b3 * d + b2) * d + b1) * d + b0
    CM = ((c3 * d + c2) * d + c1) * d + c0
    return CL, CD, CM

  return polar


POLAR = load_polar(DATA / CASES["polar"])


class Mode(NamedTuple):
  """The discrete state of a flight; constant between two events."""

  elevator: bool = False  # the elevator has the pitch
  # Of theta0, a1s, delta_e: -1 at the lower limit, 0 between, 1 at the upper; none: by value
  at: tuple = None
  above: tuple = (False,) * len(KINKS)


def closed_loop(gains, command=corridor, wind=calm):
  """point(t, y, mode): the rates of the states, and the law's commands to the actuators."""
  m, Iyy, cbar, S = (CRAFT[k] for k in ("mass", "inertia_yy", "chord", "wing_area"))
  rho, g, Ep = (CRAFT[k] for k in ("air_density", "gravity", "thrust_excess"))
  R, xR, zH = (CRAFT[k] for k in ("rotor_radius", "rotor_x", "rotor_z"))
  CL_q, CL_de, CM_q, CM_de = (CRAFT[k] for k in ("CL_q", "CL_de", "CM_q", "CM_de"))
  pitch_scale, wake_immersion = CRAFT["pitch_scale"], CRAFT["wake_immersion"]
  Omega = CRAFT["rotor_speed_rpm"] * pi / 30
  sigma = CRAFT["blade_count"] * CRAFT["blade_chord"] / (pi * R)
  c1 = CRAFT["blade_lift_slope"] * sigma
  k_V, K_Ep, K_Ei, K_Lp, K_Li = (gains[k] for k in ("k_V", "K_Ep", "K_Ei", "K_Lp", "K_Li"))
  k_pa, k_da, k_pe, k_de = (gains[k] for k in ("k_pa", "k_da", "k_pe", "k_de"))

  def used(i, asked, mode):
    low, high = LIMITS[i]
    if mode.at is None:
      return min(max(asked, low), high)
    return (asked, high, low)[mode.at[i]]

  def point(t, y, mode):
    u, w, theta, q, x1, x2, _, h, _, _ = y
    Vd, gamma_d, eta = command(h)
    forward, up, forward_rate, up_rate = wind(t)
    s = 0.0 if mode.elevator else 1.0

    V = hypot(u, w)
    alpha = atan2(w, u) if V > 0 else theta - gamma_d
    gamma = theta - alpha
    V_err = Vd - V
    gamma_err = gamma_d - gamma
    CL, CD, CM = POLAR(alpha)

    # Collective and cyclic
    Dc = 0.5 * rho * V**2 * S * CD
    common = k_V * V_err / g + sin(gamma) + Dc / (m * g)
    theta0_asked = (K_Ep * (common + sin(gamma_err)) + K_Ei * x1) / (1 + Ep * K_Ep)  # (13)
    a_hat = (K_Lp * (common - sin(gamma_err)) + K_Li * x2) / (1 + K_Lp)  # (13)
    a1s_asked = s * (a_hat + k_pa * theta + k_da * q)  # (12)
    theta0 = used(0, theta0_asked, mode)
    a1s = used(1, a1s_asked, mode)

    # Speed: neither thrust nor drag depends on the elevator
    x = pitch_scale * theta0
    vi = copysign(Omega * R * c1 / 16 * (sqrt(1 + 32 * abs(x) / c1) - 1), x)  # (3)
    W = V + wake_immersion * vi
    Q = 0.5 * rho * W**2 * S
    T = Ep * m * g * theta0  # (4)
    D = Q * CD
    phi = alpha + eta - a1s
    V_rate = (T * cos(phi) - D) / m - g * sin(gamma)
    V_rate -= forward_rate * cos(gamma) + up_rate * sin(gamma)

    # Elevator
    He = (k_V * V_err - V_rate) / g + sin(gamma_err)  # (7)
    Le = (k_V * V_err - V_rate) / g - sin(gamma_err)  # (7)
    de_asked = (1 - s) * (K_Lp * Le + K_Li * x2 + k_pe * theta + k_de * q)  # (9)
    de = used(2, de_asked, mode)

    # Forces along the body's axes, x forward and z down: the consistent (1)
    qh = q * cbar / (2 * W)
    L = Q * (CL + CL_q * qh + CL_de * de * cos(alpha))
    Ma = Q * cbar * (CM + CM_q * qh + CM_de * de * cos(alpha))
    X = T * cos(eta - a1s) + L * sin(alpha) - D * cos(alpha)
    Z = -T * sin(eta - a1s) - L * cos(alpha) - D * sin(alpha)
    M = (xR * sin(eta - a1s) - zH * sin(a1s)) * T + Ma

    # Integrals with anti-windup
    theta0_by_x1 = K_Ei / (1 + Ep * K_Ep)
    a1s_by_x2 = K_Li / (1 + K_Lp)
    de_by_x2 = K_Li
    back1 = (theta0_asked - theta0) / (ANTI_WINDUP * theta0_by_x1)
    back2 = s * (a1s_asked - a1s) / (ANTI_WINDUP * a1s_by_x2)
    back2 += (1 - s) * (de_asked - de) / (ANTI_WINDUP * de_by_x2)

    rates = (
      X / m - g * sin(theta) - q * w - forward_rate * cos(theta) - up_rate * sin(theta),
      Z / m + g * cos(theta) + q * u - forward_rate * sin(theta) + up_rate * cos(theta),
      q,
      M / Iyy,
      He - back1,
      Le - back2,
      V * cos(gamma) + forward,
      V * sin(gamma) + up,
      T * cos(phi) * V / m,
      D * V / m,
    )
    return rates, (theta0_asked, a1s_asked, de_asked)

  return point


# The flight


@dataclass(frozen=True)
class Flight:
  name: str
  start: tuple
  until: float  # s
  gains: dict
  wind: Gust = None
  bumpless: bool = False
  to_hand_over: bool = False  # and no further


def mode_at(point, t, y, elevator):
  """The mode that the commands and the height imply."""
  asked = point(t, y, Mode(elevator))[1]
  at = tuple((a > high) - (a < low) for a, (low, high) in zip(asked, LIMITS))
  return Mode(elevator, at, tuple(y[HEIGHT] > h for h in KINKS))


def bumpless_x2(point, t, y, before):
  """x2 at which the law on the other side commands this pitch acceleration, or the nearest."""
  i = 1 if before.elevator else 2
  after = Mode(not before.elevator, (before.at[0], 0, 0))
  there_is = point(t, y, before)[0][PITCH_RATE]

  def other_side(x2):
    rates, asked = point(t, [*y[:X2], x2, *y[X2 + 1 :]], after)
    return rates[PITCH_RATE] - there_is, asked[i]

  # The command is affine in x2
  at_zero = other_side(0.0)[1]
  slope = other_side(1.0)[1] - at_zero
  ends = [(limit - at_zero) / slope for limit in LIMITS[i]]
  misses = [other_side(x2)[0] for x2 in ends]
  if misses[0] * misses[1] > 0:
    return min(zip(map(abs, misses), ends))[1]
  return brentq(lambda x2: other_side(x2)[0], *sorted(ends), xtol=1e-15)


def watch(mode, asked_at):
  """The exits of a mode: name, a function of t and y that vanishes there, the mode beyond."""
  exits = []

  def add(name, miss, direction, beyond):
    miss.terminal, miss.direction = True, direction
    exits.append((name, miss, beyond))

  for i, actuator in enumerate(ACTUATORS if mode.at else []):
    with_side = lambda side: mode._replace(at=mode.at[:i] + (side,) + mode.at[i + 1 :])
    for side, limit in zip((-1, 1), LIMITS[i]):
      miss = lambda t, y, i=i, limit=limit: asked_at(t, y)[i] - limit
      if mode.at[i] == 0:
        add(f"{actuator} reaches {END[side]} limit", miss, side, with_side(side))
      if mode.at[i] == side:
        add(f"{actuator} leaves {END[side]} limit", miss, -side, with_side(0))
  for i, kink in enumerate(KINKS):
    above = mode.above[:i] + (not mode.above[i],) + mode.above[i + 1 :]
    miss = lambda t, y, kink=kink: y[HEIGHT] - kink
    add(f"height {kink:g} m", miss, -1 if mode.above[i] else 1, mode._replace(above=above))
  above_off = lambda t, y: y[HEIGHT] - HAND_OVER_HEIGHT
  other_side = mode._replace(elevator=not mode.elevator)
  add("hand_over", above_off, -1 if mode.elevator else 1, other_side)
  add("lost", lambda t, y: abs(y[THETA]) - LOST, 1, mode)
  return exits


class Leg(NamedTuple):
  """To an event, or to the end of the grid if event is empty."""

  t: float
  y: list
  rows: list  # states on the grid
  event: str
  beyond: Mode
  evaluations: int


def fly_leg(point, mode, t, y, grid, settings):
  seen, there, evaluations = None, None, 0

  def at(t, y):
    nonlocal seen, there, evaluations
    if y is not seen:  # the last rates of a step and its events are of one point
      seen, there = y, point(t, y.tolist(), mode)
      evaluations += 1
    return there

  exits = watch(mode, lambda t, y: at(t, y)[1])
  misses = [miss for _, miss, _ in exits]
  rates = lambda t, y: at(t, y)[0]
  leg = solve_ivp(rates, (t, grid[-1]), np.array(y), t_eval=grid, events=misses, **settings)
  if leg.status < 0:
    raise RuntimeError(leg.message)
  rows = np.transpose(leg.y).tolist()
  for (event, _, beyond), t_event, y_event in zip(exits, leg.t_events, leg.y_events):
    if len(t_event):
      return Leg(float(t_event[0]), y_event[0].tolist(), rows, event, beyond, evaluations)
  return Leg(grid[-1], rows[-1], rows, "", mode, evaluations)


def step_over(flight, point, mode, leg):
  """State and mode after an event, and its other effects."""
  t, y = leg.t, leg.y
  if leg.event == "hand_over":
    begun = []
    if flight.bumpless:
      y = [*y[:X2], bumpless_x2(point, t, y, mode), *y[X2 + 1 :]]
      begun.append("x2 set anew")
    after = mode_at(point, t, y, leg.beyond.elevator)._replace(above=mode.above)
    for actuator, was, side in zip(ACTUATORS, mode.at, after.at):
      if side not in (0, was):
        begun.append(f"{actuator} reaches {END[side]} limit")
    return y, after, begun

  # The event decides the command just met; the values of the others must agree with their modes
  now = mode_at(point, t, y, mode.elevator).at
  if any(was == beyond != value for was, beyond, value in zip(mode.at, leg.beyond.at, now)):
    raise RuntimeError(f"{flight.name}: a limit passed unseen before t = {t}")
  return y, leg.beyond, []


@dataclass
class Flown:
  times: list
  states: list
  events: list  # (time, name, state)
  evaluations: int = 0


def fly(flight, settings, every=1.0, most_legs=1000):
  """A flight leg by leg, with its states at multiples of `every` and at its end."""
  point = closed_loop(flight.gains, wind=flight.wind or calm)
  stops = [flight.wind.begin, flight.wind.begin + flight.wind.length] if flight.wind else []
  t, y = 0.0, list(flight.start)
  mode = mode_at(point, t, y, corridor(y[HEIGHT])[2] < CYCLIC_OFF)
  if y[0] == y[1] == 0:
    # At rest gamma jumps, to where the acceleration is along it: there may be two such, one a fall.
    # From the commanded gamma the way is unique, and scales with V
    alpha = y[THETA] - corridor(y[HEIGHT])[1]
    y[:2] = NUDGE * cos(alpha), NUDGE * sin(alpha)
    mode = mode._replace(at=None)
    stops.append(FIRST_INSTANT)
  flown = Flown([t], [list(flight.start)], [])

  for _ in range(most_legs):
    stop = min(s for s in stops + [flight.until] if s > t)
    grid = [every * k for k in range(int(stop / every) + 1) if t < every * k < stop] + [stop]
    finer = {} if mode.at else {"atol": 1e-3 * NUDGE}
    leg = fly_leg(point, mode, t, y, grid, settings | finer)
    t, y = leg.t, leg.y
    asked_for = [(s, row) for s, row in zip(grid, leg.rows) if s % every == 0 or s == flight.until]
    flown.times += [s for s, _ in asked_for]
    flown.states += [row for _, row in asked_for]
    flown.evaluations += leg.evaluations

    if leg.event:
      flown.events.append((t, leg.event, y))
      if leg.event == "lost" or (leg.event == "hand_over" and flight.to_hand_over):
        return flown
      y, mode, begun = step_over(flight, point, mode, leg)
      flown.events += [(t, name, y) for name in begun]
    elif t == flight.until:
      return flown
    elif mode.at is None:
      mode = mode_at(point, t, y, mode.elevator)
  raise RuntimeError(f"{flight.name}: more than {most_legs} legs")


# The reference flights


def start_from(case, height=0.0, theta_more=0.0):
  """A reference trim's state, V and gamma kept where theta is moved."""
  V, gamma = case["condition"]["V"], radians(case["condition"]["gamma_deg"])
  theta = case["state"]["theta"] + theta_more
  u, w = V * cos(theta - gamma), V * sin(theta - gamma)
  x1, x2 = case["state"]["energy_integral"], case["state"]["distribution_integral"]
  return u, w, theta, 0.0, x1, x2, 0.0, height, 0.0, 0.0


def reference_flights():
  named = {case["condition"]["name"]: case for case in CASES["cases"]}
  tuned = dict(
    k_V=3.5160743665, K_Ep=1.8202132983, K_Ei=0.1859422903, K_Lp=1.1430306817, K_Li=0.0023846270,
    k_pa=1.1487776560, k_da=1.2420457664, k_pe=1.6297852429, k_de=7.3,
  )  # fmt: skip
  climb = Flight("climb", start_from(named["climb"]), 26.0, CASES["gains"], to_hand_over=True)
  level = Flight("level", start_from(named["level"], 130.0, 0.05), 20.0, CASES["gains"])
  whole = Flight("transition", (0.0,) * len(STATES), 90.0, tuned)
  return [
    climb,
    replace(climb, name="climb_to_loss", until=90.0, to_hand_over=False),
    level,
    replace(level, name="gust", wind=Gust(peak=1.5, begin=1.0, length=2.0)),
    whole,
    replace(whole, name="transition_bumpless", bumpless=True),
  ]


def spread(a, b):
  return float(np.max(np.abs(np.subtract(a, b))))


def record(flight):
  """A flight's numbers; their spread is the change with tolerances a hundred times looser."""
  flown = fly(flight, REFERENCE)
  looser = fly(flight, COARSER)
  if [name for _, name, _ in flown.events] != [name for _, name, _ in looser.events]:
    raise RuntimeError(f"{flight.name}: events depend on the tolerances")
  return {
    "name": flight.name,
    "gains": flight.gains,
    "hand_over": "bumpless" if flight.bumpless else "as_printed",
    "ends_at_hand_over": flight.to_hand_over,
    "gust": asdict(flight.wind) if flight.wind else None,
    "times": flown.times,
    "states": flown.states,
    "spreads": [spread(a, b) for a, b in zip(flown.states, looser.states)],
    "events": [
      {"time": t, "name": name, "time_spread": abs(t - t2), "state": y, "spread": spread(y, y2)}
      for (t, name, y), (t2, _, y2) in zip(flown.events, looser.events)
    ],
  }


def write():
  content = {
    "about": "flights by bench/flight_scipy.py; SI, rad; craft and polar of reference_cases.json;"
    " spread: largest change of a state under the looser settings;"
    " states of events: just before, with x2 set anew just after",
    "settings": REFERENCE,
    "looser": COARSER,
    "versions": VERSIONS,
    "limits": dict(zip(ACTUATORS, LIMITS)),
    "anti_windup": ANTI_WINDUP,
    "lost": LOST,
    "hand_over_height": HAND_OVER_HEIGHT,
    "states": STATES,
    "flights": [record(flight) for flight in reference_flights()],
  }
  one_line = lambda row: re.sub(r"(?<=\[) | (?=\])", "", re.sub(r"\s+", " ", row[0]))
  text = re.sub(r"\[[^\[\]{}]*\]", one_line, json.dumps(content, indent=1))
  (DATA / "reference_flights.json").write_text(text + "\n")


def measure():
  flight = reference_flights()[4]
  seconds = []
  for _ in range(3):
    begin = time.perf_counter()
    flown = fly(flight, TIMED, every=flight.until)
    seconds.append(time.perf_counter() - begin)
  settings = {k: TIMED[k] for k in ("method", "rtol", "atol")}
  result = {"flight": flight.name, "seconds": min(seconds), "evaluations": flown.evaluations}
  print(json.dumps(result | settings | VERSIONS))


# Self-tests


def check(name, miss, allowed):
  print(f"{'ok  ' if miss <= allowed else 'FAIL'}  {name}: {miss:.1e}, allowed {allowed:.1e}")
  return miss <= allowed


def check_trim(case):
  V = case["condition"]["V"]
  gamma, eta = (radians(case["condition"][k]) for k in ("gamma_deg", "eta_deg"))
  point = closed_loop(CASES["gains"], command=lambda h: (V, gamma, eta))
  mode = Mode(elevator=eta < CYCLIC_OFF, at=(0, 0, 0))
  rates = lambda x: np.array(point(0.0, [*x, 0.0, 0.0, 0.0, 0.0], mode)[0][:6])
  known = np.array(start_from(case)[:6])
  found = fsolve(rates, known * 1.001 + 1e-4, xtol=1e-13)
  inputs = point(0.0, [*found, 0.0, 0.0, 0.0, 0.0], mode)[1]

  # Central differences of fourth order: error h⁴ + ε/h
  h = 1e-3 * np.maximum(1e-1, np.abs(found))
  step = lambda k, j: rates(found + k * h * (np.arange(6) == j))
  slope = lambda j: (8 * (step(1, j) - step(-1, j)) - (step(2, j) - step(-2, j))) / (12 * h[j])
  A = np.column_stack([slope(j) for j in range(6)])
  modes = np.sort_complex(np.linalg.eigvals(A))
  known_modes = np.sort_complex([complex(*pair) for pair in case["eigenvalues"]])

  name = case["condition"]["name"]
  ok = check(f"{name}, trim", spread(found, known), 1e-9)
  ok &= check(f"{name}, inputs", spread(inputs, [case["input"][a] for a in ACTUATORS]), 1e-9)
  return ok & check(f"{name}, eigenvalues", float(np.max(np.abs(modes - known_modes))), 1e-6)


def check_energy(flight):
  """V²/2 + g h - thrust_work + drag_work is conserved in calm air."""
  states = fly(flight, REFERENCE).states
  energy = [(y[0] ** 2 + y[1] ** 2) / 2 + CRAFT["gravity"] * y[7] - y[8] + y[9] for y in states]
  return check(f"{flight.name}, energy", max(abs(e - energy[0]) for e in energy), 1e-9)


def check_bumpless(flight):
  """The pitch acceleration is continuous."""
  point = closed_loop(flight.gains)
  events = {name: (t, y) for t, name, y in fly(flight, REFERENCE).events}
  sides = [("hand_over", Mode(elevator=False)), ("x2 set anew", Mode(elevator=True))]
  before, after = (point(*events[name], mode)[0][PITCH_RATE] for name, mode in sides)
  return check(f"{flight.name}, pitch acceleration", abs(after - before), 1e-12)


def main():
  parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
  parser.add_argument("--write", action="store_true", help="write data/reference_flights.json")
  parser.add_argument("--time", action="store_true", help="time the whole transition")
  options = parser.parse_args()
  if options.write:
    return write()
  if options.time:
    return measure()
  results = [check_trim(case) for case in CASES["cases"]]
  results += [check_energy(flight) for flight in reference_flights() if not flight.wind]
  results += [check_bumpless(flight) for flight in reference_flights() if flight.bumpless]
  raise SystemExit(not all(results))


if __name__ == "__main__":
  main()
