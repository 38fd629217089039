// State feedback and norms of linear systems.
#include "design/design.hpp"

#include <utility>

#include "python/src/convert.hpp"
#include "python/src/verbs.hpp"

namespace tiltrim::python {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXcd;

py::dict regulator_of(const MatrixXd& A, const MatrixXd& B, const MatrixXd& Q, const MatrixXd& R) {
  const Regulator found = lqr(A, B, Q, R);
  py::dict d;
  d["status"] = to_string(found.status);
  d["K"] = found.K;
  d["S"] = found.S;
  d["poles"] = found.poles;
  d["residual"] = found.residual;
  d["modes"] = found.modes;
  return d;
}

py::dict placement_of(const MatrixXd& A, const MatrixXd& B, const VectorXcd& poles) {
  const Placement found = place(A, B, poles);
  py::dict d;
  d["status"] = to_string(found.status);
  d["K"] = found.K;
  d["poles"] = found.poles;
  d["residual"] = found.residual;
  d["uncontrollable"] = found.uncontrollable;
  return d;
}

py::dict covariance_of(const MatrixXd& A, const MatrixXd& Q) {
  const EquationSolution found = lyapunov(A, Q);
  py::dict d;
  d["status"] = to_string(found.status);
  d["X"] = found.X;
  d["residual"] = found.residual;
  return d;
}

py::dict peak_of(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C, const MatrixXd& D,
                 double tolerance, int max_levels) {
  const Peak found = hinf_norm(A, B, C, D, tolerance, max_levels);
  py::dict d;
  d["status"] = to_string(found.status);
  d["gain"] = found.gain;
  d["upper"] = found.upper;
  d["frequency"] = found.frequency;
  return d;
}

std::pair<double, double> variance_of(const MatrixXd& A, const MatrixXd& B, const MatrixXd& C,
                                      const MatrixXd& D) {
  const H2Norm found = h2_norm(A, B, C, D);
  return {found.norm, found.error};
}

}  // namespace

void add_design(py::module_& module) {
  using py::arg;
  module.def("lqr", &regulator_of, arg("A"), arg("B"), arg("Q"), arg("R"));
  module.def("place", &placement_of, arg("A"), arg("B"), arg("poles"));
  module.def("lyapunov", &covariance_of, arg("A"), arg("Q"));
  module.def("hinf_norm", &peak_of, arg("A"), arg("B"), arg("C"), arg("D"), arg("tolerance"),
             arg("max_levels"));
  module.def("h2_norm", &variance_of, arg("A"), arg("B"), arg("C"), arg("D"));
}

}  // namespace tiltrim::python
