#include "simulate/comparison.hpp"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

#include "dense/dense.hpp"
#include "model/lookup.hpp"

namespace tiltrim::comparing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// ẋ = A x, sampled: x(t + dt) = exp(A dt) x(t).
MatrixXd linear_motion(const MatrixXd& A, const VectorXd& offset, double dt, Index samples) {
  const MatrixXd step = dense::exponential(A * dt);
  MatrixXd x(A.rows(), samples);
  x.col(0) = offset;
  for (Index k = 1; k < samples; ++k) x.col(k) = step * x.col(k - 1);
  return x;
}

struct Motions {
  std::vector<double> t;
  MatrixXd linear, nonlinear;
  double apart = 0.0;
  bool whole = false;
  std::string message;
};

class Comparison {
 public:
  Comparison(const std::function<Nonlinear(const VectorXd&)>& moved, const MatrixXd& A,
             const VectorXd& sizes, const ResponseOptions& options)
      : moved_(moved), A_(A), sizes_(sizes), options_(options) {}

  Motions from(const VectorXd& offset) const {
    const Nonlinear flown = moved_(offset);
    const auto samples = Index(std::lround(options_.duration / options_.sample)) + 1;
    Motions m;
    m.whole = flown.whole;
    m.message = flown.message;
    m.linear = linear_motion(A_, offset, options_.sample, samples);
    m.nonlinear = MatrixXd::Zero(A_.rows(), samples);
    // Samples on the grid only: at events there are two more.
    Index k = 0;
    for (std::size_t i = 0; i < flown.t.size() && k < samples; ++i) {
      if (std::abs(flown.t[i] - double(k) * options_.sample) > 1e-9 * options_.sample) continue;
      m.t.push_back(flown.t[i]);
      m.nonlinear.col(k++) = flown.x.col(Index(i));
    }
    m.linear.conservativeResize(Eigen::NoChange, k);
    m.nonlinear.conservativeResize(Eigen::NoChange, k);
    const auto scaled = [&](const MatrixXd& x) {
      return x.size() == 0 ? 0.0 : (sizes_.cwiseInverse().asDiagonal() * x).cwiseAbs().maxCoeff();
    };
    m.apart = scaled(m.linear - m.nonlinear) / scaled(m.linear);
    return m;
  }

  // A nonlinear motion that ends early counts as infinitely different.
  bool together(const VectorXd& offset) const {
    const Motions m = from(offset);
    return m.whole && m.apart <= options_.tolerated;
  }

 private:
  const std::function<Nonlinear(const VectorXd&)>& moved_;
  const MatrixXd& A_;
  const VectorXd& sizes_;
  const ResponseOptions& options_;
};

// The multiple of the offset from which the two differ by more than the tolerance.
double reach(const Comparison& comparison, const VectorXd& offset, const ResponseOptions& options) {
  double near = 0.0, far = options.most;
  if (comparison.together(far * offset)) return far;
  for (double scale = 1.0; near == 0 && scale > 1e-6; scale /= 8)
    if (comparison.together(scale * offset))
      near = scale;
    else
      far = scale;
  constexpr double close = 1.001;
  for (int k = 0; k < 60 && near > 0 && far > close * near; ++k) {
    const double middle = std::sqrt(near * far);
    (comparison.together(middle * offset) ? near : far) = middle;
  }
  return near;
}

}  // namespace

void compare(const std::function<Nonlinear(const VectorXd& offset)>& moved, const MatrixXd& A,
             const ResponseOptions& options, Response& response) {
  if (!(options.sample > 0 && options.sample <= options.duration &&
        std::isfinite(options.duration)))
    throw std::invalid_argument(
        fmt::format("response: sample {} and duration {}; expected 0 < sample <= duration",
                    options.sample, options.duration));
  if (!(options.tolerated > 0 && options.most >= 1))
    throw std::invalid_argument(
        fmt::format("response: tolerated {} and most {}; expected tolerated > 0 and most >= 1",
                    options.tolerated, options.most));
  const VectorXd sizes = nominals(response.states);
  const Comparison comparison(moved, A, sizes, options);
  Motions motions = comparison.from(response.offset);
  response.status = motions.whole ? ResponseStatus::responded : ResponseStatus::cut_short;
  response.message = motions.message;
  response.t = std::move(motions.t);
  response.linear = std::move(motions.linear);
  response.nonlinear = std::move(motions.nonlinear);
  response.apart = motions.apart;
  response.reach = reach(comparison, response.offset, options);
}

}  // namespace tiltrim::comparing
