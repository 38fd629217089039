// Compiled formulas as a model with exact derivatives.
#include "model/formulas.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "model/formula.hpp"
#include "model/formula_check.hpp"
#include "model/formula_jets.hpp"
#include "model/formula_ranges.hpp"
#include "model/lookup.hpp"
#include "model/scalar.hpp"

namespace tiltrim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using formula::Evaluator;
using formula::Tape;

// The formulas of a model, compiled. Variables are numbered through x, u, p, then `let`.
struct Program {
  std::vector<double> nominal;  // of x, u, p
  std::vector<Tape> let, rows, switches;
  std::vector<LookupTable> tables;
  std::size_t depth = 0;

  std::size_t count() const { return nominal.size() + let.size(); }
};

template <class S>
void set_variables(Evaluator<S>& evaluate, const Program& program, const VectorXd& x,
                   const VectorXd& u, const VectorXd& p) {
  const std::size_t have = std::size_t(x.size() + u.size() + p.size());
  if (have != program.nominal.size())
    throw CallerMistake(fmt::format("expected {} states, inputs and parameters together, got {}",
                                    program.nominal.size(), have));
  std::size_t i = 0;
  for (const VectorXd* part : {&x, &u, &p})
    for (const double value : *part) evaluate[i++] = S(value);
}

// The value of a formula; NaN slopes where a kink, a jump or a singular slope leaves them in doubt.
template <class S>
S evaluated(Evaluator<S>& evaluate, const Tape& tape) {
  evaluate.doubtful = false;
  S all = evaluate(tape);
  if constexpr (requires { all.slopes; })
    if (evaluate.doubtful) all.slopes.setConstant(NAN);
  return all;
}

// The values of `let` follow from x, u and p.
template <class S>
void set_let(Evaluator<S>& evaluate, const Program& program) {
  for (std::size_t i = 0; i < program.let.size(); ++i)
    evaluate[program.nominal.size() + i] = evaluated(evaluate, program.let[i]);
}

// Values of `count` tapes from `first`.
VectorXd values(const Program& program, const Tape* first, std::size_t count, const VectorXd& x,
                const VectorXd& u, const VectorXd& p) {
  Evaluator<double> evaluate(program.count(), program.depth, program.tables);
  set_variables(evaluate, program, x, u, p);
  set_let(evaluate, program);
  VectorXd y(count);
  for (double& value : y) value = evaluate(*first++);
  return y;
}

// Columns `first` to `first` + width - 1 of the Jacobian.
template <int width>
void set_columns(const Program& program, const OperatingPoint& point,
                 const std::vector<Index>& variables, Index first, MatrixXd& J) {
  Evaluator<DualOf<double, width>> evaluate(program.count(), program.depth, program.tables);
  set_variables(evaluate, program, point.x, point.u, point.p);
  const Index count = std::min<Index>(width, J.cols() - first);
  for (Index k = 0; k < count; ++k)
    evaluate[std::size_t(variables[std::size_t(first + k)])].slopes[k] = 1;
  set_let(evaluate, program);
  for (Index i = 0; i < J.rows(); ++i)
    J.row(i).segment(first, count) =
        evaluated(evaluate, program.rows[std::size_t(i)]).slopes.head(count).matrix().transpose();
}

// NaN where a formula may have a kink, a jump or a singular slope along a variable: what is in
// doubt along some of several variables is asked for one by one.
MatrixXd slopes(const Program& program, const OperatingPoint& point,
                const std::vector<Index>& variables) {
  MatrixXd J(std::ssize(program.rows), std::ssize(variables));
  for (Index first = 0; first < J.cols(); first += dual_width) {
    set_columns<dual_width>(program, point, variables, first, J);
    const Index count = std::min<Index>(dual_width, J.cols() - first);
    if (J.middleCols(first, count).allFinite()) continue;
    for (Index k = first; k < first + count; ++k) set_columns<1>(program, point, variables, k, J);
  }
  return J;
}

// Formulas with what they are in messages.
struct TitledProgram {
  std::vector<formula::Titled> let, rows;
  std::vector<LookupTable> tables;
  std::size_t count, depth;

  TitledProgram(const Formulas& m, const Program& program)
      : tables(program.tables), count(program.nominal.size()), depth(program.depth) {
    for (std::size_t i = 0; i < m.let.size(); ++i)
      let.push_back({program.let[i], fmt::format("the value of '{}'", m.let[i].name)});
    for (std::size_t i = 0; i < m.states.size(); ++i)
      rows.push_back({program.rows[i], fmt::format("the rate of '{}'", m.states[i].name)});
    for (std::size_t i = 0; i < m.outputs.size(); ++i)
      rows.push_back(
          {program.rows[m.states.size() + i], fmt::format("the output '{}'", m.outputs[i].name)});
  }
};

