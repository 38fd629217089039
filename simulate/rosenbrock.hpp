/// Rosenbrock's implicit method, a library's, behind a plain interface: that library is not C++20.
/// Internal to simulate/.
#pragma once

#include <functional>
#include <memory>
#include <vector>

namespace tiltrim {

/// z' = f(z), z of one size throughout. f and its slopes, row by row, may throw: do_step() passes
/// that on.
struct RosenbrockSystem {
  std::function<void(double t, const double* z, double* rates)> f;
  std::function<void(double t, const double* z, double* slopes)> slopes;
};

/// Order 4 with an embedded 3 and dense output.
class Rosenbrock {
 public:
  Rosenbrock(const RosenbrockSystem& system, const std::vector<double>& z, double t, double step,
             double tolerance);
  ~Rosenbrock();
  Rosenbrock(const Rosenbrock&) = delete;
  Rosenbrock& operator=(const Rosenbrock&) = delete;

  /// One step; false where none is short enough for the tolerance.
  bool do_step();
  double from() const;       ///< of the last step
  double to() const;         ///< of the last step
  double next_step() const;  ///< that will be tried
  /// Within the last step.
  void state(double t, std::vector<double>& z) const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace tiltrim
