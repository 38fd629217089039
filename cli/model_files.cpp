#include "cli/model_files.hpp"

#include <fmt/core.h>

#include <map>
#include <stdexcept>

#include "cli/terminal.hpp"
#include "report/linear_models.hpp"

namespace tiltrim::cli {

using Conditions = std::vector<ConditionReport>;

static const std::map<std::string, std::string (*)(const Conditions&)> endings{
    {".mat", linear_models_mat},
    {".json", linear_models_json},
    {".csv", [](const Conditions& all) { return as_csv(linear_models_sheet(all)); }},
    {".py", linear_models_python}};

void check_model_files(const std::vector<std::filesystem::path>& files) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (!endings.contains(files[i].extension()))
      throw std::invalid_argument(
          fmt::format("--models: '{}' has an unknown ending; expected .mat, .json, .csv or .py",
                      files[i].string()));
    for (std::size_t j = 0; j < i; ++j)
      check_apart(files[i], "--models", files[j], "another --models");
    check_writable(files[i]);
  }
}

void write_model_files(const std::vector<std::filesystem::path>& files,
                       const std::vector<ConditionReport>& conditions) {
  for (const std::filesystem::path& file : files)
    write_whole(file, endings.at(file.extension())(conditions));
}

}  // namespace tiltrim::cli
