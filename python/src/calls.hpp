/// Verbs called from Python: who holds the GIL, how Ctrl-C ends them, what becomes of exceptions
/// that a model's callables raise.
#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <utility>

#include "runtime/rounding.hpp"

namespace tiltrim::python {

namespace py = pybind11;

/// What a verb keeps of the callables it calls, one for each verb that runs in a thread.
class Call {
 public:
  Call();
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// The innermost one of this thread; null where no verb is running.
  static Call* current();

  bool ended() const { return bool(raise_); }
  /// Ends the verb: this exception will be raised, and no callable is called any more.
  void end(py::object exception);
  /// The callable raised it; the verb decides what that means.
  void keep(py::object exception);
  /// Raises what ended the verb, if anything did.
  void raise_if_ended() const;
  /// Raises the last exception that was kept.
  [[noreturn]] void raise_last() const;

  /// A signal's handler raised it: its traceback leads into one that was set when the verb began.
  bool from_handler(const py::object& exception) const;

  py::object first() const { return first_ ? first_ : py::none(); }
  std::stop_token stop() const { return stop_.get_token(); }

 private:
  std::stop_source stop_;
  py::object raise_, first_, last_;
  py::set handlers_;  // code objects of signals' handlers
  Call* outer_;
};

/// A callable raised an exception: its words. The exception itself is the Call's.
struct CallableRaised : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The verb is to end. Nothing that catches std::exception is meant to see it.
struct VerbEnded {};

/// "ValueError: no row 7".
std::string in_words(const py::handle& exception);
/// The exception behind a pybind11 error, its traceback with it.
py::object exception_of(py::error_already_set& error);

/// The exception that a signal's handler raised since the last look; null if none.
py::object from_signals();

/// Does `work` where the callables are: in this thread, with the GIL. One such verb at a time; the
/// others wait, without the GIL. Raises what ended it.
void do_here(const std::function<void(Call&)>& work);
/// Does `work`, which needs no Python, in a thread of its own without the GIL, and looks for
/// signals meanwhile: a handler's exception stops the work, then is raised.
void do_beside(const std::function<void(const std::stop_token&)>& work);

/// Throws std::invalid_argument where a model's function is what calls: Ipopt is one at a time.
void refuse_within_callable(const char* verb, const char* expected);

/// How long built-in work may take: at once, where nobody would press Ctrl-C, or any time.
enum class Lasts { a_moment, any_time };

/// work(stop), here or beside, and the first exception that a callable raised (else None).
template <class Work>
auto run(bool callables, const Work& work, Lasts lasts = Lasts::any_time) {
  const RoundToNearest environment;  // which a thread beside takes over
  std::optional<decltype(work(std::stop_token{}))> result;
  py::object raised = py::none();
  if (callables) {
    do_here([&](Call& call) {
      result.emplace(work(call.stop()));
      raised = call.first();
    });
  } else if (lasts == Lasts::any_time) {
    do_beside([&](const std::stop_token& stop) { result.emplace(work(stop)); });
  } else {
    const py::gil_scoped_release released;
    result.emplace(work(std::stop_token{}));
  }
  return std::pair(std::move(*result), raised);
}

}  // namespace tiltrim::python
