/// @file
/// Exact derivatives of a user-defined model whose functions are written once for any scalar.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <concepts>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "model/dual.hpp"
#include "model/model.hpp"

namespace tiltrim {

/// f or h of a model, written once for any scalar S: a generic lambda, or an object with
///
///     template <class S>
///     void operator()(std::span<const S> x, std::span<const S> u, std::span<const S> p,
///                     std::span<S> values) const;
///
/// which writes one value per state or output. S is Plain for values and Dual for derivatives; call
/// functions (sin, sqrt, max, ...; see DualOf) without std::. The result must depend only on the
/// arguments; calls may come from several threads.
struct ExactFunction {
  /// Whether F can be called on spans of S.
  template <class F, class S>
  static constexpr bool takes = std::invocable<const F&, std::span<const S>, std::span<const S>,
                                               std::span<const S>, std::span<S>>;

  /// Writes as many values as fit.
  std::function<void(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p,
                     Eigen::Ref<Eigen::VectorXd> values)>
      values;
  /// Derivatives of the values with respect to the given variables, one column each.
  std::function<void(const OperatingPoint& at, const std::vector<Eigen::Index>& variables,
                     Eigen::Ref<Eigen::MatrixXd> columns)>
      slopes;

  ExactFunction() = default;  ///< no function: for a model without states, or without outputs
  /// From a function templated on its scalar.
  template <class F>
  requires(!std::same_as<F, ExactFunction> && takes<F, Plain> && takes<F, Dual>)
      ExactFunction(const F& f) {
    values = [f](const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p,
                 Eigen::Ref<Eigen::VectorXd> answer) {
      std::vector<Plain> all(std::size_t(answer.size()));
      Vector<Plain>(x, u, p).write(f, all);
      std::ranges::transform(all, answer.begin(), &Plain::value);
    };
    slopes = [f](const OperatingPoint& at, const std::vector<Eigen::Index>& variables,
                 Eigen::Ref<Eigen::MatrixXd> columns) {
      Vector<Dual> point(at.x, at.u, at.p);
      std::vector<Dual> all(std::size_t(columns.rows()));
      for (Eigen::Index first = 0; first < columns.cols(); first += Dual::directions) {
        const Eigen::Index count = std::min<Eigen::Index>(Dual::directions, columns.cols() - first);
        const auto moved = [&](Eigen::Index k) -> Dual& {
          return point.z.at(std::size_t(variables[std::size_t(first + k)]));
        };
        for (Eigen::Index k = 0; k < count; ++k) moved(k).slopes[k] = 1;
        point.write(f, all);
        for (Eigen::Index k = 0; k < count; ++k) {
          std::ranges::transform(all, columns.col(first + k).begin(),
                                 [k](const Dual& value) { return value.slopes[k]; });
          moved(k).slopes[k] = 0;
        }
      }
    };
  }

 private:
  // [x; u; p] on a scalar S.
  template <class S>
  struct Vector {
    std::vector<S> z;
    std::size_t nx, nu;

    Vector(const Eigen::VectorXd& x, const Eigen::VectorXd& u, const Eigen::VectorXd& p)
        : nx(std::size_t(x.size())), nu(std::size_t(u.size())) {
      z.reserve(nx + nu + std::size_t(p.size()));
      for (const Eigen::VectorXd* part : {&x, &u, &p})
        z.insert(z.end(), part->begin(), part->end());
    }

    // Values that f does not write are NaN.
    template <class F>
    void write(const F& f, std::vector<S>& answer) const {
      std::fill(answer.begin(), answer.end(), S(std::numeric_limits<double>::quiet_NaN()));
      const std::span<const S> all(z);
      f(all.first(nx), all.subspan(nx, nu), all.subspan(nx + nu), std::span<S>(answer));
    }
  };
};

/// Returns `m` with f, h and derivatives set from functions templated on their scalar. The values
/// equal those of the same functions written for double. Throws std::invalid_argument if there are
/// states but no f, or outputs but no h, or if a name occurs twice or a nominal size is not
/// positive and finite.
///
///     m.states = {{"angle", "rad", 0.1}, {"rate", "rad/s", 0.1}};
///     m = exact_model(m, [](auto x, auto u, auto p, auto rates) {
///       rates[0] = x[1];
///       rates[1] = u[0] - p[0] * sin(x[0]);
///     });
[[nodiscard]] Model exact_model(Model m, const ExactFunction& f, const ExactFunction& h = {});

}  // namespace tiltrim
