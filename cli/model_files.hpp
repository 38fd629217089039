/// The linear-model files of `linearize --models`.
#pragma once

#include <filesystem>
#include <vector>

#include "report/conditions.hpp"

namespace tiltrim::cli {

/// Throws, before any computation, if a file's ending is unknown, if two files coincide, or if a
/// file cannot be written.
void check_model_files(const std::vector<std::filesystem::path>& files);
/// Writes each file completely or not at all.
void write_model_files(const std::vector<std::filesystem::path>& files,
                       const std::vector<ConditionReport>& conditions);

}  // namespace tiltrim::cli
