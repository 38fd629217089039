// Formulas on ranges.                                                          [13]
#include "model/formula_ranges.hpp"

#include <algorithm>
#include <cmath>

namespace tiltrim::formula {

namespace {

constexpr int most_splits = 64;  // comparisons left open: both sides are evaluated

enum class Truth { no, yes, open };

Truth truth(const Interval& a) {
  if (a.lower() > 0 || a.upper() < 0) return Truth::yes;
  return a.zero() ? Truth::no : Truth::open;
}

Interval as_number(Truth t) {
  return t == Truth::open ? Interval(0, 1) : Interval(t == Truth::yes ? 1 : 0);
}

Truth opposite(Truth t) {
  if (t == Truth::open) return t;
  return t == Truth::yes ? Truth::no : Truth::yes;
}

Truth below(const Interval& a, const Interval& b) {
  if (a.upper() < b.lower()) return Truth::yes;
  return a.lower() >= b.upper() ? Truth::no : Truth::open;
}

Truth equal(const Interval& a, const Interval& b) {
  if (a.upper() < b.lower() || b.upper() < a.lower()) return Truth::no;
  const bool one_number =
      a.lower() == b.lower() && a.lower() == a.upper() && b.lower() == b.upper();
  return one_number ? Truth::yes : Truth::open;
}

Truth of_order(Op op, const Interval& a, const Interval& b) {
  const Truth first = truth(a), second = truth(b);
  // clang-format off
  switch (op) {
    case Op::less: return below(a, b);
    case Op::greater: return below(b, a);
    case Op::less_equal: return opposite(below(b, a));
    case Op::greater_equal: return opposite(below(a, b));
    case Op::equal: return equal(a, b);
    case Op::different: return opposite(equal(a, b));
    case Op::both:
      if (first == Truth::no || second == Truth::no) return Truth::no;
      return first == Truth::yes && second == Truth::yes ? Truth::yes : Truth::open;
    default:
      if (first == Truth::yes || second == Truth::yes) return Truth::yes;
      return first == Truth::no && second == Truth::no ? Truth::no : Truth::open;
  }
  // clang-format on
}

Interval extreme(Op op, const Interval& a, const Interval& b) {
  if (!a.finite() || !b.finite()) return Interval::unknown();
  if (op == Op::min) return {std::min(a.lower(), b.lower()), std::min(a.upper(), b.upper())};
  return {std::max(a.lower(), b.lower()), std::max(a.upper(), b.upper())};
}

Interval power(const Interval& a, const Interval& b) {
  if (b.lower() == b.upper()) return b.lower() == 2 ? square(a) : pow(a, b.lower());
  return a.lower() > 0 ? exp(b * log(a)) : Interval::unknown();
}

Interval sign(const Interval& a) {
  if (!a.finite()) return Interval::unknown();
  const auto of = [](double x) { return double(x > 0) - double(x < 0); };
  return {of(a.lower()), of(a.upper())};
}

Interval tangent(const Interval& a) {  // rises between the zeros of the cosine
  const Interval c = cos(a);
  if (!(c.lower() > 0 || c.upper() < 0)) return Interval::unknown();
  return rising(std::tan(a.lower()), std::tan(a.upper()));
}

Interval of_two(Op op, const Interval& a, const Interval& b) {
  // clang-format off
  switch (op) {
    case Op::add: return a + b;
    case Op::subtract: return a - b;
    case Op::multiply: return a * b;
    case Op::divide: return a / b;
    case Op::power: return power(a, b);
    case Op::atan2: return atan2(a, b);
    case Op::hypot: return sqrt(square(a) + square(b));
    case Op::min:
    case Op::max: return extreme(op, a, b);
    default: return as_number(of_order(op, a, b));
  }
  // clang-format on
}

Interval of_one(Op op, const Interval& a) {
  const double l = a.lower(), u = a.upper();
  // clang-format off
  switch (op) {
    case Op::negate: return -a;
    case Op::sin: return sin(a);
    case Op::cos: return cos(a);
    case Op::tan: return tangent(a);
    case Op::asin: return asin(a);
    case Op::acos: return rising(std::acos(u), std::acos(l));
    case Op::atan: return atan(a);
    case Op::sinh: return sinh(a);
    case Op::cosh: return cosh(a);
    case Op::tanh: return tanh(a);
    case Op::asinh: return rising(std::asinh(l), std::asinh(u));
    case Op::acosh: return rising(std::acosh(l), std::acosh(u));
    case Op::atanh: return rising(std::atanh(l), std::atanh(u));
    case Op::exp: return exp(a);
    case Op::ln: return log(a);
    case Op::log10: return l > 0 ? rising(std::log10(l), std::log10(u)) : Interval::unknown();
    case Op::sqrt: return sqrt(a);
    case Op::cbrt: return rising(std::cbrt(l), std::cbrt(u));
    case Op::abs: return abs(a);
    default: return sign(a);
  }
  // clang-format on
}

// x x, of which neither is the last value of a branch.
bool squares(const std::vector<Node>& nodes, std::size_t i) {
  if (nodes[i].op != Op::multiply || i < 2) return false;
  const Node &a = nodes[i - 2], &b = nodes[i - 1];
  return a.op == Op::variable && b.op == Op::variable && a.index == b.index &&
         (i < 3 || nodes[i - 3].op != Op::jump);
}

// From node i on. Where a comparison is open, what contains the values of both sides.
Interval range_from(const Tape& tape, std::size_t i, std::vector<Interval> stack,
                    const std::vector<Interval>& variables, const std::vector<LookupTable>& tables,
                    int& splits) {
  for (; i < tape.nodes.size(); ++i) {
    const Node& node = tape.nodes[i];
    if (node.op == Op::variable) {
      stack.push_back(variables[std::size_t(node.index)]);
    } else if (node.op == Op::constant) {
      stack.emplace_back(node.number);
    } else if (node.op == Op::jump) {
      i = std::size_t(node.index) - 1;
    } else if (node.op == Op::jump_if_zero) {
      const Truth taken = truth(stack.back());
      stack.pop_back();
      if (taken == Truth::open) {
        if (splits-- <= 0) return Interval::unknown();
        return hull(range_from(tape, i + 1, stack, variables, tables, splits),
                    range_from(tape, std::size_t(node.index), stack, variables, tables, splits));
      }
      if (taken == Truth::no) i = std::size_t(node.index) - 1;
    } else if (node.op == Op::power_constant) {
      stack.back() = power(stack.back(), node.number);
    } else if (node.op == Op::table) {
      const LookupTable& table = tables[std::size_t(node.index)];
      const Interval value = range(table, std::span(stack).last(table.at.size()));
      stack.resize(stack.size() - table.at.size() + 1);
      stack.back() = value;
    } else if (node.op == Op::negate || (node.op >= Op::sin && node.op < Op::atan2)) {
      stack.back() = of_one(node.op, stack.back());
    } else {
      const Interval second = stack.back();
      stack.pop_back();
      stack.back() =
          squares(tape.nodes, i) ? square(second) : of_two(node.op, stack.back(), second);
    }
  }
  return stack.back();
}

}  // namespace

Interval range_of(const Tape& tape, const std::vector<Interval>& variables,
                  const std::vector<LookupTable>& tables) {
  int splits = most_splits;
  std::vector<Interval> stack;
  stack.reserve(tape.depth);
  return range_from(tape, 0, std::move(stack), variables, tables, splits);
}

}  // namespace tiltrim::formula
