#include "python/src/models.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "model/feedback.hpp"
#include "model/lookup.hpp"
#include "model/many.hpp"
#include "python/src/answers.hpp"
#include "python/src/calls.hpp"
#include "vehicles/mode_names.hpp"

namespace tiltrim::python {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// ---- Calling them -------------------------------------------------------------------------------

// What becomes of an exception depends on what it is: an Exception is the model's refusal at a
// point; anything else (KeyboardInterrupt, SystemExit), and what the handler of a signal raised
// while the model was at work, ends the verb.
[[noreturn]] void pass_on(Call& call, py::error_already_set& error) {
  const py::object exception = exception_of(error);
  const bool of_model = PyErr_GivenExceptionMatches(exception.ptr(), PyExc_Exception);
  if (!of_model || call.from_handler(exception)) {
    call.end(exception);
    throw VerbEnded{};
  }
  call.keep(exception);
  throw CallableRaised(in_words(exception));
}

[[noreturn]] void pass_on(Call& call, const WrongAnswer& wrong) {
  const py::object type = py::module_::import("tiltrim._tiltrim").attr("InvalidArgument");
  call.end(type(wrong.what()));
  throw VerbEnded{};
}

// Runs work(), translating Python exceptions to C++. The GIL is held.
template <class Work>
auto guarded(const Work& work) {
  Call* const call = Call::current();
  if (!call) return work();
  if (!call->ended())
    if (const py::object raised = from_signals()) call->end(raised);
  if (call->ended()) throw VerbEnded{};
  try {
    return work();
  } catch (py::error_already_set& error) {
    pass_on(*call, error);
  } catch (const WrongAnswer& wrong) {
    pass_on(*call, wrong);
  }
}

py::array_t<double> array_of(const VectorXd& v) { return py::array_t<double>(v.size(), v.data()); }

py::tuple arguments(const VectorXd& x, const VectorXd& u, const VectorXd& p) {
  return py::make_tuple(array_of(x), array_of(u), array_of(p));
}

// Nothing else has a reference to it, and it is as it was made, but for its values.
bool is_spare(const py::object& kept, Index size) {
  using Plain = py::array_t<double, py::array::c_style>;
  if (!kept || kept.ref_count() != 1 || !py::isinstance<Plain>(kept)) return false;
  const auto array = py::reinterpret_borrow<py::array>(kept);
  return array.ndim() == 1 && array.size() == size && array.writeable();
}

// Calls function(x, u, p). Arrays that the last call has not kept are used again: making one costs
// as much as a call.
VectorXd called(Held& held, const std::string& what, Index expected,
                const std::array<const VectorXd*, 3>& values) {
  return guarded([&] {
    auto arrays = std::exchange(held.spare, {});  // the function may call itself
    std::array<PyObject*, 4> arguments{};         // the first is the callee's to use
    for (std::size_t i = 0; i < values.size(); ++i) {
      const VectorXd& v = *values[i];
      if (is_spare(arrays[i], v.size()))
        std::ranges::copy(
            v, static_cast<double*>(py::reinterpret_borrow<py::array>(arrays[i]).mutable_data()));
      else
        arrays[i] = array_of(v);
      arguments[i + 1] = arrays[i].ptr();
    }
    const auto answer = py::reinterpret_steal<py::object>(
        PyObject_Vectorcall(held.function.ptr(), arguments.data() + 1,
                            values.size() | PY_VECTORCALL_ARGUMENTS_OFFSET, nullptr));
    if (!answer) throw py::error_already_set();
    VectorXd y = as_vector(answer, what, expected);
    held.spare = std::move(arrays);
    return y;
  });
}

decltype(Model::f) vector_function(const std::shared_ptr<Held>& held, const std::string& what,
                                   Index expected) {
  return [held, what, expected](const VectorXd& x, const VectorXd& u, const VectorXd& p) {
    return called(*held, what, expected, {&x, &u, &p});
  };
}

// The callable as named in the library's own error messages.
std::string answer_of(const Model& model, const char* function) {
  return model.name.empty() ? fmt::format("the model's {}", function)
                            : fmt::format("model '{}': its {}", model.name, function);
}

// ---- Many points at once ------------------------------------------------------------------------

// One function of a vectorized model. What it gives for several points is compared once with what
// it gives for each of them alone.
struct Vectorized {
  std::shared_ptr<Held> held;
  std::string what;
  Index rows;
  mutable std::shared_ptr<bool> compared = std::make_shared<bool>(false);

