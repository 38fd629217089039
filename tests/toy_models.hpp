/// Models of a line or two, with solutions in closed form.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "model/model.hpp"

Eigen::VectorXd vec(std::initializer_list<double> values);

/// Numbers of all states, inputs and parameters of a model.
std::vector<Eigen::Index> all_variables(const tiltrim::Model& model);

using Flow = std::function<Eigen::VectorXd(const Eigen::VectorXd& x, const Eigen::VectorXd& p)>;

/// x' = rates(x, p): signals without a unit, of nominal size 1.
tiltrim::Model flow(const std::vector<std::string>& states,
                    const std::vector<std::string>& parameters, Flow rates);

/// x' = rate(x, p), one state and one parameter.
tiltrim::Model scalar(const std::function<double(double x, double p)>& rate);

/// The model with this Jacobian of all its rates and outputs with respect to all its variables.
tiltrim::Model with_jacobian(
    tiltrim::Model model, std::function<Eigen::MatrixXd(const tiltrim::OperatingPoint&)> jacobian);
