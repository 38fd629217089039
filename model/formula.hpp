/// A formula compiled to postfix code, evaluated on any scalar: double, long double or a dual
/// number. Internal to model/.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/dual.hpp"
#include "model/formula_table.hpp"

namespace tiltrim::formula {

/// What a node does with the values on top of the stack. Functions have the name of the formula.
enum class Op : std::uint8_t {
  // clang-format off
  constant, variable, jump, jump_if_zero,
  add, subtract, multiply, divide, power, power_constant, negate,
  less, less_equal, greater, greater_equal, equal, different, both, either,
  sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, asinh, acosh, atanh,
  exp, ln, log10, sqrt, cbrt, abs, sign, atan2, hypot, min, max,
  table
  // clang-format on
};

struct Node {
  Op op;
  std::int32_t index = 0;  ///< of the variable, the table, or the node to jump to
  double number = 0.0;     ///< the constant, or the exponent of power_constant
};

struct Tape {
  std::vector<Node> nodes;
  std::size_t depth = 0;  ///< values on the stack at once
};

/// The position of each name among the variables.
using Names = std::map<std::string, std::int32_t, std::less<>>;

/// Throws std::invalid_argument, quoting the place, if the text is not a formula of these names and
/// tables.
Tape compile(std::string_view text, const Names& names,
             const std::vector<LookupTable>& tables = {});

template <class S>
auto value(const S& a) {
  if constexpr (requires { a.value; })
    return a.value;
  else
    return a;
}

/// Evaluates tapes of up to `count` variables and up to `depth` values on the stack, with tables
/// that outlive it. `doubtful` is set where a function has a kink, a jump or a singular slope, so
/// that the slopes may be those of one side only or wrong.
template <class S>
class Evaluator {
 public:
  Evaluator(std::size_t count, std::size_t depth, const std::vector<LookupTable>& tables = {})
      : tables_(tables.data()),
        large_(count + depth < small ? 0 : count + depth + 1),
        variables_(large_.empty() ? small_ : large_.data()),
        stack_(variables_ + count) {}
  Evaluator(const Evaluator&) = delete;
  Evaluator& operator=(const Evaluator&) = delete;

  S& operator[](std::size_t variable) { return variables_[variable]; }
  bool doubtful = false;

  S operator()(const Tape& tape) {
    S* top = stack_;
    const std::size_t count = tape.nodes.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Node& node = tape.nodes[i];
      if (node.op == Op::variable)
        *++top = variables_[node.index];
      else if (node.op == Op::constant)
        *++top = S(node.number);
      else if (node.op == Op::jump)
        i = std::size_t(node.index) - 1;
      else if (node.op == Op::jump_if_zero)
        i = truth(*top--) ? i : std::size_t(node.index) - 1;
      else if (node.op == Op::power_constant)
        *top = power(*top, node.number);
      else if (node.op == Op::negate || (node.op >= Op::sin && node.op < Op::atan2))
        *top = of_one(node.op, *top);
      else if (node.op == Op::table)
        top = of_table(tables_[node.index], top);
      else {
        --top;
        *top = node.op >= Op::less && node.op <= Op::either ? S(of_order(node.op, *top, top[1]))
                                                            : of_two(node.op, *top, top[1]);
      }
    }
    return *top;
  }

 private:
  // Two values that decide between branches: a kink or jump if they are equal and part.
  void decide(const S& a, const S& b) {
    if constexpr (!std::is_floating_point_v<S>)
      doubtful = doubtful || (a.value == b.value && (a.slopes != b.slopes).any());
  }
  S doubt(bool when, const S& a) {
    doubtful = doubtful || when;
    return a;
  }

  bool truth(const S& a) {
    decide(a, S(0));
    return value(a) != 0;
  }

  S power(const S& a, double b) {
    using std::pow;
    if (b == 2) return a * a;
    if (b == 3) return a * a * a;
    return doubt(value(a) == 0 && !(b >= 1 && b == std::floor(b)), pow(a, b));
  }

  // NaN if any argument is, unlike std::min and std::fmin.
  S extreme(const S& a, const S& b, bool smallest) {
    decide(a, b);
    if (std::isnan(value(a))) return a;
    const S &low = smallest ? a : b, &high = smallest ? b : a;
    return value(low) <= value(high) ? a : b;
  }

  S sign(const S& a) {
    decide(a, S(0));
    if (value(a) > 0) return S(1);
    return value(a) < 0 ? S(-1) : S(value(a));
  }

  S magnitude(const S& a) {
    decide(a, S(0));
    return value(a) < 0 ? -a : S(0) + a;  // 0 of -0
  }

  bool of_order(Op op, const S& a, const S& b) {
    if (op == Op::both || op == Op::either) {
      const bool first = truth(a), second = truth(b);
      return op == Op::both ? first && second : first || second;
    }
    decide(a, b);
    // clang-format off
    switch (op) {
      case Op::less: return value(a) < value(b);
      case Op::greater: return value(a) > value(b);
      case Op::less_equal: return value(a) <= value(b);
      case Op::greater_equal: return value(a) >= value(b);
      case Op::equal: return value(a) == value(b);
      default: return value(a) != value(b);
    }
    // clang-format on
  }

  // The place of the value: that of the first argument.
  S* of_table(const LookupTable& table, S* last) {
    S* const first = last + 1 - table.at.size();
    *first = at(table, first, doubtful);
    return first;
  }

  S of_two(Op op, const S& a, const S& b) {
    using std::atan2, std::hypot, std::pow;
    // clang-format off
    switch (op) {
      case Op::add: return a + b;
      case Op::subtract: return a - b;
      case Op::multiply: return a * b;
      case Op::divide: return a / b;
      case Op::power: return doubt(value(a) == 0, pow(a, b));
      case Op::atan2: return doubt(value(a) == 0 && !(value(b) > 0), atan2(a, b));
      case Op::hypot: return doubt(value(a) == 0 && value(b) == 0, hypot(a, b));
      default: return extreme(a, b, op == Op::min);
    }
    // clang-format on
  }

  S of_one(Op op, const S& a) {
    using std::sin, std::cos, std::tan, std::asin, std::acos, std::atan, std::sinh, std::cosh;
    using std::sqrt, std::cbrt;
    using std::tanh, std::asinh, std::acosh, std::atanh, std::exp, std::log, std::log10;
    // clang-format off
    switch (op) {
      case Op::negate: return -a;
      case Op::sin: return sin(a);
      case Op::cos: return cos(a);
      case Op::tan: return tan(a);
      case Op::asin: return doubt(std::abs(value(a)) == 1, asin(a));
      case Op::acos: return doubt(std::abs(value(a)) == 1, acos(a));
      case Op::atan: return atan(a);
      case Op::sinh: return sinh(a);
      case Op::cosh: return cosh(a);
      case Op::tanh: return tanh(a);
      case Op::asinh: return asinh(a);
      case Op::acosh: return doubt(value(a) == 1, acosh(a));
      case Op::atanh: return atanh(a);
      case Op::exp: return exp(a);
      case Op::ln: return log(a);
      case Op::log10: return log10(a);
      case Op::sqrt: return doubt(value(a) == 0, sqrt(a));
      case Op::cbrt: return doubt(value(a) == 0, cbrt(a));
      case Op::abs: return magnitude(a);
      default: return sign(a);
    }
    // clang-format on
  }

  const LookupTable* const tables_;
  static constexpr std::size_t small = 128;
  S small_[small];  // spares most models an allocation
  std::vector<S> large_;
  S* const variables_;
  S* const stack_;  // used from its second place
};

}  // namespace tiltrim::formula
