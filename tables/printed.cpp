// Reading printed numbers and comparing digits.
#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "tables/tables.hpp"

namespace tiltrim {

namespace {

[[noreturn]] void refuse(std::string_view text) {
  throw std::invalid_argument(
      fmt::format("\"{}\" is not a printed number: expected a decimal or pi/n", text));
}

int whole_number(std::string_view text, std::string_view all) {
  int n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || n <= 0) refuse(all);
  return n;
}

// "pi" or "pi/n" is 1 in units of pi/n.
Printed read_pi(std::string_view digits, std::string_view all, double sign) {
  const std::string_view rest = digits.substr(2);
  int n = 1;
  if (!rest.empty()) {
    if (rest.front() != '/') refuse(all);
    n = whole_number(rest.substr(1), all);
  }
  const double unit = std::numbers::pi / n;
  return {std::string(all), sign * unit, unit};
}

Columns<std::string> strings(const nlohmann::json& row, const std::string& key) {
  if (!row.is_array() || row.size() != 3)
    throw std::invalid_argument(key + ": expected an array of 3 strings");
  Columns<std::string> texts;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!row[i].is_string())
      throw std::invalid_argument(fmt::format("{}[{}]: expected a string", key, i));
    texts[i] = row[i].get<std::string>();
  }
  return texts;
}

const nlohmann::json& member(const nlohmann::json& object, const char* name,
                             const std::string& key) {
  if (!object.is_object() || !object.contains(name)) throw std::invalid_argument(key + ": missing");
  return object.at(name);
}

Columns<Printed> row(const nlohmann::json& root, const char* table, const char* name) {
  const std::string key = fmt::format("{}.{}", table, name);
  const Columns<std::string> texts = strings(member(member(root, table, table), name, key), key);
  Columns<Printed> numbers;
  for (std::size_t i = 0; i < 3; ++i) {
    try {
      numbers[i] = read_printed(texts[i]);
    } catch (const std::invalid_argument& e) {
      throw std::invalid_argument(fmt::format("{}[{}]: {}", key, i, e.what()));
    }
  }
  return numbers;
}

PublishedTables published(const nlohmann::json& root) {
  PublishedTables p;
  const auto& source = member(root, "source", "source");
  if (!source.is_string()) throw std::invalid_argument("source: expected a string");
  p.source = source.get<std::string>();
  p.columns = strings(member(root, "columns", "columns"), "columns");
  p.eta = row(root, "table1", "eta");
  p.gamma = row(root, "table1", "gamma");
  p.alpha = row(root, "table1", "alpha");
  p.V = row(root, "table1", "V");
  p.CL = row(root, "table2", "CL");
  p.CD = row(root, "table2", "CD");
  p.CM = row(root, "table2", "CM");
  p.theta0 = row(root, "table3", "theta0");
  p.delta_e = row(root, "table3", "delta_e");
  p.a1s = row(root, "table3", "a1s");
  return p;
}

}  // namespace

Printed read_printed(std::string_view text) {
  const bool negative = text.starts_with('-');
  const std::string_view digits = text.substr(negative ? 1 : 0);
  const double sign = negative ? -1.0 : 1.0;
  if (digits.starts_with("pi")) return read_pi(digits, text, sign);
  const std::size_t point = digits.find('.');
  const bool decimal = digits.find_first_not_of("0123456789.") == std::string_view::npos &&
                       digits.find_first_of("0123456789") != std::string_view::npos;
  if (!decimal || digits.size() > 18) refuse(text);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) refuse(text);
  const auto decimals = point == std::string_view::npos ? 0 : digits.size() - point - 1;
  return {std::string(text), sign * value, std::pow(10.0, -static_cast<double>(decimals))};
}

PublishedTables load_published_tables(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  try {
    return published(nlohmann::json::parse(in));
  } catch (const nlohmann::json::exception& e) {
    throw std::runtime_error(fmt::format("{}: not JSON: {}", file.string(), e.what()));
  } catch (const std::invalid_argument& e) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
  }
}

std::string to_string(Agreement agreement) {
  switch (agreement) {
    case Agreement::exact:
      return "exact";
    case Agreement::both:
      return "truncated or rounded";
    case Agreement::truncated:
      return "truncated";
    case Agreement::rounded:
      return "rounded";
    case Agreement::opposite_sign:
      return "opposite sign";
    case Agreement::different:
      return "different";
    case Agreement::not_computed:
      break;
  }
  return "not computed";
}

Cell compare(const Printed& published, std::optional<double> computed, std::string remark) {
  constexpr double noise = 1e-9;  // units: decimals are not exact in binary
  Cell cell{published, computed, {}, Agreement::not_computed, std::move(remark)};
  if (!computed) return cell;
  cell.deviation = (*computed - published.value) / published.unit;
  const double excess = (std::abs(*computed) - std::abs(published.value)) / published.unit;
  const bool truncated = excess >= -noise && excess < 1.0 - noise;
  const bool rounded = std::abs(excess) <= 0.5 + noise;
  const bool same_sign = *computed * published.value >= 0.0;
  if (std::abs(*cell.deviation) <= noise)
    cell.agreement = Agreement::exact;
  else if (!truncated && !rounded)
    cell.agreement = Agreement::different;
  else if (!same_sign)
    cell.agreement = Agreement::opposite_sign;
  else
    cell.agreement = truncated && rounded ? Agreement::both
                     : truncated          ? Agreement::truncated
                                          : Agreement::rounded;
  return cell;
}

}  // namespace tiltrim