  MatrixXd call(const MatrixXd& x, const MatrixXd& u, const MatrixXd& p) const {
    return guarded([&] {
      return as_columns(held->function(columns_of(x), columns_of(u), columns_of(p)), what, rows,
                        x.cols());
    });
  }
  MatrixXd operator()(const MatrixXd& x, const MatrixXd& u, const MatrixXd& p) const {
    if (!*compared) compare(x.col(0), u.col(0), p.col(0));
    return call(x, u, p);
  }
  // At points that differ in every variable: a function that mixes its columns gives itself away.
  // Where the model throws at one of them, the next call compares.
  void compare(const VectorXd& x, const VectorXd& u, const VectorXd& p) const {
    constexpr double rounding = 1e-12;  // of a row's largest value: another order of a sum
    constexpr Index points = 3;
    const auto moved = [](const VectorXd& v) {
      constexpr double share = 1e-7;
      MatrixXd columns = v.replicate(1, points);
      for (Index i = 0; i < v.size(); ++i)
        for (Index k = 0; k < points; ++k)
          columns(i, k) += share * double((k + 1) * (k + 1) * (i + 1)) * (1 + std::abs(v[i]));
      return columns;
    };
    const MatrixXd xs = moved(x), us = moved(u), ps = moved(p), y = call(xs, us, ps);
    const VectorXd size = y.array().isFinite().select(y, 0.0).cwiseAbs().rowwise().maxCoeff();
    for (Index k = 0; k < points; ++k) {
      const MatrixXd alone = call(xs.col(k), us.col(k), ps.col(k));
      for (Index i = 0; i < rows; ++i) {
        const double together = y(i, k), single = alone(i, 0);
        if (together == single || (std::isnan(together) && std::isnan(single))) continue;
        if (!(std::abs(together - single) <= rounding * size[i])) mixes(i, together, single);
      }
    }
    *compared = true;
  }
  void mixes(Index row, double together, double single) const {
    guarded([&]() -> void {
      refuse(what,
             fmt::format("the same for a point among others and alone, {:.17g} in row {}", single,
                         row + 1),
             fmt::format("{:.17g}: vectorized=True needs a function that treats each column of x, "
                         "u and p on its own",
                         together));
    });
  }
};

decltype(Model::f) one_of(const Vectorized& function) {
  return [function](const VectorXd& x, const VectorXd& u, const VectorXd& p) -> VectorXd {
    return function.call(x, u, p).col(0);
  };
}

// f and h of a vectorized model.
void set_vectorized(Model& m, const std::optional<Vectorized>& f,
                    const std::optional<Vectorized>& h) {
  if (h) m.h = one_of(*h);
  if (!f) return;
  const auto values = [f, h](const MatrixXd& x, const MatrixXd& u, const MatrixXd& p) {
    MatrixXd y(f->rows + (h ? h->rows : 0), x.cols());
    y.topRows(f->rows) = (*f)(x, u, p);
    if (h) y.bottomRows(h->rows) = (*h)(x, u, p);
    return y;
  };
  m.f = FunctionOfMany{one_of(*f), std::make_shared<const Many>(Many{values})};
}

// Model::lanes from a callable of (values of all variables at the points, variables) that returns
// [f; h] and then its derivatives by each of the variables, a block of columns each.
void set_lanes(HeldModel& held, const py::object& function) {
  Model& m = held.model;
  const Index rows = std::ssize(m.states) + std::ssize(m.outputs);
  const Index n = std::ssize(m.states) + std::ssize(m.inputs) + std::ssize(m.parameters);
  held.own.push_back(std::make_shared<Held>(Held{function}));
  m.lanes = [own = held.own.back(), rows, n, what = answer_of(m, "lanes")](
                const double* z, const std::vector<Index>& variables, double* values,
                double* slopes) {
    constexpr auto L = Index(Model::model_lanes);
    const Index blocks = slopes ? std::ssize(variables) : 0;
    Rows all = Rows::Constant(rows, (1 + blocks) * L, NAN);
    try {
      all = guarded([&] {
        const std::vector<Index> along(variables.begin(), variables.begin() + blocks);
        const py::object answer = own->function(columns_of(Eigen::Map<const Rows>(z, n, L)), along);
        return as_matrix(answer, what, rows, (1 + blocks) * L);
      });
    } catch (const CallableRaised&) {  // NaN: each point is then tried alone
    }
    Eigen::Map<Rows>(values, rows, L) = all.leftCols(L);
    for (Index c = 0; c < blocks; ++c)
      Eigen::Map<Rows>(slopes + c * rows * L, rows, L) = all.middleCols((1 + c) * L, L);
  };
}

// ---- The model ----------------------------------------------------------------------------------

using SwitchTuple = std::tuple<std::string, py::function>;

std::shared_ptr<Held> hold(HeldModel& held, const py::object& function) {
  held.own.push_back(std::make_shared<Held>(Held{function}));
  return held.own.back();
}

void set_derivatives(HeldModel& held, const py::object& function) {
  Model& m = held.model;
  const Index rows = std::ssize(m.states) + std::ssize(m.outputs);
  const Index columns = std::ssize(m.states) + std::ssize(m.inputs) + std::ssize(m.parameters);
  m.derivatives = [own = hold(held, function), rows, columns, what = answer_of(m, "derivatives")](
                      const OperatingPoint& at, const std::vector<Index>& variables) {
    const MatrixXd all = guarded([&] {
      const py::object answer = own->function(*arguments(at.x, at.u, at.p));
      if (py::isinstance<py::str>(answer))  // why there are none by the complex step
        throw WrongAnswer(fmt::format("{}: {}", what, std::string(py::str(answer))));
      return as_matrix(answer, what, rows, columns);
    });
    return MatrixXd(all(Eigen::all, variables));
  };
}

void add_switch(HeldModel& held, const std::string& name, const py::function& distance) {
  const std::string what = answer_of(held.model, "switch");
  held.model.switches.push_back(
      {name, [own = hold(held, distance), what](const OperatingPoint& at) {
         return called(*own, what, 1, {&at.x, &at.u, &at.p})[0];
       }});
}

HeldModel make_model(const std::string& name, const py::object& f, const py::object& h,
                     const std::vector<SignalTuple>& states, const std::vector<SignalTuple>& inputs,
                     const std::vector<SignalTuple>& outputs,
                     const std::vector<SignalTuple>& parameters, const py::object& derivatives,
                     const std::vector<SwitchTuple>& switches, bool vectorized,
                     const py::object& lanes) {
  HeldModel held;
  held.callables = true;
  Model& m = held.model;
  m.name = name;
  m.mode_names = aircraft_modes();
  m.states = signals_of(states);
  m.inputs = signals_of(inputs);
  m.outputs = signals_of(outputs);
  m.parameters = signals_of(parameters);
  const Index nx = std::ssize(m.states), ny = std::ssize(m.outputs);
  const std::string of_f = answer_of(m, "rates f"), of_h = answer_of(m, "outputs h");
  if (f.is_none() && states.empty())
    m.f = [](const VectorXd&, const VectorXd&, const VectorXd&) { return VectorXd(); };
  if (vectorized) {
    const auto own = [&](const py::object& function, const std::string& what, Index rows) {
      return function.is_none() ? std::nullopt
                                : std::optional(Vectorized{hold(held, function), what, rows});
    };
    set_vectorized(m, own(f, of_f, nx), own(h, of_h, ny));
  } else {
    if (!f.is_none()) m.f = vector_function(hold(held, f), of_f, nx);
    if (!h.is_none()) m.h = vector_function(hold(held, h), of_h, ny);
  }
  if (!lanes.is_none()) set_lanes(held, lanes);
  if (!derivatives.is_none()) set_derivatives(held, derivatives);
  for (const auto& [what, distance] : switches) add_switch(held, what, distance);
  check(m);
  return held;
}

HeldModel closed(const py::object& plant, const py::object& controller) {
  const auto& first = plant.cast<const HeldModel&>();
  const auto& second = controller.cast<const HeldModel&>();
  const bool callables = first.callables || second.callables;
  const auto joined = [&](const std::stop_token&) { return feedback(first.model, second.model); };
  Model loop = run(callables, joined, Lasts::a_moment).first;
  return {std::move(loop), {}, {plant, controller}, callables};
}

py::tuple evaluated(const HeldModel& held, const PointTuple& point) {
  const auto work = [&](const std::stop_token&) { return evaluate(held.model, point_of(point)); };
  const auto e = run(held.callables, work, Lasts::a_moment).first;
  return py::make_tuple(e.rates, e.outputs);
}

// ---- Garbage collection: a method bound to the model's owner is a cycle ------------------------

HeldModel* behind(PyObject* self) {
  auto* const instance = reinterpret_cast<py::detail::instance*>(self);
  return static_cast<HeldModel*>(instance->get_value_and_holder().value_ptr());
}

int traverse(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (const HeldModel* held = behind(self)) {
    for (const auto& own : held->own) Py_VISIT(own->function.ptr());
    for (const py::object& part : held->parts) Py_VISIT(part.ptr());
  }
  return 0;
}

int clear(PyObject* self) {
  HeldModel* held = behind(self);
  if (!held) return 0;
  for (const auto& own : held->own) own->function = py::none();
  held->parts.clear();
  return 0;
}

void deallocate(PyObject* self) {
  PyObject_GC_UnTrack(self);  // pybind11 2.10 does not
  py::detail::pybind11_object_dealloc(self);
}

void collectable(PyHeapTypeObject* heap) {
  heap->ht_type.tp_flags |= Py_TPFLAGS_HAVE_GC;
  heap->ht_type.tp_dealloc = deallocate;
  heap->ht_type.tp_traverse = traverse;
  heap->ht_type.tp_clear = clear;
}

}  // namespace

