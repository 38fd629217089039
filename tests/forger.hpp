/// Altered certificates: each states what is false, or lacks what it needs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/random_draws.hpp"

struct Forger {
  using Json = nlohmann::ordered_json;
  using Lines = std::vector<std::string>;

  explicit Forger(const std::string& certificate);

  std::size_t below(std::size_t n) { return std::size_t(random() % n); }
  double share() { return uniform(random, 0, 1); }
  bool coin() { return below(2) == 0; }

  bool has(const std::string& text) const;  ///< in any line
  /// A random line with this text.
  std::size_t line_with(const std::string& text);
  /// A random line with evidence of a tube.
  std::size_t leaf() { return line_with("\"roots\""); }
  /// Whether the tubes of two leaves have hardly a pitch angle in common.
  bool apart(std::size_t i, std::size_t j) const;

  template <class Edit>
  std::string edited(std::size_t line, const Edit& edit) const {
    Lines lines = original;
    Json object = Json::parse(lines[line]);
    edit(object);
    lines[line] = object.dump();
    return joined(lines);
  }
  std::string header(const auto& edit) const { return edited(0, edit); }
  std::string records(const auto& edit) {
    return edited(leaf(), [&](Json& object) {
      for (Json& record : object["sides"]) edit(object, record);
    });
  }
  std::string exclusion(const auto& edit) {
    return edited(line_with("\"exclude\""), [&](Json& object) {
      for (Json& side : object["sides"]) edit(side["exclude"]);
    });
  }

  static std::string joined(const Lines& lines);
  static double number(const Json& text);
  static std::string hex(double x);

  Random random = draws(41);
  Lines original;
};

using Forgery = std::pair<const char*, std::string (*)(Forger&)>;

/// Those that fit a certificate: of leaves without trim, of the handover and of undecided leaves,
/// where it has such leaves.
std::vector<Forgery> forgeries_for(const Forger& of);
