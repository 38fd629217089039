// Compiled as C++17: uBLAS of Boost 1.74 uses members that C++20 removed from std::allocator.
#include "simulate/rosenbrock.hpp"

#include <algorithm>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_controller.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_dense_output.hpp>
#include <utility>

namespace tiltrim {

namespace odeint = boost::numeric::odeint;
using StiffVector = boost::numeric::ublas::vector<double>;
using StiffMatrix = boost::numeric::ublas::matrix<double>;
using Controlled = odeint::rosenbrock4_controller<odeint::rosenbrock4<double>>;

struct Rosenbrock::Inside {
  const RosenbrockSystem& system;
  odeint::rosenbrock4_dense_output<Controlled> stepper;
  double from = 0.0, to = 0.0;
  mutable StiffVector z;

  Inside(const RosenbrockSystem& s, double tolerance)
      : system(s), stepper(Controlled(tolerance, tolerance)) {}
};

Rosenbrock::Rosenbrock(const RosenbrockSystem& system, const std::vector<double>& z, double t,
                       double step, double tolerance)
    : inside_(new Inside(system, tolerance)) {
  inside_->z.resize(z.size());
  std::copy(z.begin(), z.end(), inside_->z.begin());
  inside_->from = inside_->to = t;
  inside_->stepper.initialize(inside_->z, t, step);
}

Rosenbrock::~Rosenbrock() = default;

bool Rosenbrock::do_step() {
  const RosenbrockSystem& s = inside_->system;
  const auto f = [&](const StiffVector& z, StiffVector& rates, double t) {
    s.f(t, &z[0], &rates[0]);
  };
  // Between breaks the rates do not depend on time.
  const auto slopes = [&](const StiffVector& z, StiffMatrix& J, double t, StiffVector& along_t) {
    s.slopes(t, &z[0], &J.data()[0]);
    std::fill(along_t.begin(), along_t.end(), 0.0);
  };
  try {
    const std::pair<double, double> step = inside_->stepper.do_step(std::make_pair(f, slopes));
    inside_->from = step.first;
    inside_->to = step.second;
    return true;
  } catch (const odeint::odeint_error&) {
    return false;
  }
}

double Rosenbrock::from() const { return inside_->from; }
double Rosenbrock::to() const { return inside_->to; }
double Rosenbrock::next_step() const { return inside_->stepper.current_time_step(); }

void Rosenbrock::state(double t, std::vector<double>& z) const {
  inside_->stepper.calc_state(t, inside_->z);
  std::copy(inside_->z.begin(), inside_->z.end(), z.begin());
}

}  // namespace tiltrim
