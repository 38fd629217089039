/// Columns of the signals of a user-defined model: all of them, angles in degrees. Internal to
/// report/.
#pragma once

#include "report/sheet.hpp"
#include "study/study.hpp"

namespace tiltrim {

/// The parameters shown with states, inputs and outputs: those that a trim solves for or is given.
std::vector<std::string> shown_parameters(const std::vector<Condition>& conditions);

std::vector<SheetColumn> user_columns(const Model& model,
                                      const std::vector<std::string>& parameters);
std::vector<SheetCell> user_cells(const Model& model, const std::vector<std::string>& parameters,
                                  const OperatingPoint& at, const Eigen::VectorXd& outputs);

}  // namespace tiltrim
