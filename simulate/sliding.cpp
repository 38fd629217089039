#include "simulate/sliding.hpp"

#include <fmt/core.h>

#include <Eigen/Core>
#include <cmath>

#include "model/lookup.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// States over their nominal sizes, time in s.
constexpr double on = 1e-4;      // distance from the switch
constexpr double beside = 1e-5;  // from the switch, on either side
constexpr double change = 1e-6;  // of a difference

// One event function next to a point, and the rates on either side of its zero.
class Side {
 public:
  Side(const Motion& motion, double t, const std::vector<double>& x, int mode, std::size_t which)
      : motion_(motion),
        sizes_(nominals(motion.states)),
        t_(t),
        x_(Eigen::Map<const VectorXd>(x.data(), Index(x.size())).cwiseQuotient(sizes_)),
        mode_(mode),
        which_(which) {
    here_ = distance(t_, x_);
    slope_.resize(x_.size());
    for (Index i = 0; i < x_.size(); ++i)
      slope_[i] = (distance(t_, x_ + change * VectorXd::Unit(x_.size(), i)) - here_) / change;
    in_time_ = (distance(t_ + change, x_) - here_) / change;
  }

  // A jump stays as large next to the switch; a steep slope does not.
  bool attracts() const {
    constexpr double nearer = 0.25, as_large = 0.5;
    if (!(std::abs(here_) <= on * slope_.norm()) || !std::isfinite(in_time_)) return false;
    for (const double side : {1.0, -1.0}) {
      const double far = side * towards(side * beside),
                   near = side * towards(side * nearer * beside);
      if (!(far < 0 && near < as_large * far)) return false;
    }
    return true;
  }

 private:
  const Motion& motion_;
  VectorXd sizes_;
  double t_;
  VectorXd x_;
  int mode_;
  std::size_t which_;
  double here_ = 0.0, in_time_ = 0.0;
  VectorXd slope_;

  double distance(double t, const VectorXd& x) const {
    const VectorXd at = x.cwiseProduct(sizes_);
    VectorXd values(std::ssize(motion_.event_functions));
    motion_.g(t, at.data(), mode_, values.data());
    return values[Index(which_)];
  }

  // The rate of the event function at this distance from its zero; zero if it has another sign.
  double towards(double away) const {
    const double steepness = slope_.norm();
    const VectorXd x = x_ + (away - here_ / steepness) / steepness * slope_;
    if (!(distance(t_, x) * away > 0)) return 0.0;
    const VectorXd at = x.cwiseProduct(sizes_);
    VectorXd rates(x.size());
    motion_.f(t_, at.data(), mode_, rates.data());
    return slope_.dot(rates.cwiseQuotient(sizes_)) + in_time_;
  }
};

}  // namespace

std::string slides_along(const Motion& motion, double t, const std::vector<double>& x, int mode) {
  for (std::size_t k = 0; k < motion.event_functions.size(); ++k)
    if (Side(motion, t, x, mode, k).attracts())
      return fmt::format(
          "the motion slides along '{}', to which the rates lead back from both sides",
          motion.event_functions[k].name);
  return {};
}

std::string step_limit_in_words(const Motion& motion, double t, const std::vector<double>& x,
                                int mode, long max_steps) {
  const std::string along = slides_along(motion, t, x, mode);
  return fmt::format("the limit of {} steps is reached: {}", max_steps,
                     along.empty() ? "the motion is stiff, the tolerance is too small, or the "
                                     "motion slides along a jump of the rates"
                                   : along);
}

}  // namespace tiltrim
