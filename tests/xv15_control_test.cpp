// The XV-15 under total-energy control, and the derivatives that decide its short period.
#include <algorithm>
#include <numbers>

#include "linearize/linearize.hpp"
#include "linearize/margins.hpp"
#include "linearize/modes.hpp"
#include "simulate/integrate.hpp"
#include "study/reference_vehicle.hpp"
#include "study/study.hpp"
#include "tests/check.hpp"
#include "trim/trim.hpp"
#include "vehicles/xv15/airframe.hpp"

using namespace tiltrim;
using namespace tiltrim::xv15;

namespace xv15_control_test {

namespace {

std::shared_ptr<const Data> published() {
  static const auto data = load(data_directory() / "xv15", Variant::report_1988);
  return data;
}

// Hover to the airplane at 160 kt: the nacelles turn between 60 and 140 kt.
double smooth(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}
double mast_at(double knots) { return 90 * degree * smooth((knots - 60) / 80); }

constexpr double flap = 20 * degree;

TrimResult level_flight(const Model& loop, double knots, const Eigen::VectorXd& p) {
  const double V = knots * kt, mast = mast_at(knots);
  OperatingPoint at{Eigen::VectorXd::Zero(6), Eigen::Vector4d(flap, mast, 0, 0), p};
  at.p[airspeed_kt] = knots;
  const OperatingPoint plant{Eigen::Vector4d::Zero(), Eigen::Vector4d(0, 0, flap, mast),
                             at.p.head(8)};
  const Start start = start_of(*published(), plant, V, 0);
  at.x << V * std::cos(start.theta), V * std::sin(start.theta), start.theta, 0, 0.1, 0.5;
  const TrimSpec spec{.free = names(loop.states)};
  return trim(loop, spec, at, {.method = TrimMethod::newton, .starts = 0});
}

// The rates of u, w and q with the in-plane force of both rotors held at its value in trim.
Eigen::MatrixXd without_in_plane(const Data& d, const OperatingPoint& at,
                                 const Eigen::MatrixXd& J) {
  const Geometry<double> g = geometry(d, at.u[3]);
  const Eigen::RowVectorXd H = 2 * J.row(4 + 12).leftCols(4);
  Eigen::MatrixXd A = J.topLeftCorner(4, 4);
  A.row(0) += H * (g.cos / at.p[mass]);
  A.row(1) += H * (g.sin / at.p[mass]);
  A.row(3) += H * ((g.hub.z * g.cos - g.hub.x * g.sin) / g.inertia);
  return A;
}

}  // namespace

TEST_CASE("the corridor is stable under the control law") {
  const Model loop = closed_loop(published());
  const Eigen::VectorXd p = closed_loop_parameters(*published());
  for (double knots = 0; knots <= 160; knots += 10) {
    CAPTURE(knots);
    const TrimResult at = level_flight(loop, knots, p);
    REQUIRE(at.status == TrimStatus::converged);
    // The integrals leave no error of speed or climb.
    CHECK(std::abs(at.outputs[find(loop.outputs, "speed_kt")] - knots) < 1e-6);
    for (const Mode& mode : modes(linearize(loop, at.point)).modes)
      CHECK(mode.eigenvalue.real() < -0.01);
  }
}

// The closed loop with a factor k on what the law commands, A + (k - 1) b c, is at the border of
// stability at the gain margins, and stable between.
TEST_CASE("a factor on a command destabilizes the loop at its gain margins" * thorough) {
  const Model loop = closed_loop(published());
  const Eigen::VectorXd p = closed_loop_parameters(*published());
  int limited = 0;
  for (const double knots : {0.0, 100.0, 160.0})
    for (const std::string control : {"collective", "stick"}) {
      CAPTURE(knots);
      CAPTURE(control);
      const LinearModel linear = linearize(loop, level_flight(loop, knots, p).point);
      const Eigen::VectorXd b = linear.B.col(find(loop.inputs, control + "_added"));
      const Eigen::RowVectorXd c = linear.C.row(find(loop.outputs, control + "_command"));
      const auto abscissa = [&](double k) {
        double largest = -1e9;
        for (const Mode& mode : modes(linear.A + (k - 1) * b * c).modes)
          largest = std::max(largest, mode.eigenvalue.real());
        return largest;
      };
      const Margins m = margins(opened(linear, control + "_added", control + "_command"));
      REQUIRE(m.stable());
      REQUIRE(m.complete);
      const bool above = std::isfinite(m.gain_up), below = m.gain_down > 0;
      limited += above + below;
      if (above) CHECK(std::abs(abscissa(m.gain_up)) < 1e-6);
      if (below) CHECK(std::abs(abscissa(m.gain_down)) < 1e-6);
      for (const double share : {0.01, 0.3, 0.6, 0.99})
        CHECK(abscissa(m.gain_down + share * (std::min(m.gain_up, 1e3) - m.gain_down)) < 0);
    }
  CHECK(limited >= 2);
}

TEST_CASE("a nonlinear conversion from hover to 160 kt and back" * thorough) {
  const Model loop = closed_loop(published());
  Eigen::VectorXd p = closed_loop_parameters(*published());
  constexpr double rise = 75, until = 5 + rise + 15 + rise + 20;  // s
  const auto command = [&](double t) {
    const double up = smooth((t - 5) / rise), down = smooth((t - 20 - rise) / rise);
    return 160 * (up - down);
  };
  const TrimResult start = level_flight(loop, 0, p);
  REQUIRE(start.status == TrimStatus::converged);
  Eigen::VectorXd x(6);
  Eigen::Vector4d u(flap, 0, 0, 0);
  Motion motion{.states = loop.states, .f = [&](double t, const double* at, int, double* rates) {
                  x = Eigen::Map<const Eigen::VectorXd>(at, 6);
                  p[airspeed_kt] = command(t);
                  u[1] = mast_at(command(t));
                  Eigen::Map<Eigen::VectorXd>(rates, 6) = loop.f(x, u, p);
                }};
  motion.breaks = {5, 5 + rise, 20 + rise, 20 + 2 * rise};
  const std::vector<double> x0(start.point.x.begin(), start.point.x.end());
  const Trajectory flown = integrate(motion, x0, 0, 0, until, {.tolerance = 1e-6, .sample = 1.0});
  REQUIRE(flown.status == MotionStatus::completed);
  double fastest = 0, steepest = 0;
  for (std::size_t k = 0; k < flown.samples(); ++k) {
    const double* at = flown.state(k);
    fastest = std::max(fastest, std::hypot(at[0], at[1]) / kt);
    steepest = std::max(steepest, std::abs(at[2]) / degree);
  }
  const double* end = flown.state(flown.samples() - 1);
  CHECK(fastest > 158);
  CHECK(steepest < 20);
  CHECK(std::hypot(end[0], end[1]) / kt < 3);
}

TEST_CASE("the rotors' in-plane force takes a sixth of the short period's stiffness and damping") {
  const Data& d = *published();
  const Model m = model(published());
  OperatingPoint at{Eigen::Vector4d::Zero(), Eigen::Vector4d(0, 0, 0, 90 * degree), parameters(d)};
  at.p[omega] = d.si.at("rotor_speed_airplane");
  at.p[airspeed_kt] = 160;
  const Start start = start_of(d, at, 160 * kt, 0);
  at.u[0] = start.collective;
  at.u[1] = start.stick;
  at.x << 160 * kt, 160 * kt * start.theta, start.theta, 0;
  TrimSpec spec{.free = {"u", "w", "theta", "q", "collective", "stick"}};
  spec.bounds = {{"forward_error", {0, 0}}, {"climb_error", {0, 0}}};
  const TrimResult level = trim(m, spec, at, {.method = TrimMethod::newton, .starts = 0});
  REQUIRE(level.status == TrimStatus::converged);
  const Eigen::MatrixXd J = m.derivatives(level.point, {0, 1, 2, 3});
  const auto short_period = [](const Eigen::MatrixXd& A) {
    // w and q: lambda² - (Z_w + M_q) lambda + Z_w M_q - Z_q M_w
    const double damping = -(A(1, 1) + A(3, 3)) / 2;
    return std::array{std::sqrt(A(1, 1) * A(3, 3) - A(1, 3) * A(3, 1)), damping};
  };
  const auto whole = short_period(J.topLeftCorner(4, 4));
  const auto rigid = short_period(without_in_plane(d, level.point, J));
  // 2.237 rad/s and 0.909 1/s; without it 2.452 and 1.084 (docs/xv15.md).
  CHECK(std::abs(whole[0] - 2.237) < 5e-4);
  CHECK(std::abs(whole[1] - 0.909) < 5e-4);
  CHECK(std::abs(rigid[0] - 2.452) < 5e-4);
  CHECK(std::abs(rigid[1] - 1.084) < 5e-4);
}

}  // namespace xv15_control_test
