#include "check_proof/certificate.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

namespace tiltrim::checking {

namespace {

using nlohmann::json;
constexpr std::size_t most_parameters = most_numbers - 3;  // an exclusion adds three

// One line's object. Its functions throw std::runtime_error.
json parse_line(const std::string& line) {
  std::vector<std::set<std::string>> keys;
  const auto callback = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      throw std::runtime_error(fmt::format("the key '{}' occurs twice", parsed.get<std::string>()));
    return true;
  };
  json object;
  try {
    object = json::parse(line, callback);
  } catch (const json::exception&) {
    throw std::runtime_error("not a line of JSON");
  }
  if (!object.is_object()) throw std::runtime_error("not a JSON object");
  return object;
}

void expect_keys(const json& object, std::initializer_list<std::string_view> required,
                 std::initializer_list<std::string_view> optional = {}) {
  if (!object.is_object()) throw std::runtime_error("expected a JSON object");
  for (const std::string_view key : required)
    if (!object.contains(key))
      throw std::runtime_error(fmt::format("the key '{}' is missing", key));
  for (const auto& item : object.items()) {
    const auto is = [&](std::string_view key) { return key == item.key(); };
    if (std::ranges::none_of(required, is) && std::ranges::none_of(optional, is))
      throw std::runtime_error(fmt::format("unknown key '{}'", item.key()));
  }
}

double number_of(const json& value) {
  if (!value.is_string()) throw std::runtime_error("expected a hexadecimal float as a string");
  const std::string& text = value.get_ref<const std::string&>();
  const bool minus = text.starts_with('-');
  const std::string_view digits = std::string_view(text).substr(minus ? 1 : 0);
  double x = 0;
  if (digits.starts_with("0x")) {
    const char* const end = digits.data() + digits.size();
    const auto [at, error] = std::from_chars(digits.data() + 2, end, x, std::chars_format::hex);
    if (error == std::errc{} && at == end && std::isfinite(x) && !std::signbit(x))
      return minus ? -x : x;
  }
  throw std::runtime_error(fmt::format("'{}' is not a finite hexadecimal float", text));
}

std::vector<double> numbers_of(const json& values) {
  if (!values.is_array()) throw std::runtime_error("expected an array of numbers");
  std::vector<double> all;
  for (const json& value : values) all.push_back(number_of(value));
  return all;
}

template <std::size_t n>
std::array<double, n> fixed(const json& values, std::string_view what) {
  const std::vector<double> all = numbers_of(values);
  if (all.size() != n)
    throw std::runtime_error(fmt::format("expected {} numbers in '{}'", n, what));
  std::array<double, n> r{};
  std::ranges::copy(all, r.begin());
  return r;
}

int integer_of(const json& value, int most, std::string_view what) {
  if (!value.is_number_integer() || value.get<long>() < 0 || value.get<long>() > most)
    throw std::runtime_error(fmt::format("'{}' must be an integer from 0 to {}", what, most));
  return value.get<int>();
}

std::string text_of(const json& value, std::string_view what) {
  if (!value.is_string()) throw std::runtime_error(fmt::format("'{}' must be a string", what));
  return value.get<std::string>();
}

void expect(const json& header, const char* key, const json& value) {
  if (header.at(key) != value)
    throw std::runtime_error(fmt::format("'{}' must be {}", key, value.dump()));
}

Bounds bounds_of(const json& limits, const char* key) {
  const auto [lower, upper] = fixed<2>(limits.at(key), key);
  if (!(lower <= upper))
    throw std::runtime_error(fmt::format("the limits of '{}' are not in order", key));
  return {lower, upper};
}

std::vector<Parameter> parameters_of(const json& list) {
  if (!list.is_array() || list.empty() || list.size() > most_parameters)
    throw std::runtime_error(fmt::format("expected 1 to {} parameters", most_parameters));
  std::vector<Parameter> all;
  for (const json& entry : list) {
    expect_keys(entry, {"key", "signal", "from", "to"});
    const std::string signal = text_of(entry.at("signal"), "signal");
    Parameter p{text_of(entry.at("key"), "key"),
                find_number(signal),
                {number_of(entry.at("from")), number_of(entry.at("to"))}};
    if (!p.member && signal != "h")
      throw std::runtime_error(fmt::format("unknown parameter '{}'", signal));
    // An angle is in degrees in the study, and its key says so.
    if (p.key != signal && p.key != signal + "_deg")
      throw std::runtime_error(fmt::format("the key '{}' is not that of '{}'", p.key, signal));
    if (!(p.domain.lower < p.domain.upper))
      throw std::runtime_error(fmt::format("'{}': from must be less than to", p.key));
    for (const Parameter& other : all)
      if (other.member == p.member)
        throw std::runtime_error(fmt::format("'{}' occurs twice", p.key));
    all.push_back(std::move(p));
  }
  const auto commanded = [](const Parameter& p) {
    return p.member == &Numbers::V || p.member == &Numbers::gamma || p.member == &Numbers::eta;
  };
  if (std::ranges::any_of(all, [](const Parameter& p) { return !p.member; }) &&
      std::ranges::any_of(all, commanded))
    throw std::runtime_error("h sets V, gamma and eta, which are parameters too");
  return all;
}

void read_schedule(const json& schedule, Statement& s) {
  expect_keys(schedule, {"eta", "gains"});
  s.tilts = numbers_of(schedule.at("eta"));
  if (s.tilts.size() < 2 || !schedule.at("gains").is_array() ||
      schedule.at("gains").size() != s.tilts.size())
    throw std::runtime_error("a schedule needs at least two tilts, and gains at each");
  for (std::size_t i = 1; i < s.tilts.size(); ++i)
    if (!(s.tilts[i - 1] < s.tilts[i]))
      throw std::runtime_error("the tilts of the schedule do not ascend");
  for (const json& set : schedule.at("gains")) s.gains.push_back(fixed<gain_count>(set, "gains"));
}

Statement statement_of(const json& header) {
  expect_keys(header,
              {"tiltrim_proof", "condition", "system", "parameters", "margin", "numbers", "polar",
               "limits", "states", "unknowns", "equations", "equations_are", "boxes"},
              {"schedule", "damping"});
  expect(header, "tiltrim_proof", 1);
  expect(header, "system", "tiltrotor closed loop, wind axes");
  expect(header, "states",
         {"V_err", "gamma_err", "theta", "q", "energy_integral", "distribution_integral"});
  expect(header, "equations", {"V_err", "gamma_err", "q"});
  expect(header, "equations_are", "consistent");
  Statement s;
  s.actuators = header.at("unknowns") == json{"theta", "theta0", "deflection"};
  if (!s.actuators)
    expect(header, "unknowns", {"theta", "energy_integral", "distribution_integral"});
  s.condition = text_of(header.at("condition"), "condition");
  s.parameters = parameters_of(header.at("parameters"));
  s.margin = number_of(header.at("margin"));
  if (s.margin < 0) throw std::runtime_error("the margin is negative");
  if (header.contains("damping")) {
    s.damping = number_of(header.at("damping"));
    if (!(s.damping > 0 && s.damping < 1))
      throw std::runtime_error("the damping ratio is not between 0 and 1");
  }
  const json& numbers = header.at("numbers");
  for (const Named& one : names()) {
    if (!numbers.is_object() || !numbers.contains(one.name))
      throw std::runtime_error(fmt::format("the number '{}' is missing", one.name));
    s.numbers.*(one.member) = Form(number_of(numbers.at(std::string(one.name))));
  }
  const auto blend = std::ranges::find(s.parameters, &Numbers::cyclic_blend, &Parameter::member);
  if (s.numbers.cyclic_blend.value().is_negative() ||
      (blend != s.parameters.end() && blend->domain.lower < 0))
    throw std::runtime_error("'aircraft.cyclic_blend' is negative");
  if (numbers.size() != names().size())
    throw std::runtime_error("'numbers' has a name that is none of the loop's");
  if (header.contains("schedule")) read_schedule(header.at("schedule"), s);
  const json& polar = header.at("polar");
  expect_keys(polar, {"alpha", "CL", "CD", "CM"});
  s.alpha = numbers_of(polar.at("alpha"));
  s.coefficients = {numbers_of(polar.at("CL")), numbers_of(polar.at("CD")),
                    numbers_of(polar.at("CM"))};
  s.polar.emplace(s.alpha, s.coefficients);
  const json& limits = header.at("limits");
  expect_keys(limits, {"theta0", "a1s", "delta_e", "theta"});
  s.theta0 = bounds_of(limits, "theta0");
  s.a1s = bounds_of(limits, "a1s");
  s.delta_e = bounds_of(limits, "delta_e");
  s.theta = bounds_of(limits, "theta");
  return s;
}

std::vector<Half> intervals_of(const json& evidence) {
  const std::vector<double> w = numbers_of(evidence.at("w"));
  const json& v = evidence.at("v");
  if (!v.is_array() || v.empty() || w.size() != v.size() + 1)
    throw std::runtime_error("'w' must have one number more than 'v'");
  std::vector<Half> intervals;
  for (std::size_t j = 0; j < v.size(); ++j) {
    const auto [re, im] = fixed<2>(v[j], "v");
    intervals.push_back({w[j], w[j + 1], re, im});
  }
  return intervals;
}

Record record_of(const json& side, std::size_t numbers, bool damped) {
  expect_keys(side, {"z", "S", "C", "Z", "w", "v", "roots"}, {"T", "ray"});
  Record r;
  r.z = fixed<3>(side.at("z"), "z");
  r.Z = fixed<3>(side.at("Z"), "Z");
  const json &S = side.at("S"), &C = side.at("C");
  if (!S.is_array() || S.size() != 3 || !C.is_array() || C.size() != 3)
    throw std::runtime_error("expected three rows in 'S' and in 'C'");
  for (std::size_t i = 0; i < 3; ++i) {
    r.S[i] = numbers_of(S[i]);
    r.C[i] = fixed<3>(C[i], "C");
    if (r.S[i].size() != numbers)
      throw std::runtime_error(fmt::format("expected {} numbers in a row of 'S'", numbers));
  }
  r.line = intervals_of(side);
  r.roots = integer_of(side.at("roots"), 6, "roots");
  if (damped != side.contains("ray"))
    throw std::runtime_error("a 'ray' belongs to a damping ratio, and only to that");
  if (!damped) return r;
  const json& ray = side.at("ray");
  expect_keys(ray, {"w", "v", "roots"});
  r.ray = intervals_of(ray);
  r.less_damped = integer_of(ray.at("roots"), 6, "roots") > 0;
  return r;
}

Exclusion exclusion_of(const json& side) {
  expect_keys(side, {"exclude"});
  if (!side.at("exclude").is_array()) throw std::runtime_error("'exclude' must be an array");
  Exclusion tree;
  for (const json& entry : side.at("exclude")) {
    Node node;
    if (entry.contains("split")) {
      expect_keys(entry, {"split", "at"});
      node.split = integer_of(entry.at("split"), 3, "split");
      node.at = number_of(entry.at("at"));
    } else {
      expect_keys(entry, {"y"});
      node.weights = fixed<3>(entry.at("y"), "y");
    }
    tree.push_back(node);
  }
  return tree;
}

Leaf leaf_of(const json& object, std::size_t numbers, bool damped) {
  Leaf leaf;
  const std::string claim = text_of(object.at("leaf"), "leaf");
  if (claim == "undecided") {
    expect_keys(object, {"leaf", "cause"});
    const std::string cause = text_of(object.at("cause"), "cause");
    constexpr std::array<std::string_view, 6> causes{"limit",  "crossing", "fold",
                                                     "switch", "width",    "stopped"};
    if (std::ranges::find(causes, cause) == causes.end())
      throw std::runtime_error("unknown cause '" + cause + "'");
    return leaf;
  }
  expect_keys(object, {"leaf", "sides"});
  const json& sides = object.at("sides");
  if (!sides.is_array() || sides.empty())
    throw std::runtime_error("'sides' must be an array with evidence");
  if (claim == "no_trim") {
    leaf.claim = Claim::no_trim;
    for (const json& side : sides) leaf.exclusions.push_back(exclusion_of(side));
    return leaf;
  }
  if (claim != "stable" && claim != "unstable")
    throw std::runtime_error("unknown leaf '" + claim + "'");
  leaf.claim = claim == "stable" ? Claim::stable : Claim::unstable;
  for (const json& side : sides) leaf.records.push_back(record_of(side, numbers, damped));
  return leaf;
}

// The lines of one theorem, from a header on.
class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}

  bool at_end() const { return position_ >= text_.size(); }
  Theorem theorem() {
    Theorem t;
    const json header = next();
    guarded([&] {
      t.statement = statement_of(header);
      integer_of(header.at("boxes"), 1'000'000'000, "boxes");  // examined: no claim
    });
    t.line = line_;
    std::vector<Box> open(1);
    for (const Parameter& p : t.statement.parameters) open.front().push_back(p.domain);
    while (!open.empty()) {
      const json object = next();
      guarded([&] { grow(object, open, t); });
    }
    return t;
  }

 private:
  // The next box of the preorder is the last that is open.
  void grow(const json& object, std::vector<Box>& open, Theorem& t) {
    Box box = std::move(open.back());
    open.pop_back();
    if (object.contains("leaf")) {
      Leaf leaf = leaf_of(object, box.size(), t.statement.damping > 0);
      leaf.line = line_;
      leaf.box = std::move(box);
      t.leaves.push_back(std::move(leaf));
      return;
    }
    expect_keys(object, {"split", "at"});
    const auto k = std::size_t(integer_of(object.at("split"), int(box.size()) - 1, "split"));
    const double at = number_of(object.at("at"));
    if (!(box[k].lower < at && at < box[k].upper))
      throw std::runtime_error("the split lies outside the box");
    Box low = box;
    low[k].upper = box[k].lower = at;
    open.push_back(std::move(box));
    open.push_back(std::move(low));
  }

  json next() {
    if (at_end()) throw Malformed(line_, "the file ends before the tree is complete");
    ++line_;
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string::npos) throw Malformed(line_, "the last line does not end");
    const std::string line = text_.substr(position_, end - position_);
    position_ = end + 1;
    json object;
    guarded([&] { object = parse_line(line); });
    return object;
  }

  template <class Act>
  void guarded(const Act& act) {
    try {
      act();
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& e) {
      throw Malformed(line_, e.what());
    }
  }

  const std::string& text_;
  std::size_t position_ = 0, line_ = 0;
};

}  // namespace

std::vector<Theorem> read_certificate(const std::string& text) {
  Reader reader(text);
  std::vector<Theorem> all;
  do all.push_back(reader.theorem());
  while (!reader.at_end());
  return all;
}

bool is_certificate(const std::string& text) { return text.starts_with("{\"tiltrim_proof\""); }

}  // namespace tiltrim::checking
