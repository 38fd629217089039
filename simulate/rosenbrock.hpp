/// Interface to Boost.Odeint's implicit Rosenbrock method, which is not valid C++20.
/// Internal to simulate/.
#pragma once

#include <functional>
#include <memory>
#include <vector>

namespace tiltrim {

/// z' = f(z), z of constant size. f and its Jacobian, row by row, may throw: do_step() passes the
/// exception on.
struct RosenbrockSystem {
  std::function<void(double t, const double* z, double* rates)> f;
  std::function<void(double t, const double* z, double* slopes)> slopes;
};

/// Order 4 with an embedded method of order 3 and dense output.
class Rosenbrock {
 public:
  Rosenbrock(const RosenbrockSystem& system, const std::vector<double>& z, double t, double step,
             double tolerance);
  ~Rosenbrock();
  Rosenbrock(const Rosenbrock&) = delete;
  Rosenbrock& operator=(const Rosenbrock&) = delete;

  /// Takes one step; false if no step meets the tolerance.
  bool do_step();
  double from() const;       ///< of the last step
  double to() const;         ///< of the last step
  double next_step() const;  ///< size of the next attempt
  /// The state at a time within the last step.
  void state(double t, std::vector<double>& z) const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace tiltrim
