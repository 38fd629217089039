/// The files of linear models that `linearize --models` writes.
#pragma once

#include <filesystem>
#include <vector>

#include "report/conditions.hpp"

namespace tiltrim::cli {

/// Throws, before any work, if a file's ending is none that is known, if two are one file, or one
/// the study or the output, or if a file could not be written.
void check_model_files(const std::vector<std::filesystem::path>& files,
                       const std::filesystem::path& study, const std::filesystem::path& output);
/// Each whole or not at all.
void write_model_files(const std::vector<std::filesystem::path>& files,
                       const std::vector<ConditionReport>& conditions);

}  // namespace tiltrim::cli