VectorXd call_for_vector(const Held& held, const std::string& what, Index expected,
                         const py::tuple& arguments) {
  return guarded([&] { return as_vector(held.function(*arguments), what, expected); });
}

void add_model(py::module_& module) {
  using py::arg;
  py::class_<HeldModel>(module, "Model", py::custom_type_setup(collectable))
      .def(py::init(&make_model), arg("name"), arg("f"), arg("h"), arg("states"), arg("inputs"),
           arg("outputs"), arg("parameters"), arg("derivatives"), arg("switches"),
           arg("vectorized") = false, arg("lanes") = py::none())
      .def_property_readonly("name", [](const HeldModel& m) { return m.model.name; })
      .def_property_readonly("states", [](const HeldModel& m) { return tuples_of(m.model.states); })
      .def_property_readonly("inputs", [](const HeldModel& m) { return tuples_of(m.model.inputs); })
      .def_property_readonly("outputs",
                             [](const HeldModel& m) { return tuples_of(m.model.outputs); })
      .def_property_readonly("parameters",
                             [](const HeldModel& m) { return tuples_of(m.model.parameters); })
      .def_property_readonly("callables", [](const HeldModel& m) { return m.callables; })
      .def_property_readonly("exact", [](const HeldModel& m) { return bool(m.model.derivatives); });
  module.def("feedback", &closed, arg("plant"), arg("controller"));
  module.def(
      "variable",
      [](const HeldModel& m, const std::string& name) { return variable(m.model, name); },
      arg("model"), arg("name"));
  module.def("evaluate", &evaluated, arg("model"), arg("point"));
}

}  // namespace tiltrim::python
