/// Two results of a trim, bit for bit.
#pragma once

#include <doctest/doctest.h>

#include <cstring>

#include "tests/toy_models.hpp"
#include "trim/trim.hpp"

namespace tiltrim {

inline bool same_bytes(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  return a.size() == b.size() &&
         (a.size() == 0 ||
          std::memcmp(a.data(), b.data(), std::size_t(a.size()) * sizeof(double)) == 0);
}

inline void check_same(const TrimResult& a, const TrimResult& b) {
  CHECK(a.status == b.status);
  CHECK(same_bytes(a.point.x, b.point.x));
  CHECK(same_bytes(a.point.u, b.point.u));
  CHECK(same_bytes(a.point.p, b.point.p));
  CHECK(same_bytes(a.rates, b.rates));
  CHECK(same_bytes(a.outputs, b.outputs));
  CHECK(same_bytes(vec({a.residual, a.step, a.rcond, a.effort}),
                   vec({b.residual, b.step, b.rcond, b.effort})));
  CHECK(a.limits_active.size() == b.limits_active.size());
  CHECK(a.others.size() == b.others.size());
  CHECK(a.starts == b.starts);
  CHECK(a.evaluations == b.evaluations);
  CHECK(a.message == b.message);
  CHECK(a.thrown == b.thrown);
}

}  // namespace tiltrim
