/// Linear models for other programs: JSON, CSV, Python, MATLAB. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/conditions.hpp"

namespace tiltrim {

/// {"models": [...], "left_out": [{"name", "why"}]}; docs/linearize.md describes it.
std::string linear_models_json(const std::vector<ConditionReport>& conditions);
/// One row per entry of each matrix and of the operating point.
Sheet linear_models_sheet(const std::vector<ConditionReport>& conditions);
/// A Python module that needs only numpy: the numbers, to_scipy(name), to_control(name).
std::string linear_models_python(const std::vector<ConditionReport>& conditions);
/// A MAT-file (version 5): one struct per model.
std::string linear_models_mat(const std::vector<ConditionReport>& conditions);

/// Why a condition has no linear model; empty if it has one.
std::string why_left_out(const ConditionReport& condition);
/// One line per condition without a linear model; empty if there is none.
std::string left_out_text(const std::vector<ConditionReport>& conditions, const TextStyle& style);

/// Valid MATLAB variable names: a letter, then letters, digits and _, at most 63 characters, no
/// keyword, unique.
std::vector<std::string> matlab_names(const std::vector<std::string>& names);

}  // namespace tiltrim
