// Formulas on ranges with derivatives.
#include "model/formula_jets.hpp"

#include <array>
#include <utility>

#include "model/branches.hpp"
#include "model/formula_check.hpp"

namespace tiltrim::formula {

namespace {

std::string name_of(Op op) {
  constexpr std::array operators{"+",  "-", "*",  "/",  "^",  "^",  "-", "<",
                                 "<=", ">", ">=", "==", "!=", "&&", "||"};
  if (op >= Op::sin) return formula_functions()[std::size_t(op) - std::size_t(Op::sin)];
  return op >= Op::add ? operators[std::size_t(op) - std::size_t(Op::add)] : "? :";
}

// Notes the first function that leaves a comparison open or has no known value.
class Noted {
 public:
  explicit Noted(Op op) : Noted(name_of(op)) {}
  explicit Noted(std::string function) : function_(std::move(function)), open_(blocked()) {}
  ~Noted() {
    if (blocked() && !open_) note("switch");
  }
  Noted(const Noted&) = delete;
  Noted& operator=(const Noted&) = delete;

  Jet operator()(Jet result, const Jet& a, const Jet& b = {}) const {
    if (!result.known() && a.known() && b.known()) note("undefined");
    return result;
  }

 private:
  static bool blocked() { return current_branches && current_branches->blocked; }
  void note(const char* what) const {
    if (current_branches && current_branches->trouble.empty())
      current_branches->trouble = std::string(what) + ": " + function_;
  }

  std::string function_;
  bool open_;
};

bool nonzero(Op op, const Jet& a) {
  if (a.constant() && a.value().rest() == 0) return a.value().centre() != 0;
  const Noted noted(op);
  const bool negative = a < 0.0, positive = 0.0 < a;
  return negative || positive;
}

}  // namespace

template <>
bool Evaluator<Jet>::truth(const Jet& a) {
  return nonzero(Op::jump_if_zero, a);
}

template <>
Jet Evaluator<Jet>::power(const Jet& a, double b) {
  const Noted noted(Op::power);
  return noted(b == 2 ? a * a : b == 3 ? a * a * a : pow(a, b), a);
}

template <>
bool Evaluator<Jet>::of_order(Op op, const Jet& a, const Jet& b) {
  if (op == Op::both || op == Op::either) {
    const bool first = nonzero(op, a), second = nonzero(op, b);
    return op == Op::both ? first && second : first || second;
  }
  const Noted noted(op);
  if (op == Op::less) return a < b;
  if (op == Op::greater) return a > b;
  if (op == Op::less_equal) return a <= b;
  if (op == Op::greater_equal) return a >= b;
  const bool below = a < b, above = b < a;
  return (below || above) == (op == Op::different);
}

template <>
Jet Evaluator<Jet>::of_two(Op op, const Jet& a, const Jet& b) {
  const Noted noted(op);
  // clang-format off
  switch (op) {
    case Op::add: return noted(a + b, a, b);
    case Op::subtract: return noted(a - b, a, b);
    case Op::multiply: return noted(a * b, a, b);
    case Op::divide: return noted(a / b, a, b);
    case Op::power: return noted(pow(a, b), a, b);
    case Op::atan2: return noted(atan2(a, b), a, b);
    case Op::hypot: return noted(hypot(a, b), a, b);
    case Op::min: return noted(min(a, b), a, b);
    default: return noted(max(a, b), a, b);
  }
  // clang-format on
}

template <>
Jet* Evaluator<Jet>::of_table(const LookupTable& table, Jet* last) {
  const Noted noted(table.name);
  const std::span x(last + 1 - table.at.size(), table.at.size());
  const bool known = std::ranges::all_of(x, &Jet::known);
  Jet value = on_jets(table, x);
  if (known) value = noted(std::move(value), 0.0);
  x[0] = std::move(value);
  return x.data();
}

template <>
Jet Evaluator<Jet>::sign(const Jet& a) {
  const bool positive = 0.0 < a, negative = a < 0.0;
  return positive ? 1.0 : negative ? -1.0 : 0.0;
}

template <>
Jet Evaluator<Jet>::of_one(Op op, const Jet& a) {
  const Noted noted(op);
  // clang-format off
  switch (op) {
    case Op::negate: return -a;
    case Op::sin: return noted(sin(a), a);
    case Op::cos: return noted(cos(a), a);
    case Op::tan: return noted(tan(a), a);
    case Op::asin: return noted(asin(a), a);
    case Op::acos: return noted(acos(a), a);
    case Op::atan: return noted(atan(a), a);
    case Op::sinh: return noted(sinh(a), a);
    case Op::cosh: return noted(cosh(a), a);
    case Op::tanh: return noted(tanh(a), a);
    case Op::asinh: return noted(asinh(a), a);
    case Op::acosh: return noted(acosh(a), a);
    case Op::atanh: return noted(atanh(a), a);
    case Op::exp: return noted(exp(a), a);
    case Op::ln: return noted(log(a), a);
    case Op::log10: return noted(log10(a), a);
    case Op::sqrt: return noted(sqrt(a), a);
    case Op::cbrt: return noted(cbrt(a), a);
    case Op::abs: return noted(abs(a), a);
    default: return sign(a);
  }
  // clang-format on
}

std::vector<Jet> on_ranges(const std::vector<Titled>& let, const std::vector<Titled>& rows,
                           const std::vector<LookupTable>& tables, std::size_t depth,
                           std::vector<Jet> variables) {
  const std::size_t known = variables.size();
  Evaluator<Jet> evaluate(known + let.size(), depth, tables);
  for (std::size_t i = 0; i < known; ++i) evaluate[i] = std::move(variables[i]);
  const auto titled = [&](const Titled& formula) {
    const bool before = !current_branches || !current_branches->trouble.empty();
    Jet value = evaluate(formula.tape);
    if (!before && !current_branches->trouble.empty())
      current_branches->trouble += " in " + formula.title;
    return value;
  };
  for (std::size_t i = 0; i < let.size(); ++i) evaluate[known + i] = titled(let[i]);
  std::vector<Jet> values;
  for (const Titled& row : rows) values.push_back(titled(row));
  return values;
}

}  // namespace tiltrim::formula
