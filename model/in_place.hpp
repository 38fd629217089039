/// Rates and outputs in one call, written where the caller wants them. Internal to tiltrim.
#pragma once

#include <functional>
#include <memory>

#include "model/model.hpp"

namespace tiltrim {

/// [f; h] of a model in one evaluation without allocation; a null pointer is not written.
struct InPlace {
  Eigen::Index states, outputs;  ///< values written
  std::function<void(const double* x, const double* u, const double* p, double* rates,
                     double* outputs)>
      write;
};

/// f and h of a model from one InPlace. Code that replaces f or h of a model replaces this type
/// with them, so that in_place() never calls a function that the model no longer has.
template <bool outputs>
struct InPlaceFunction {
  std::shared_ptr<const InPlace> both;

  Eigen::VectorXd operator()(const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                             const Eigen::VectorXd& p) const {
    Eigen::VectorXd values(outputs ? both->outputs : both->states);
    both->write(x.data(), u.data(), p.data(), outputs ? nullptr : values.data(),
                outputs ? values.data() : nullptr);
    return values;
  }
};

/// The evaluation that f and h of the model share; null if they share none.
inline const InPlace* in_place(const Model& model) {
  const auto* const f = model.f.target<InPlaceFunction<false>>();
  const auto* const h = model.h.target<InPlaceFunction<true>>();
  const bool shared = f && h && f->both == h->both && f->both->states == std::ssize(model.states) &&
                      f->both->outputs == std::ssize(model.outputs);
  return shared ? f->both.get() : nullptr;
}

}  // namespace tiltrim
