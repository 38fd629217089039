/// Reads the requirements of [tune]: goal, limits and front. Internal to study/.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

// The variables of [tune].
struct Tuned {
  std::vector<Key> keys;      // those that may be free or uncertain
  std::string_view expected;  // description for messages
  std::function<double(const std::string& name)> own;
  std::vector<Key> disturbed;  // states
  std::vector<std::string> actuators;
  std::vector<Requirement> measures;  // without limits
  bool tiltrotor = true;
  // What transfers start from and lead to.
  std::vector<std::string> inputs{}, outputs{}, states{};
};

/// All measures that a study can ask for, with these figures of merit.
std::vector<Requirement> measures_with(const std::vector<std::string>& figures);

void read_goals(const Section& section, const std::filesystem::path& file, const Tuned& tuned,
                TuneTable& tune);
Requirement read_limit(const Section& section, const Tuned& tuned, const TuneTable& tune);
TuneTable::Front read_front(const Section& section, const Tuned& tuned, const TuneTable& tune);

/// The key `count`.
std::size_t read_count(const Section& section, double most);

}  // namespace tiltrim::reading