decltype(Model::jets) on_jets(const Formulas& formulas, const Program& program) {
  return [all = std::make_shared<const TitledProgram>(formulas, program)](
             const std::vector<Jet>& x, const std::vector<Jet>& u, const std::vector<Jet>& p) {
    std::vector<Jet> variables;
    for (const std::vector<Jet>* part : {&x, &u, &p})
      variables.insert(variables.end(), part->begin(), part->end());
    if (variables.size() != all->count)
      throw CallerMistake(fmt::format("expected {} states, inputs and parameters together, got {}",
                                      all->count, variables.size()));
    return formula::on_ranges(all->let, all->rows, all->tables, all->depth, std::move(variables));
  };
}

std::vector<Range> ranges(const Program& program, const std::vector<Range>& box) {
  std::vector<Interval> variables;
  for (const Range& r : box) variables.emplace_back(r.lower, r.upper);
  for (const Tape& tape : program.let)
    variables.push_back(formula::range_of(tape, variables, program.tables));
  std::vector<Range> rows;
  for (const Tape& tape : program.rows) {
    const Interval row = formula::range_of(tape, variables, program.tables);
    rows.push_back({row.lower(), row.upper()});
  }
  return rows;
}

void check_count(std::size_t have, std::size_t want, const char* what) {
  if (have != want)
    throw std::invalid_argument(fmt::format("{} formulas for {} {}", have, want, what));
}

// Compiles the formulas of distinct, valid names, each with the names before it.
Program compile(const Formulas& m) {
  check_count(m.rates.size(), m.states.size(), "states");
  check_count(m.values.size(), m.outputs.size(), "outputs");
  formula::Names known;
  const auto learn = [&](const std::string& name) {
    check_formula_name(name);
    if (std::ranges::find(m.tables, name, &LookupTable::name) != m.tables.end() ||
        !known.emplace(name, std::int32_t(known.size())).second)
      throw std::invalid_argument(fmt::format("'{}' occurs twice", name));
  };
  Program program;
  program.tables = m.tables;
  for (const LookupTable& table : m.tables) {
    check_formula_name(table.name);
    if (std::ranges::count(m.tables, table.name, &LookupTable::name) > 1)
      throw std::invalid_argument(fmt::format("'{}' occurs twice", table.name));
    formula::check(table);
  }
  for (const Signals* signals : {&m.states, &m.inputs, &m.parameters})
    for (const Signal& s : *signals) {
      learn(s.name);
      program.nominal.push_back(s.nominal);
    }
  const auto add = [&](std::vector<Tape>& tapes, const std::string& text) {
    tapes.push_back(formula::compile(text, known, m.tables));
    program.depth = std::max(program.depth, tapes.back().depth);
  };
  for (const Formula& f : m.let) {
    add(program.let, f.text);
    learn(f.name);
  }
  for (const auto* texts : {&m.rates, &m.values})
    for (const std::string& text : *texts) add(program.rows, text);
  for (const Formula& f : m.switches) add(program.switches, f.text);
  return program;
}

}  // namespace

Model model_of(const Formulas& formulas) {
  const auto program = std::make_shared<const Program>(compile(formulas));
  const std::size_t nx = formulas.states.size(), ny = formulas.outputs.size();
  Model m;
  m.name = formulas.name;
  m.states = formulas.states;
  m.inputs = formulas.inputs;
  m.outputs = formulas.outputs;
  m.parameters = formulas.parameters;
  m.f = [program, nx](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return values(*program, program->rows.data(), nx, x, u, p);
  };
  if (ny > 0)
    m.h = [program, nx, ny](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
      return values(*program, program->rows.data() + nx, ny, x, u, p);
    };
  m.derivatives = [program](const OperatingPoint& at, const std::vector<Index>& variables) {
    return slopes(*program, at, variables);
  };
  m.enclosure = [program](const std::vector<Range>& box) { return ranges(*program, box); };
  m.jets = on_jets(formulas, *program);
  for (std::size_t i = 0; i < formulas.switches.size(); ++i)
    m.switches.push_back({formulas.switches[i].name, [program, i](const OperatingPoint& at) {
                            return values(*program, &program->switches[i], 1, at.x, at.u, at.p)[0];
                          }});
  check(m);
  return m;
}

}  // namespace tiltrim
