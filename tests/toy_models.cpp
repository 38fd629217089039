#include "tests/toy_models.hpp"

#include <cmath>
#include <numeric>
#include <utility>

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using namespace tiltrim;

VectorXd vec(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), std::ssize(values));
}

std::vector<Index> all_variables(const Model& model) {
  std::vector<Index> all(model.states.size() + model.inputs.size() + model.parameters.size());
  std::iota(all.begin(), all.end(), Index(0));
  return all;
}

Model flow(const std::vector<std::string>& states, const std::vector<std::string>& parameters,
           Flow rates) {
  Model m;
  for (const std::string& name : states) m.states.push_back({name, "", 1.0});
  for (const std::string& name : parameters) m.parameters.push_back({name, "", 1.0});
  m.f = [rates = std::move(rates)](const VectorXd& x, const VectorXd&, const VectorXd& p) {
    return rates(x, p);
  };
  return m;
}

Model scalar(const std::function<double(double x, double p)>& rate) {
  return flow({"x"}, {"p"},
              [rate](const VectorXd& x, const VectorXd& p) { return vec({rate(x[0], p[0])}); });
}

Model with_jacobian(Model model, std::function<MatrixXd(const OperatingPoint&)> jacobian) {
  model.derivatives = [jacobian = std::move(jacobian)](const OperatingPoint& at,
                                                       const std::vector<Index>& variables) {
    return MatrixXd(jacobian(at)(Eigen::all, variables));
  };
  return model;
}
