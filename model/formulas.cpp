// Formulas are parsed and evaluated by muParser (docs/dependencies.md).
#include "model/formulas.hpp"

#include <fmt/ranges.h>
#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

namespace tiltrim {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr const char* name_characters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";

constexpr const char* operators = "+ - * / ^ < <= > >= == != && || ? : ( )";
constexpr std::size_t longest_name = 100, longest_formula = 20000;  // muParser's own limits

struct Function1 {
  const char* name;
  double (*function)(double);
};
constexpr Function1 functions_of_one[] = {
    {"sin", [](double a) { return std::sin(a); }},
    {"cos", [](double a) { return std::cos(a); }},
    {"tan", [](double a) { return std::tan(a); }},
    {"asin", [](double a) { return std::asin(a); }},
    {"acos", [](double a) { return std::acos(a); }},
    {"atan", [](double a) { return std::atan(a); }},
    {"sinh", [](double a) { return std::sinh(a); }},
    {"cosh", [](double a) { return std::cosh(a); }},
    {"tanh", [](double a) { return std::tanh(a); }},
    {"asinh", [](double a) { return std::asinh(a); }},
    {"acosh", [](double a) { return std::acosh(a); }},
    {"atanh", [](double a) { return std::atanh(a); }},
    {"exp", [](double a) { return std::exp(a); }},
    {"ln", [](double a) { return std::log(a); }},
    {"log10", [](double a) { return std::log10(a); }},
    {"sqrt", [](double a) { return std::sqrt(a); }},
    {"cbrt", [](double a) { return std::cbrt(a); }},
    {"abs", [](double a) { return std::abs(a); }},
    {"sign", [](double a) { return a > 0   ? 1.0
                                   : a < 0 ? -1.0
                                           : a; }},
};

// Unlike std::min and std::fmin, NaN if any argument is NaN.
double least(const double* values, int count) {
  double m = values[0];
  for (int i = 1; i < count; ++i) m = std::isnan(m) || values[i] >= m ? m : values[i];
  return m;
}
double most(const double* values, int count) {
  double m = values[0];
  for (int i = 1; i < count; ++i) m = std::isnan(m) || values[i] <= m ? m : values[i];
  return m;
}

// A parser with the library's own functions only, so that names such as "log" have their usual
// meaning in the field.
mu::Parser parser() {
  mu::Parser p;
  p.ClearFun();
  p.ClearConst();
  p.DefineNameChars(name_characters);
  for (const auto& [name, function] : functions_of_one) p.DefineFun(name, function);
  p.DefineFun("atan2", static_cast<double (*)(double, double)>(
                           [](double y, double x) { return std::atan2(y, x); }));
  p.DefineFun("hypot", static_cast<double (*)(double, double)>(
                           [](double a, double b) { return std::hypot(a, b); }));
  p.DefineFun("min", least);
  p.DefineFun("max", most);
  p.DefineConst("pi", std::numbers::pi);
  return p;
}

// "a = b" would be an assignment; "=" is allowed only in comparisons.
bool assigns(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    const char before = i > 0 ? text[i - 1] : ' ';
    const char after = i + 1 < text.size() ? text[i + 1] : ' ';
    if (after == '=') {
      ++i;
    } else if (before != '<' && before != '>' && before != '!') {
      return true;
    }
  }
  return false;
}

// The error message for a token that cannot be parsed.
std::string unknown(const std::string& token, std::size_t position,
                    const std::vector<std::string>& names) {
  const std::string word = token.substr(0, token.find_first_not_of(name_characters));
  if (word.empty())
    return fmt::format("'{}' at character {} has no meaning here; expected {}", token, position,
                       operators);
  if (word.front() >= '0' && word.front() <= '9')
    return fmt::format("'{}' at character {} is not a number", word, position);
  if (std::ranges::find(formula_functions(), word) != formula_functions().end())
    return fmt::format("'{0}' at character {1} has no arguments; expected {0}(...)", word,
                       position);
  std::vector<std::string> known = names;
  known.insert(known.end(), formula_functions().begin(), formula_functions().end());
  known.emplace_back("pi");
  const std::string near = word == "log" ? "ln' or 'log10" : nearest_name(word, known);
  return fmt::format("'{}' at character {} is not a known name; {}there are: {}", word, position,
                     near.empty() ? "" : fmt::format("did you mean '{}'? ", near),
                     fmt::join(known, ", "));
}

