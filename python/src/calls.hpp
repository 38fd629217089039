/// Verbs called from Python: holding the GIL, ending on Ctrl-C, and exceptions raised by a model's
/// callables.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <utility>

#include "runtime/rounding.hpp"

namespace tiltrim::python {

namespace py = pybind11;

/// State of a verb that calls callables; one for each verb running in a thread.
class Call {
 public:
  Call();
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// The innermost call of this thread; null if no verb is running.
  static Call* current();

  bool ended() const { return bool(raise_); }
  /// Ends the verb: this exception will be raised, and no further callable is called.
  void end(py::object exception);
  /// Asks the verb to stop; it returns what it has.
  void request_stop() { stop_.request_stop(); }
  /// Keeps an exception raised by a callable; the verb decides how to react.
  void keep(py::object exception);
  /// Raises the exception that ended the verb, if any.
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
  py::list handlers_;  // of signals, when the verb began
  Call* outer_;
};

/// A callable raised an exception: its text. The Call keeps the exception itself.
struct CallableRaised : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Ends the verb. Not a std::exception, so that nothing in the library catches it.
struct VerbEnded {};

/// "ValueError: no row 7".
std::string in_words(const py::handle& exception);
/// The exception of a pybind11 error, with its traceback.
py::object exception_of(py::error_already_set& error);

/// The exception that a signal's handler raised since the last look; null if none.
py::object from_signals();

/// Passes a verb's progress to a callable of Python, progress(done, total, text), in the thread
/// that called the verb and at most every 50 ms. An exception from it ends the verb; if it returns
/// False, the verb stops and returns what it has.
class Progress {
 public:
  /// None: nobody listens.
  explicit Progress(py::object callable) : callable_(std::move(callable)) {}
  explicit operator bool() const { return !callable_.is_none(); }
  /// The newest state of the work, from any thread.
  void tell(std::size_t done, std::size_t total, std::string text);
  /// With the GIL: calls the callable if there is news. Calls stop() if it returned False; returns
  /// the exception that it raised, else null.
  py::object pass_on(const std::function<void()>& stop);
  /// An exception ends built-in work: what it has is not wanted any more.
  void abandon() { abandoned_.request_stop(); }
  std::stop_token abandoned() const { return abandoned_.get_token(); }

 private:
  struct News {
    std::size_t done, total;
    std::string text;
  };
  py::object callable_;
  std::mutex mutex_;  // of news_
  std::optional<News> news_;
  std::chrono::steady_clock::time_point last_{};
  std::stop_source abandoned_;
};

/// Does `work` where the callables are: in this thread, with the GIL. One such verb at a time; the
/// others wait, without the GIL. Raises what ended it.
void do_here(const std::function<void(Call&)>& work, Progress* progress = nullptr);
/// Runs `work`, which needs no Python, in another thread without the GIL, and checks for signals
/// meanwhile: an exception from a handler stops the work and is raised.
void do_beside(const std::function<void(const std::stop_token&)>& work,
               Progress* progress = nullptr);

/// Throws std::invalid_argument if called from a model's function: Ipopt is not reentrant.
void refuse_within_callable(const char* verb, const char* expected);
/// Expected by verbs that call Ipopt.
inline constexpr const char* no_ipopt = "trim with method='newton' and closest=False";

/// Duration of built-in work: too short for Ctrl-C, or unlimited.
enum class Lasts { a_moment, any_time };

/// Runs work(stop), here or in another thread; returns the first exception that a callable raised
/// (else None).
template <class Work>
auto run(bool callables, const Work& work, Lasts lasts = Lasts::any_time,
         Progress* progress = nullptr) {
  const RoundToNearest environment;  // inherited by the other thread
  std::optional<decltype(work(std::stop_token{}))> result;
  py::object raised = py::none();
  if (callables) {
    do_here(
        [&](Call& call) {
          result.emplace(work(call.stop()));
          raised = call.first();
        },
        progress);
  } else if (lasts == Lasts::any_time) {
    do_beside([&](const std::stop_token& stop) { result.emplace(work(stop)); }, progress);
  } else {
    const py::gil_scoped_release released;
    result.emplace(work(std::stop_token{}));
  }
  return std::pair(std::move(*result), raised);
}

}  // namespace tiltrim::python
