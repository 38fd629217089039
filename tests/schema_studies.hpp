/// Studies that have every key which no shipped study has, for the schema of studies.
#pragma once

#include <string>
#include <vector>

namespace tiltrim {

inline const std::string level =
    "[[condition]]\nname = 'level'\nV = 15\ngamma_deg = 0\neta_deg = 0\n";

// Keys that appear in no shipped study.
inline const std::vector<std::string> of_the_tiltrotor{
    R"(time_limit = 10
vehicle = "tiltrotor"
[aircraft]
gravity = 9.81
rotor_radius = 0.3
rotor_speed_rpm = 4000
rotor_x = 0
rotor_z = 0
blade_count = 3
blade_chord = 0.03
blade_lift_slope = 5.7
cyclic_blend_deg = 60
CL_de = 0.4
CL_q = 4.0
CM_de = -1.3
CM_q = -12
[limits]
theta0 = [0, 1]
a1s_deg = [-20, 20]
delta_e_deg = [-30, 30]
theta_deg = [-90, 90]
[[condition]]
name = "a"
formulation = "airframe"
V = [10, 12]
gamma_deg = "free"
alpha_deg = [0, 3]
theta_deg = "free"
q = 0.25
eta_deg = [0.0, 90.0]
theta0 = "free"
a1s_deg = [0, 1]
delta_e_deg = "free"
V_dot = 0.1
gamma_dot = 0.2
theta_dot = 0.3
q_dot = 0.4
objective = [{signal = "theta0", scale = 0.35, reference = 0.1}]
[[condition]]
name = "b"
formulation = "airframe"
V = "free"
gamma_deg = [-5, 5]
alpha_deg = "free"
theta_deg = [0, 5]
q = [0, 0.1]
eta_deg = "free"
theta0 = [0, 0.5]
a1s_deg = "free"
delta_e_deg = [-5, 5]
[[condition]]
name = "c"
formulation = "airframe"
V = 10
q = "free"
eta_deg = 0
theta0 = 0.2
a1s_deg = 0
delta_e_deg = 0
[envelope]
eta_deg = [0, 90]
[[report.map]]
crossings = "skip"
[[report.map.axis]]
key = "V"
values = [14, 16]
with = [{key = "gamma_deg", values = [0, 1]}, {key = "gains.K_Lp", from = 1, to = 2, spacing = "log"}]
[qualities]
class = "I"
category = "C"
hover_below = 5.0
hover = ["a"]
response = "attitude"
airspeed = 15.0
gravity = 9.81
n_per_alpha = 6.0
bandwidth_delay = [0.0, 0.2, 0.4]
bandwidth_level_1 = [1.0, 1.0, 2.0]
bandwidth_level_2 = [0.5, 0.5, 1.0]
pitch = "theta"
pitch_rate = "q"
alpha = "alpha"
downward_speed = "w"
speed = "airspeed"
height = "height"
normal_acceleration = "load"
stick = "delta_e"
[sweep]
crossings = "skip"
[[sweep.axis]]
key = "V"
from = 15
to = 20
count = 3
spacing = "log"
with = [{key = "gains.K_Lp", from = 1, to = 2, spacing = "log"}, {key = "gamma_deg", values = [0, 1, 2]}]
[[sweep.axis]]
key = "eta_deg"
from = 0
to = 10
count = 3
with = [{key = "gains.K_Li", from = 1, to = 2, spacing = "log"}]
)",
    level + R"([tune]
conditions = ["level"]
corridor = [0, 60]
schedule_eta_deg = [0, 45, 90]
goal = {measure = "disk_margin", of = "delta_e"}
corners = "all"
samples = 20
global = "crs2"
local = "mma"
second = "esch"
seed = 7
evaluations = 100
seconds = 60
robustness = 1000
[tune.disturbance]
V = 1.0
gamma_deg = 5.0
theta_deg = 0.0
q_deg = 0.0
[[tune.gain]]
key = "gains.K_Lp"
from = 0.02
to = 10
spacing = "log"
[[tune.uncertain]]
key = "aircraft.mass"
percent = 15
[[tune.uncertain]]
key = "aircraft.inertia_yy"
from = 0.02
to = 0.03
[[tune.limit]]
measure = "half_time"
of = "phugoid"
at_most = 10
[[tune.limit]]
measure = "damping"
at_least = 0.3
[tune.front]
measure = "half_time"
of = "phugoid"
from = 2
to = 8
count = 7
)",
    level + R"([prove]