// Position of the token, from 1; muParser counts from 0 and gives the end of some tokens.
std::size_t position_of(std::string_view token, std::size_t at, std::string_view text) {
  const auto stands = [&](std::size_t i) {
    return i <= text.size() && text.substr(i).starts_with(token);
  };
  const bool behind = !stands(at) && at >= token.size() && stands(at - token.size());
  return at + 1 - (behind ? token.size() : 0);
}

std::string complaint(const mu::Parser::exception_type& e, std::string_view text,
                      const std::vector<std::string>& names) {
  std::string token = e.GetToken();
  token.erase(token.find_last_not_of(" \t\n") + 1);
  const std::size_t position = position_of(token, std::size_t(std::max(e.GetPos(), 0)), text);
  switch (e.GetCode()) {
    case mu::ecUNASSIGNABLE_TOKEN:
      return unknown(token, position, names);
    case mu::ecUNEXPECTED_OPERATOR:
    case mu::ecUNEXPECTED_ARG_SEP:
    case mu::ecUNEXPECTED_VAL:
    case mu::ecUNEXPECTED_VAR:
    case mu::ecUNEXPECTED_FUN:
    case mu::ecUNEXPECTED_PARENS:
    case mu::ecUNEXPECTED_CONDITIONAL:
      return fmt::format("'{}' at character {} is not allowed there", token, position);
    case mu::ecUNEXPECTED_EOF:
    case mu::ecEMPTY_EXPRESSION:
      return "ends where a value is expected";
    case mu::ecMISSING_PARENS:
      return "a closing parenthesis is missing";
    case mu::ecMISSING_ELSE_CLAUSE:
    case mu::ecMISPLACED_COLON:
      return "has a ? without a : or a : without a ?; expected a ? b : c";
    case mu::ecTOO_FEW_PARAMS:
      return fmt::format("too few arguments for {} at character {}", token, position);
    case mu::ecTOO_MANY_PARAMS:
      return fmt::format("too many arguments for {} at character {}", token, position);
    case mu::ecUNEXPECTED_ARG:
      return "has a comma outside of a function's arguments";
    case mu::ecUNEXPECTED_STR:
    case mu::ecUNTERMINATED_STRING:
    case mu::ecSTR_RESULT:
      return "has text in quotes; expected numbers, names and functions";
    default:
      return e.GetMsg();
  }
}

// One thread's compiled formulas, bound to its own states, inputs, parameters and `let` values.
struct Bench {
  VectorXd numbers;
  std::vector<mu::Parser> let, rates, values, switches;

  explicit Bench(const Formulas& m)
      : numbers(VectorXd::Zero(std::ssize(m.states) + std::ssize(m.inputs) +
                               std::ssize(m.parameters) + std::ssize(m.let))) {
    std::vector<std::string> known;
    for (const Signals* signals : {&m.states, &m.inputs, &m.parameters})
      for (const Signal& s : *signals) known.push_back(s.name);
    const auto bound = [&](const std::string& text) {
      mu::Parser p = parser();
      for (std::size_t i = 0; i < known.size(); ++i) p.DefineVar(known[i], &numbers[Index(i)]);
      p.SetExpr(text);
      return p;
    };
    for (const Formula& f : m.let) {
      let.push_back(bound(f.text));
      known.push_back(f.name);
    }
    for (const std::string& text : m.rates) rates.push_back(bound(text));
    for (const std::string& text : m.values) values.push_back(bound(text));
    for (const Formula& f : m.switches) switches.push_back(bound(f.text));
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  void put(const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    numbers.head(x.size()) = x;
    numbers.segment(x.size(), u.size()) = u;
    numbers.segment(x.size() + u.size(), p.size()) = p;
    Index at = numbers.size() - std::ssize(let);
    for (mu::Parser& one : let) numbers[at++] = one.Eval();
  }

  static VectorXd evaluate(std::vector<mu::Parser>& parsers) {
    VectorXd result(std::ssize(parsers));
    for (std::size_t i = 0; i < parsers.size(); ++i) result[Index(i)] = parsers[i].Eval();
    return result;
  }
};

// Benches that no thread is using.
class Benches {
 public:
  explicit Benches(Formulas formulas) : formulas_(std::move(formulas)) {}

  template <class Work>
  auto with(const VectorXd& x, const VectorXd& u, const VectorXd& p, const Work& work) {
    std::unique_ptr<Bench> bench = take();
    try {
      bench->put(x, u, p);
      auto result = work(*bench);
      give(std::move(bench));
      return result;
    } catch (const mu::Parser::exception_type& e) {
      throw std::runtime_error(fmt::format("{}: {}", e.GetExpr(), e.GetMsg()));
    }
  }

