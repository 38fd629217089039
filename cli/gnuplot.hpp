/// Runs gnuplot on a script in a folder.
#pragma once

#include <filesystem>
#include <string>

namespace tiltrim::cli {

/// Runs `script` in the folder that contains it. Throws std::runtime_error with gnuplot's output if
/// gnuplot is not installed or fails; `kept` is appended to the message.
void run_gnuplot(const std::filesystem::path& folder, const std::filesystem::path& script,
                 const std::string& kept);

}  // namespace tiltrim::cli
