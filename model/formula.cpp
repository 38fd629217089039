// Formulas to postfix code by operator precedence (the shunting-yard algorithm). It does not
// recurse, so that the depth of a formula is limited by its length only.
#include "model/formula.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "model/formula_check.hpp"
#include "model/formulas.hpp"
#include "model/lookup.hpp"

namespace tiltrim {

namespace {

using formula::Names;
using formula::Node;
using formula::Op;
using formula::Tape;

constexpr const char* name_characters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
constexpr const char* operators = "+ - * / ^ < <= > >= == != && || ? : ( )";
constexpr std::size_t longest_name = 100, longest_formula = 20000;

// From Op::sin.
constexpr std::array function_names = {"sin",  "cos",   "tan",   "asin",  "acos",  "atan",
                                       "sinh", "cosh",  "tanh",  "asinh", "acosh", "atanh",
                                       "exp",  "ln",    "log10", "sqrt",  "cbrt",  "abs",
                                       "sign", "atan2", "hypot", "min",   "max"};

struct BinaryOperator {
  std::string_view text;
  Op op;
  int precedence;
};
// Of two that begin alike, the longer first.
constexpr int sign_precedence = 5, power_precedence = 6;
constexpr BinaryOperator binary_operators[] = {{"||", Op::either, 1},
                                               {"&&", Op::both, 2},
                                               {"<=", Op::less_equal, 3},
                                               {">=", Op::greater_equal, 3},
                                               {"==", Op::equal, 3},
                                               {"!=", Op::different, 3},
                                               {"<", Op::less, 3},
                                               {">", Op::greater, 3},
                                               {"+", Op::add, 4},
                                               {"-", Op::subtract, 4},
                                               {"*", Op::multiply, 5},
                                               {"/", Op::divide, 5},
                                               {"^", Op::power, power_precedence}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

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

class Compiler {
 public:
  Compiler(std::string_view text, const Names& names, const std::vector<LookupTable>& tables)
      : text_(text), names_(names), tables_(tables) {}

  Tape compile() {
    for (skip_space(); at_ < text_.size(); skip_space())
      if (value_next_)
        value();
      else
        after();
    if (value_next_) refuse("ends where a value is expected");
    reduce(0);
    if (!waiting_.empty())
      refuse(waiting_.back().kind == Waiting::question ? without_colon
                                                       : "a closing parenthesis is missing");
    if (formulas_ > 1) refuse(fmt::format("has {} values; expected one formula", formulas_));
    return std::move(tape_);
  }

 private:
  // An operator or bracket that waits for what follows it.
  struct Waiting {
    enum Kind { operation, bracket, question, colon } kind;
    Op op = Op::negate;  // of an operation, or the function of a bracket
    int precedence = 0;
    std::size_t jump = 0;   // the node to be completed with the place to jump to
    int arguments = 0;      // of a function; 0: the bracket is no function's
    std::size_t table = 0;  // of Op::table
  };

  static constexpr const char* without_colon =
      "has a ? without a : or a : without a ?; expected a ? b : c";

  [[noreturn]] static void refuse(const std::string& words) { throw std::invalid_argument(words); }
  [[noreturn]] void misplaced(std::string_view token) const {
    refuse(fmt::format("'{}' at character {} is not allowed there", token, at_ + 1));
  }
  [[noreturn]] void unknown() const;

  void skip_space() {
    while (at_ < text_.size() && text_[at_] > 0 && text_[at_] <= ' ') ++at_;
  }
  bool next_is(std::string_view token) const { return text_.substr(at_).starts_with(token); }
  std::string_view word() const {
    const std::string_view rest = text_.substr(at_);
    return rest.substr(0, rest.find_first_not_of(name_characters));
  }

  void emit(const Node& node, int pushed) {
    tape_.nodes.push_back(node);
    depth_ += std::size_t(pushed);  // wraps to subtract
    tape_.depth = std::max(tape_.depth, depth_);
  }
  bool constant_last() const {
    return tape_.nodes.size() > sealed_ && tape_.nodes.back().op == Op::constant;
  }
  // Code before this place may be jumped over.
  void land(std::size_t jump) {
    sealed_ = tape_.nodes.size();
    tape_.nodes[jump].index = std::int32_t(sealed_);
  }

  void emit(Op op) {
    if (op == Op::negate && constant_last()) {
      tape_.nodes.back().number *= -1;
    } else if (op == Op::power && constant_last()) {
      tape_.nodes.back().op = Op::power_constant;
      --depth_;
    } else {
      emit({op}, op == Op::negate || (op >= Op::sin && op < Op::atan2) ? 0 : -1);
    }
  }

  // Emits the waiting operators that bind at least this strongly.
  void reduce(int precedence) {
    while (!waiting_.empty()) {
      const Waiting& last = waiting_.back();
      const bool conditional = last.kind == Waiting::colon && precedence == 0;
      if (!conditional && (last.kind != Waiting::operation || last.precedence < precedence)) return;
      if (conditional)
        land(last.jump);
      else
        emit(last.op);
      waiting_.pop_back();
    }
  }

  std::optional<double> number();
  void value();
  void name();
  void after();
  void question();
  void colon();
  void comma();
  void close();

  std::string_view text_;
  const Names& names_;
  const std::vector<LookupTable>& tables_;
  std::size_t at_ = 0;
  bool value_next_ = true;  // rather than an operator
  bool signed_ = false;     // a sign precedes
  int formulas_ = 1;        // separated by commas
  Tape tape_;
  std::size_t depth_ = 0, sealed_ = 0;
  std::vector<Waiting> waiting_;
};

void Compiler::unknown() const {
  if (text_[at_] == '"') refuse("has text in quotes; expected numbers, names and functions");
  const std::string token(word());
  if (token.empty()) {
    std::string_view rest = text_.substr(at_);
    rest = rest.substr(0, rest.find_last_not_of(" \t\n") + 1);
    refuse(fmt::format("'{}' at character {} has no meaning here; expected {}", rest, at_ + 1,
                       operators));
  }
  if (is_digit(token.front()))
    refuse(fmt::format("'{}' at character {} is not a number", token, at_ + 1));
  const bool function = std::ranges::find(formula_functions(), token) != formula_functions().end();
  if (function || std::ranges::find(tables_, token, &LookupTable::name) != tables_.end())
    refuse(
        fmt::format("'{0}' at character {1} has no arguments; expected {0}(...)", token, at_ + 1));
  std::vector<std::string> known(names_.size());
  for (const auto& [name, position] : names_) known[std::size_t(position)] = name;
  for (const LookupTable& table : tables_) known.push_back(table.name);
  known.insert(known.end(), formula_functions().begin(), formula_functions().end());
  known.emplace_back("pi");
  const std::string near = token == "log" ? "ln' or 'log10" : nearest_name(token, known);
  refuse(fmt::format("'{}' at character {} is not a known name; {}there are: {}", token, at_ + 1,
                     near.empty() ? "" : fmt::format("did you mean '{}'? ", near),
                     fmt::join(known, ", ")));
}

// Reads a number if one is next.
std::optional<double> Compiler::number() {
  const bool starts = is_digit(text_[at_]) ||
                      (text_[at_] == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]));
  if (!starts) return {};
  double read = 0;
  const char* const begin = text_.data() + at_;
  const auto [end, error] = std::from_chars(begin, text_.data() + text_.size(), read);
  const bool half = end != text_.data() + text_.size() && (*end == 'e' || *end == 'E');
  if (error != std::errc() || half) unknown();
  if (!value_next_) misplaced({begin, std::size_t(end - begin)});
  at_ += std::size_t(end - begin);
  return read;
}

// Reads a value, or what may stand before one.
void Compiler::value() {
  const bool after_sign = std::exchange(signed_, false);
  if (const std::optional<double> read = number()) {
    emit({Op::constant, 0, *read}, 1);
    value_next_ = false;
  } else if (next_is("(")) {
    waiting_.push_back({Waiting::bracket});
    ++at_;
  } else if ((next_is("-") || next_is("+")) && !after_sign) {
    if (next_is("-")) waiting_.push_back({Waiting::operation, Op::negate, sign_precedence});
    signed_ = true;
    ++at_;
  } else if (!word().empty()) {
    name();
  } else {
    const bool call = !waiting_.empty() && waiting_.back().arguments == 1 &&
                      tape_.nodes.size() == waiting_.back().jump && !after_sign;
    if (next_is(")") && call) return close();
    if (next_is("*") && at_ > 0 && text_[at_ - 1] == '*')
      refuse(fmt::format("'**' at character {} is no operator; expected ^ for a power", at_));
    for (const std::string_view token : {")", ",", "?", ":", "+", "-"})
      if (next_is(token)) misplaced(token);
    for (const BinaryOperator& binary : binary_operators)
      if (next_is(binary.text)) misplaced(binary.text);
    unknown();
  }
}

// A variable, pi or a function with its opening bracket.
void Compiler::name() {
  const std::string_view token = word();
  const auto function = std::ranges::find(function_names, token);
  const auto table = std::ranges::find(tables_, token, &LookupTable::name);
  const auto variable = names_.find(token);
  const std::size_t open = text_.find_first_not_of(" \t\n", at_ + token.size());
  const bool callable = function != function_names.end() || table != tables_.end();
  const bool call = callable && open < text_.size() && text_[open] == '(';
  if (!call && variable == names_.end() && token != "pi") unknown();
  if (!value_next_) misplaced(token);
  at_ += token.size();
  if (call) {
    const Op op = Op(int(Op::sin) + int(function - function_names.begin()));  // else Op::table
    waiting_.push_back(
        {Waiting::bracket, op, 0, tape_.nodes.size(), 1, std::size_t(table - tables_.begin())});
    at_ = open + 1;
    return;
  }
  if (token == "pi")
    emit({Op::constant, 0, std::numbers::pi}, 1);
  else
    emit({Op::variable, variable->second}, 1);
  value_next_ = false;
}

// Reads what may stand after a value.
void Compiler::after() {
  for (const BinaryOperator& binary : binary_operators) {
    if (!next_is(binary.text)) continue;
    reduce(binary.op == Op::power ? power_precedence + 1 : binary.precedence);
    waiting_.push_back({Waiting::operation, binary.op, binary.precedence});
    at_ += binary.text.size();
    value_next_ = true;
    return;
  }
  if (next_is("?")) return question();
  if (next_is(":")) return colon();
  if (next_is(",")) return comma();
  if (next_is(")")) return close();
  if (next_is("(")) misplaced("(");
  (void)number();  // refuses one
  if (word().empty()) unknown();
  name();  // refuses it
}

void Compiler::question() {
  reduce(1);
  waiting_.push_back({Waiting::question, Op::jump, 0, tape_.nodes.size()});
  emit({Op::jump_if_zero}, -1);
  ++at_;
  value_next_ = true;
}

void Compiler::colon() {
  reduce(0);
  if (waiting_.empty() || waiting_.back().kind != Waiting::question) refuse(without_colon);
  const std::size_t jump = tape_.nodes.size();
  emit({Op::jump}, -1);  // the other branch leaves its value at the same place
  land(waiting_.back().jump);
  waiting_.back() = {Waiting::colon, Op::jump, 0, jump};
  ++at_;
  value_next_ = true;
}

void Compiler::comma() {
  reduce(0);
  if (waiting_.empty()) {
    ++formulas_;
  } else {
    if (waiting_.back().kind == Waiting::question) refuse(without_colon);
    if (waiting_.back().arguments == 0) refuse("has a comma outside of a function's arguments");
    ++waiting_.back().arguments;
  }
  ++at_;
  value_next_ = true;
}

void Compiler::close() {
  reduce(0);
  if (waiting_.empty()) misplaced(")");
  const Waiting bracket = waiting_.back();
  if (bracket.kind == Waiting::question) refuse(without_colon);
  if (bracket.arguments > 0) {
    const bool table = bracket.op == Op::table, any = !table && bracket.op >= Op::min;
    const int count = value_next_ ? 0 : bracket.arguments;
    const int least = table                             ? int(tables_[bracket.table].at.size())
                      : bracket.op >= Op::atan2 && !any ? 2
                                                        : 1;
    if (count < least || (!any && count > least))
      refuse(fmt::format("too {} arguments for {} at character {}", count < least ? "few" : "many",
                         table ? tables_[bracket.table].name
                               : function_names[std::size_t(bracket.op) - std::size_t(Op::sin)],
                         at_ + 1));
    if (table)
      emit({Op::table, std::int32_t(bracket.table)}, 1 - count);
    else
      for (int k = any ? 1 : 0; k < (any ? count : 1); ++k) emit(bracket.op);
  }
  waiting_.pop_back();
  ++at_;
  value_next_ = false;
}

}  // namespace

Tape formula::compile(std::string_view text, const Names& names,
                      const std::vector<LookupTable>& tables) {
  if (text.size() > longest_formula)
    throw std::invalid_argument(
        fmt::format("{} characters long; expected at most {}", text.size(), longest_formula));
  if (assigns(text))
    throw std::invalid_argument("has a single =, which would assign; expected == to compare");
  return Compiler(text, names, tables).compile();
}

const std::vector<std::string>& formula_functions() {
  static const std::vector<std::string> all(function_names.begin(), function_names.end());
  return all;
}

void check_formula_name(std::string_view name) {
  const bool starts = !name.empty() && !is_digit(name.front());
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

void check_formula(std::string_view text, const std::vector<std::string>& names,
                   const std::vector<LookupTable>& tables) {
  Names known;
  for (const std::string& name : names) known.emplace(name, std::int32_t(known.size()));
  (void)formula::compile(text, known, tables);
}

}  // namespace tiltrim