margin = 0.1
boxes = 1000
damping = 0.05
undecided = 1e-3
[[prove.parameter]]
key = "h"
from = 0
to = 120
[[prove.parameter]]
key = "aircraft.mass"
percent = 15
)",
    level + R"([simulate]
duration = 60
start = "level"
height = 10
axes = "body"
hand_over = "bumpless"
anti_windup = 2
lag = 0.1
tolerance = 1e-8
sample = 0.5
[simulate.schedule]
over = "height"
at = [0, 20, 120]
V = [2, 2, 15]
gamma_deg = [90, 80, 0]
eta_deg = [90, 80, 0]
[simulate.states]
V = 3
gamma_deg = 80
theta_deg = 5
q = 0.1
energy_integral = 0
distribution_integral = 0
[simulate.rates]
theta0 = 1
a1s_deg = 60
delta_e_deg = 60
eta_deg = 5
[[simulate.disturbance]]
kind = "doublet"
on = "delta_e_deg"
at = 5
size = 3
duration = 1
[[simulate.gust]]
kind = "one_minus_cosine"
direction = "up"
size = 1
at = 2
duration = 3
[[simulate.gust]]
kind = "dryden"
size = 0.5
length = 50
speed = 15
seed = 3
[montecarlo]
flights = 100
seed = 2
worst = 5
V_within = 0.3
gamma_within_deg = 1
theta_within_deg = 60
[[montecarlo.scatter]]
key = "aircraft.mass"
percent = 15
[[montecarlo.scatter]]
key = "height"
from = 5
to = 20
[qualities]
phase = "hover"
)"};
// A model with one gain to tune; what follows is of [tune].
inline const std::string one_loop = R"([model]
[[model.state]]
name = "x"
rate = "u - a*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "a"
value = 1
[[model.output]]
name = "y"
value = "2*x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
[tune]
regulator_starts = [1]
placed_starts = [1]
disturbance = {x = 1}
gain = [{key = "a", from = 1, to = 2}]
)";

inline const std::vector<std::string> with_a_model{
    R"(time_limit = 10
[model]
name = "integrator"
[model.values]
a = 2
[[model.state]]
name = "x"
unit = "m"
nominal = 0.1
rate = "u - a*x"
[[model.state]]
name = "v"
rate = "x - v"
[[model.input]]
name = "u"
unit = "N"
nominal = 1
[[model.parameter]]
name = "a"
unit = "1/s"
nominal = 0.1
value = 1
[[model.table]]
name = "CL"
at = [0, 1]
values = [0, 1]
interpolation = "linear"
[[model.table]]
name = "CM"
at = [[0, 1], [0, 1]]
values = [[0, 1], [2, 3]]
[[model.table]]
name = "CN"
at = [[0, 1], [0, 1], [0, 1]]
values = [[[0, 1], [2, 3]], [[0, 1], [2, 3]]]
[[model.let]]
name = "twice"
value = "2*x"
[[model.output]]
name = "y"
unit = "m"
nominal = 1
value = "twice"
[[model.switch]]
name = "middle"
at = "x"
[[model.loop]]
name = "loop"
input = "u"
output = "y"
[[condition]]
name = "held"
u = [0, 2]
x = 1
rates = {x = 0, v = "implied"}
guess = {u = 1}
objective = [{signal = "u", scale = 1, reference = 0}]
[sweep]
crossings = "skip"
[[sweep.axis]]
key = "a"
values = [1, 2]
with = [{key = "x", values = [1, 2]}]
[[sweep.axis]]
key = "v"
from = 1
to = 2
count = 3
spacing = "log"
)",
    R"([model]
