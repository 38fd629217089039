/// Rates and outputs at many points in one call. Internal to tiltrim.
#pragma once

#include <functional>
#include <memory>

#include "model/model.hpp"

namespace tiltrim {

/// [f; h] of a model at many points: column k of the values, (nx + ny) rows, belongs to column k of
/// x, u and p. May throw where f or h does.
struct Many {
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd& x, const Eigen::MatrixXd& u,
                                const Eigen::MatrixXd& p)>
      values;
};

/// The f of a model that has one. Code that replaces f, or h and the outputs, replaces this type
/// with it, so that many() never calls a function that the model no longer has.
struct FunctionOfMany {
  decltype(Model::f) one;  ///< f
  std::shared_ptr<const Many> many;

  Eigen::VectorXd operator()(const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                             const Eigen::VectorXd& p) const {
    return one(x, u, p);
  }
};

/// The evaluation of many points of a model; null if it has none.
inline const Many* many(const Model& model) {
  const auto* const f = model.f.target<FunctionOfMany>();
  return f ? f->many.get() : nullptr;
}

}  // namespace tiltrim
