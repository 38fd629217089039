// Formulas: compiled or refused in words; a compiled one is evaluated and differentiated.
#include <stdexcept>

#include "model/formula_check.hpp"
#include "model/formulas.hpp"
#include "tests/fuzz/input.hpp"

using namespace tiltrim;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::size_t half = text.find('\n');  // the second line is an output's
  Formulas formulas;
  formulas.name = "fuzzed";
  formulas.states = {{"x", "", 1}, {"y", "", 1}};
  formulas.inputs = {{"u", "", 1}};
  formulas.parameters = {{"p", "", 1}};
  formulas.tables = {{"T", {{0, 1, 3}}, {1, -2, 5}},
                     {"U", {{-1, 0, 1}, {0, 2}}, {1, 2, 3, 4, 5, 6}, true}};
  formulas.rates = {text.substr(0, half), "-y"};
  if (half != text.npos) {
    formulas.outputs = {{"z", "", 1}};
    formulas.values = {text.substr(half + 1)};
  }
  try {
    check_formula(formulas.rates[0], {"x", "y", "u", "p"}, formulas.tables);
  } catch (const std::invalid_argument&) {
  }
  try {
    const Model model = model_of(formulas);
    const Eigen::VectorXd x = Eigen::VectorXd::Constant(2, 0.5), one = Eigen::VectorXd::Ones(1);
    (void)evaluate(model, {x, one, one});
    (void)model.enclosure({{0, 1}, {-1, 1}, {1, 1}, {0.5, 2}});
    (void)model.derivatives({x, one, one}, {0, 1, 2, 3});
  } catch (const std::invalid_argument&) {
  } catch (const std::domain_error&) {  // beyond a table
  }
  return 0;
}
