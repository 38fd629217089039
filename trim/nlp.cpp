#include "trim/nlp.hpp"

#include <cmath>

#include "trim/optimality.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

static Nlp bounded(const Problem& p) { return {p.lower, p.upper, {}, {}, {}, {}, {}}; }

Nlp trim_nlp(const Problem& p) {
  Nlp nlp = bounded(p);
  const Index m = p.m(), l = std::ssize(p.limited), n = p.n();
  const double weight = p.square() ? 0.0 : 1.0;
  nlp.c_lower = nlp.c_upper = VectorXd::Zero(m + l);
  nlp.c_lower.tail(l) = p.limited_lower;
  nlp.c_upper.tail(l) = p.limited_upper;
  nlp.values = [&p, weight, m, l](const VectorXd& z, double& f, VectorXd& c) {
    const Values v = values(p, z);
    if (!v.finite) return false;
    f = weight * v.effort;
    c.resize(m + l);
    c << v.residual, v.limited;
    return true;
  };
  nlp.slopes = [&p, weight, m, l, n](const VectorXd& z, VectorXd& gradient, MatrixXd& J) {
    const Jacobians s = jacobians(p, z);
    if (!s.finite) return false;
    gradient = weight * s.effort;
    J.resize(m + l, n);
    J << s.residual, s.limited;
    return true;
  };
  return nlp;
}

Nlp closest_nlp(const Problem& p) {
  Nlp nlp = bounded(p);
  nlp.c_lower = p.limited_lower;
  nlp.c_upper = p.limited_upper;
  nlp.values = [&p](const VectorXd& z, double& f, VectorXd& c) {
    const Values v = values(p, z);
    if (!v.finite) return false;
    f = 0.5 * v.residual.squaredNorm();
    c = v.limited;
    return true;
  };
  nlp.slopes = [&p](const VectorXd& z, VectorXd& gradient, MatrixXd& J) {
    const Values v = values(p, z);
    const Jacobians s = jacobians(p, z);
    if (!v.finite || !s.finite) return false;
    gradient = s.residual.transpose() * v.residual;
    J = s.limited;
    return true;
  };
  return nlp;
}

VectorXd beyond_limits(const Problem& p, const Values& v) {
  return v.limited - v.limited.cwiseMax(p.limited_lower).cwiseMin(p.limited_upper);
}

Nlp least_excess_nlp(const Problem& p) {
  Nlp nlp = bounded(p);
  nlp.values = [&p](const VectorXd& z, double& f, VectorXd& c) {
    const Values v = values(p, z);
    if (!v.finite) return false;
    f = 0.5 * beyond_limits(p, v).squaredNorm();
    c.resize(0);
    return true;
  };
  nlp.slopes = [&p](const VectorXd& z, VectorXd& gradient, MatrixXd& J) {
    const Values v = values(p, z);
    const Jacobians s = jacobians(p, z);
    if (!v.finite || !s.finite) return false;
    gradient = s.limited.transpose() * beyond_limits(p, v);
    J.resize(0, p.n());
    return true;
  };
  return nlp;
}

VectorXd run_ipopt(const Problem& p, Nlp nlp, const VectorXd& start, const TrimOptions& options) {
  nlp.hessian = [&nlp](const VectorXd& z, double sigma, const VectorXd& lambda, MatrixXd& H) {
    const auto lagrangian = [&](const VectorXd& at) -> VectorXd {
      VectorXd gradient;
      MatrixXd J;
      if (!nlp.slopes(at, gradient, J)) return VectorXd::Constant(at.size(), NAN);
      return sigma * gradient + J.transpose() * lambda;
    };
    H = hessian_of(lagrangian, z);
    return H.allFinite();
  };
  const VectorXd inside = start.cwiseMax(p.lower).cwiseMin(p.upper);
  return ipopt(nlp, inside, options.max_iterations, options.stop);
}

}  // namespace tiltrim
