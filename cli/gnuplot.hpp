/// gnuplot, run on a script in a folder.
#pragma once

#include <filesystem>
#include <string>

namespace tiltrim::cli {

/// Runs `script`, a file of the folder, there. Throws std::runtime_error if gnuplot is not
/// installed or fails, with what it said; `kept` is added to that.
void run_gnuplot(const std::filesystem::path& folder, const std::filesystem::path& script,
                 const std::string& kept);

}  // namespace tiltrim::cli
