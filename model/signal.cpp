#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "model/lookup.hpp"
#include "model/model.hpp"

namespace tiltrim {

Eigen::Index find(const Signals& signals, std::string_view name) {
  const auto at = std::ranges::find(signals, name, &Signal::name);
  return at == signals.end() ? -1 : at - signals.begin();
}

Eigen::Index index_of(const Signals& signals, std::string_view name, std::string_view kind) {
  const Eigen::Index at = find(signals, name);
  if (at < 0)
    throw std::invalid_argument(
        fmt::format("no {} '{}'; the model has: {}", kind, name, fmt::join(names(signals), ", ")));
  return at;
}

// Levenshtein distance, one row at a time.
static std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = std::exchange(row[j + 1], std::min({substituted, row[j] + 1, row[j + 1] + 1}));
    }
  }
  return row.back();
}

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  constexpr std::size_t longest_name = 64;  // a longer name is not a typing error
  if (candidates.empty() || name.size() > longest_name) return {};
  const auto letters = [](std::string_view word) {  // "K_Lp" and "klp" are one name
    std::string kept;
    for (const char c : word)
      if (c != '_') kept += c >= 'A' && c <= 'Z' ? char(c + ('a' - 'A')) : c;
    return kept;
  };
  const auto same = std::ranges::find(candidates, letters(name), letters);
  if (same != candidates.end()) return *same;
  const auto last_part = [&](const std::string& c) { return letters(c.substr(c.rfind('.') + 1)); };
  const auto part = std::ranges::find(candidates, letters(name), last_part);  // of gains.K_Lp
  if (part != candidates.end()) return *part;
  const auto distance = [&](const std::string& c) { return edit_distance(name, c); };
  const std::string& best = *std::ranges::min_element(candidates, {}, distance);
  return distance(best) <= std::max(name.size(), best.size()) / 2 ? best : std::string{};
}

std::vector<std::string> names(const Signals& signals) {
  std::vector<std::string> list;
  for (const Signal& s : signals) list.push_back(s.name);
  return list;
}

Eigen::VectorXd nominals(const Signals& signals) {
  Eigen::VectorXd sizes(static_cast<Eigen::Index>(signals.size()));
  for (Eigen::Index i = 0; i < sizes.size(); ++i) sizes[i] = signals[std::size_t(i)].nominal;
  return sizes;
}

}  // namespace tiltrim