 private:
  std::unique_ptr<Bench> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Bench> bench = std::move(idle_.back());
        idle_.pop_back();
        return bench;
      }
    }
    return std::make_unique<Bench>(formulas_);
  }
  void give(std::unique_ptr<Bench> bench) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(bench));
  }

  Formulas formulas_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Bench>> idle_;
};

void check_count(std::size_t have, std::size_t want, const char* what) {
  if (have != want)
    throw std::invalid_argument(fmt::format("{} formulas for {} {}", have, want, what));
}

// Checks that names are distinct and valid, and that every formula uses only names before it.
void check(const Formulas& m) {
  check_count(m.rates.size(), m.states.size(), "states");
  check_count(m.values.size(), m.outputs.size(), "outputs");
  std::vector<std::string> known;
  const auto learn = [&](const std::string& name) {
    check_formula_name(name);
    if (std::ranges::find(known, name) != known.end())
      throw std::invalid_argument(fmt::format("'{}' occurs twice", name));
    known.push_back(name);
  };
  for (const Signals* signals : {&m.states, &m.inputs, &m.parameters})
    for (const Signal& s : *signals) learn(s.name);
  for (const Formula& f : m.let) {
    check_formula(f.text, known);
    learn(f.name);
  }
  for (const auto* texts : {&m.rates, &m.values})
    for (const std::string& text : *texts) check_formula(text, known);
  for (const Formula& f : m.switches) check_formula(f.text, known);
}

}  // namespace

const std::vector<std::string>& formula_functions() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> functions;
    for (const Function1& f : functions_of_one) functions.emplace_back(f.name);
    functions.insert(functions.end(), {"atan2", "hypot", "min", "max"});
    return functions;
  }();
  return all;
}

void check_formula_name(std::string_view name) {
  const bool starts = !name.empty() && !(name.front() >= '0' && name.front() <= '9');
  if (!starts || name.find_first_not_of(name_characters) != std::string_view::npos)
    throw std::invalid_argument(
        fmt::format("'{}' cannot be a name in a formula; expected letters, digits and _, not "
                    "starting with a digit",
                    name));
  if (name.size() > longest_name)
    throw std::invalid_argument(fmt::format("'{}...' is {} characters long; expected at most {}",
                                            name.substr(0, 20), name.size(), longest_name));
  if (name == "pi" || std::ranges::find(formula_functions(), name) != formula_functions().end())
    throw std::invalid_argument(
        fmt::format("'{}' has another meaning in formulas; expected another name", name));
}

void check_formula(std::string_view text, const std::vector<std::string>& names) {
  if (text.size() > longest_formula)
    throw std::invalid_argument(
        fmt::format("{} characters long; expected at most {}", text.size(), longest_formula));
  if (assigns(text))
    throw std::invalid_argument("has a single =, which would assign; expected == to compare");
  std::vector<double> numbers(names.size(), 0.0);
  mu::Parser p = parser();
  try {
    for (std::size_t i = 0; i < names.size(); ++i) p.DefineVar(names[i], &numbers[i]);
    p.SetExpr(std::string(text));
    int count = 0;
    (void)p.Eval(count);
    if (count != 1)
      throw std::invalid_argument(fmt::format("has {} values; expected one formula", count));
  } catch (const mu::Parser::exception_type& e) {
    throw std::invalid_argument(complaint(e, text, names));
  }
}

Model model_of(const Formulas& formulas) {
  check(formulas);
  Model m{formulas.name,
          formulas.states,
          formulas.inputs,
          formulas.outputs,
          formulas.parameters,
          {},
          {},
          {},
          {},
          {},
          {}};
  const auto benches = std::make_shared<Benches>(formulas);
  m.f = [benches](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return benches->with(x, u, p, [](Bench& b) { return Bench::evaluate(b.rates); });
  };
  if (!formulas.outputs.empty())
    m.h = [benches](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
      return benches->with(x, u, p, [](Bench& b) { return Bench::evaluate(b.values); });
    };
  for (std::size_t i = 0; i < formulas.switches.size(); ++i)
    m.switches.push_back({formulas.switches[i].name, [benches, i](const OperatingPoint& at) {
                            return benches->with(at.x, at.u, at.p, [i](Bench& b) {
                              return double(b.switches[i].Eval());
                            });
                          }});
  check(m);
  return m;
}

}  // namespace tiltrim