[[model.state]]
name = "x"
rate = "u - p*x"
[[model.input]]
name = "u"
[[model.parameter]]
name = "p"
value = 1
[[condition]]
name = "rest"
u = 1
[prove]
margin = 0.1
damping = 0.05
boxes = 1000
undecided = 1e-3
[[prove.parameter]]
key = "u"
from = 1
to = 2
[[prove.parameter]]
key = "p"
percent = 5
)",
    R"([model]
[[model.state]]
name = "angle"
rate = "push - angle"
[[model.input]]
name = "push"
[[condition]]
name = "rest"
push = 1
guess = {angle = 1}
rates = {angle = 0}
[simulate]
duration = 1
tolerance = 1e-8
offset = {angle = 0.1}
)"};

// [tune] over responses, of either kind of study.
inline const std::vector<std::string> over_responses{
    R"([[tune.goal]]
measure = "peak_gain"
input = "INPUT"
output = ["OUTPUT", "STATE"]
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 1
[[tune.goal]]
measure = "h2_norm"
input = ["INPUT"]
output = "OUTPUT"
at_most = 1
[[tune.goal]]
measure = "settling_time"
input = "INPUT"
output = "STATE"
band = 0.05
at_most = 1
[[tune.goal]]
measure = "quadratic_cost"
weights = {WEIGHTS}
at_most = 1
[[tune.goal]]
measure = "peak_sensitivity"
of = "LOOP"
at_most = 1
[[tune.goal]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[[tune.limit]]
measure = "peak_gain"
input = "INPUT"
output = ["OUTPUT", "STATE"]
weight = {numerator = [1, 2], denominator = [1, 3]}
at_most = 1
[[tune.limit]]
measure = "h2_norm"
input = ["INPUT"]
output = "OUTPUT"
at_most = 1
[[tune.limit]]
measure = "settling_time"
input = "INPUT"
output = "STATE"
band = 0.05
at_most = 1
[[tune.limit]]
measure = "quadratic_cost"
weights = {WEIGHTS}
at_most = 1
[[tune.limit]]
measure = "peak_sensitivity"
of = "LOOP"
at_most = 1
[[tune.limit]]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
at_least = 1
[tune.front]
measure = "peak_gain"
input = "INPUT"
output = ["OUTPUT", "STATE"]
weight = {numerator = [1, 2], denominator = [1, 3]}
from = 1
to = 2
count = 2
)",
    R"([tune.front]
measure = "settling_time"
input = ["INPUT"]
output = "STATE"
band = 0.05
from = 0.5
to = 1
count = 2
)",
    R"([tune.front]
measure = "quadratic_cost"
weights = {WEIGHTS}
from = 0.5
to = 1
count = 2
)",
    R"([tune.front]
measure = "peak_sensitivity"
of = "LOOP"
from = 0.5
to = 1
count = 2
)",
    R"([tune.front]
measure = "pole_region"
decay = 0.1
damping = 0.4
frequency = 20
from = 0.5
to = 1
count = 2
)",
    R"(goal = {measure = "peak_gain", input = "INPUT", output = "OUTPUT", weight = {numerator = [1], denominator = [1, 2]}}
)",
    R"(goal = {measure = "settling_time", input = "INPUT", output = "OUTPUT", band = 0.1}
)",
    R"(goal = {measure = "quadratic_cost", weights = {WEIGHTS}}
)",
    R"(goal = {measure = "pole_region", decay = 0.1, damping = 0.4, frequency = 20}
)",
    R"(goal = {measure = "peak_sensitivity", of = "LOOP"}
)"};

// One gain of the tiltrotor to tune, as one_loop.
inline const std::string one_gain = level + R"([tune]
regulator_starts = [1]
placed_starts = [1]
disturbance = {theta_deg = 1}
gain = [{key = "gains.K_Lp", from = 0.02, to = 10}]
)";
inline const std::string all_of_the_loop =
    "theta0 = 1, a1s = 1, delta_e = 1, airspeed = 1, flight_path = 1, alpha = 1, theta = 1, q = 1, "
    "energy_integral = 1, distribution_integral = 1";

}  // namespace tiltrim
