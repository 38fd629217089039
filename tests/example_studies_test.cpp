// A, B, C and D of every example study with [model], in studies/, bench/ and the documents, at its
// trims: against differences of eighth order of the same formulas in long double.
#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include "linearize/linearize.hpp"
#include "model/formula.hpp"
#include "study/problems.hpp"
#include "study/study.hpp"
#include "study/toml_reader.hpp"
#include "study/user_model.hpp"
#include "tests/check.hpp"
#include "tests/files.hpp"

using namespace tiltrim;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using reading::Entry;
namespace fs = std::filesystem;

namespace example_studies_test {

namespace {

using LongVector = std::vector<long double>;

const Entry* entry(const Entry& table, const std::string& key) {
  for (const Entry& e : table.entries)
    if (e.key == key) return &e;
  return nullptr;
}

void flatten(const Entry& list, std::vector<double>& numbers) {
  if (list.kind == Entry::Kind::number) numbers.push_back(list.number);
  for (const Entry& e : list.entries) flatten(e, numbers);
}

// The formulas of [model], compiled a second time.
struct Compiled {
  formula::Names names;
  std::vector<LookupTable> tables;
  std::vector<formula::Tape> lets, rows;  // rows: rates, then outputs
  std::size_t variables = 0, depth = 0;

  explicit Compiled(const Entry& model, const Model& own) {
    for (const Signals* signals : {&own.states, &own.inputs, &own.parameters})
      for (const Signal& s : *signals) names[s.name] = std::int32_t(variables++);
    if (const Entry* list = entry(model, "table"))
      for (const Entry& e : list->entries) {
        const Entry *at = entry(e, "at"), *kind = entry(e, "interpolation");
        LookupTable& table = tables.emplace_back(LookupTable{entry(e, "name")->text, {}, {}});
        table.smooth = kind && kind->text == "cubic";
        flatten(*entry(e, "values"), table.values);
        const bool nested = at->entries[0].kind == Entry::Kind::array;
        for (const Entry& part : nested ? at->entries : std::vector<Entry>{*at})
          flatten(part, table.at.emplace_back());
      }
    std::size_t slot = variables;
    each(model, "let", "value", lets,
         [&](const std::string& name) { names[name] = std::int32_t(slot++); });
    each(model, "state", "rate", rows, [](const std::string&) {});
    each(model, "output", "value", rows, [](const std::string&) {});
  }

  void each(const Entry& model, const char* list, const char* key,
            std::vector<formula::Tape>& tapes, const auto& after) {
    const Entry* all = entry(model, list);
    if (!all) return;
    for (const Entry& e : all->entries) {
      tapes.push_back(formula::compile(entry(e, key)->text, names, tables));
      depth = std::max(depth, tapes.back().depth);
      after(entry(e, "name")->text);
    }
  }

  LongVector operator()(const LongVector& at) const {
    formula::Evaluator<long double> evaluate(variables + lets.size(), depth, tables);
    for (std::size_t i = 0; i < at.size(); ++i) evaluate[i] = at[i];
    for (std::size_t i = 0; i < lets.size(); ++i) evaluate[variables + i] = evaluate(lets[i]);
    LongVector values;
    for (const formula::Tape& row : rows) values.push_back(evaluate(row));
    return values;
  }

  // ∂[f; h]/∂(x, u), eighth order.
  MatrixXd jacobian(const LongVector& at, Index columns) const {
    constexpr long double weights[] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    MatrixXd J(std::ssize(rows), columns);
    for (Index j = 0; j < columns; ++j) {
      const long double h = 1e-3L * std::max(std::abs(at[std::size_t(j)]), 1e-2L);
      LongVector sum(rows.size(), 0);
      for (int k = 1; k <= 4; ++k) {
        LongVector ahead = at, behind = at;
        ahead[std::size_t(j)] += k * h;
        behind[std::size_t(j)] -= k * h;
        const LongVector a = (*this)(ahead), b = (*this)(behind);
        for (std::size_t i = 0; i < rows.size(); ++i) sum[i] += weights[k - 1] * (a[i] - b[i]);
      }
      for (std::size_t i = 0; i < rows.size(); ++i) J(Index(i), j) = double(sum[i] / h);
    }
    return J;
  }
};

void within(const MatrixXd& value, const MatrixXd& error, const MatrixXd& truth, double size) {
  if (value.size() == 0) return;
  const double rounding = 1e-13 * size;  // of the differences
  CHECK(((value - truth).cwiseAbs() - error).maxCoeff() <= rounding);
  CHECK(error.maxCoeff() <= 1e-12 * size);
}

// The number of linear models compared.
int compare(const std::string& text, const std::string& name) {
  CAPTURE(name);
  const Study study = parse_study(text, fs::path(TILTRIM_SOURCE_DIR) / "studies/study.toml");
  const Entry file = reading::parse_toml(text, "study.toml");
  const Model& model = study.user_model->model;
  const Compiled compiled(*entry(file, "model"), model);
  int compared = 0;
  for (const Condition& condition : study.conditions) {
    CAPTURE(condition.name);
    const Answer answered = answer(study.vehicle, condition);
    if (!answered.has_equilibrium()) continue;
    const OperatingPoint& at = answered.trim.point;
    const LinearModel linear = linearize(model, at);
    if (linear.status != LinearizeStatus::linear || !linear.remarks.empty()) continue;
    CHECK(linear.method == Method::exact);
    LongVector all;
    for (const VectorXd* part : {&at.x, &at.u, &at.p})
      all.insert(all.end(), part->begin(), part->end());
    const Index n = at.x.size(), m = at.u.size(), p = std::ssize(model.outputs);
    const MatrixXd J = compiled.jacobian(all, n + m);
    const double size = J.cwiseAbs().maxCoeff();
    within(linear.A, linear.A_error, J.topLeftCorner(n, n), size);
    within(linear.B, linear.B_error, J.topRightCorner(n, m), size);
    within(linear.C, linear.C_error, J.bottomLeftCorner(p, n), size);
    within(linear.D, linear.D_error, J.bottomRightCorner(p, m), size);
    ++compared;
  }
  return compared;
}

bool of_a_model(const std::string& text) {
  return text.find("[[condition]]") != text.npos &&
         (text.starts_with("[model]") || text.find("\n[model]") != text.npos);
}

// Studies among a document's blocks of TOML.
std::vector<std::string> studies_in(const std::string& document) {
  const std::string fence = "```toml\n";
  std::vector<std::string> all;
  for (std::size_t at = document.find(fence); at != document.npos; at = document.find(fence, at)) {
    at += fence.size();
    all.push_back(document.substr(at, document.find("```", at) - at));
  }
  return all;
}

}  // namespace

TEST_CASE("A, B, C, D of every example study are exact to rounding") {
  const fs::path source = TILTRIM_SOURCE_DIR;
  int compared = 0;
  for (const char* folder : {"studies", "bench/tuning", "docs", "docs/tutorials"})
    for (const auto& file : fs::directory_iterator(source / folder)) {
      const std::string extension = file.path().extension(), name = file.path().filename();
      if (extension != ".toml" && extension != ".md") continue;
      const std::string text = contents(file.path());
      for (const std::string& study :
           extension == ".md" ? studies_in(text) : std::vector<std::string>{text})
        if (of_a_model(study)) compared += compare(study, name);
    }
  CHECK(compared >= 8);
}

}  // namespace example_studies_test
