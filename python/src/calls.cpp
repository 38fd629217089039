#include "python/src/calls.hpp"

#include <chrono>
#include <future>
#include <mutex>
#include <thread>

namespace tiltrim::python {

using namespace std::chrono_literals;

namespace {

thread_local Call* innermost = nullptr;

constexpr auto between_looks = 50ms;  // between checks for signals

[[noreturn]] void raise(const py::object& exception) {
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(exception.ptr())), exception.ptr());
  throw py::error_already_set();
}

// The code that runs where a handler is called: of a function, a method, a partial or an object
// with __call__; none of what is built in.
py::object code_of(py::object handler) {
  while (py::hasattr(handler, "func")) handler = handler.attr("func");
  if (!py::hasattr(handler, "__code__")) {
    const py::object type = py::type::of(handler);
    if (!py::hasattr(type, "__call__")) return py::none();
    handler = type.attr("__call__");
  }
  return py::getattr(handler, "__code__", py::none());
}

// The handlers that are set, as they are: most verbs need no more. _signal's functions, as those of
// signal make an enum of each answer, which costs more than a small trim.
py::list handlers() {
  static const py::handle getsignal =
      py::object(py::module_::import("_signal").attr("getsignal")).release();
  static const py::handle numbers =
      py::list(py::module_::import("_signal").attr("valid_signals")()).release();
  py::list set;
  for (const py::handle number : numbers) {
    const auto handler =
        py::reinterpret_steal<py::object>(PyObject_CallOneArg(getsignal.ptr(), number.ptr()));
    if (!handler) throw py::error_already_set();
    if (PyCallable_Check(handler.ptr())) set.append(handler);  // else SIG_DFL, SIG_IGN, None
  }
  return set;
}

// Two verbs with callables must not run at once: one would wait for Ipopt's lock while holding the
// GIL, the other for the GIL while holding the lock.
std::timed_mutex one_at_a_time;

std::unique_lock<std::timed_mutex> my_turn() {
  std::unique_lock lock(one_at_a_time, std::defer_lock);
  if (Call::current()) return lock;  // within a callable: this thread has the lock
  while (!lock.try_lock()) {
    {
      py::gil_scoped_release released;
      if (lock.try_lock_for(between_looks)) return lock;
    }
    if (const py::object raised = from_signals()) raise(raised);
  }
  return lock;
}

}  // namespace

Call::Call() : handlers_(handlers()), outer_(std::exchange(innermost, this)) {}

Call::~Call() { innermost = outer_; }

Call* Call::current() { return innermost; }

void Call::end(py::object exception) {
  if (!raise_) raise_ = std::move(exception);
  stop_.request_stop();
}

void Call::keep(py::object exception) {
  if (!first_) first_ = exception;
  last_ = std::move(exception);
}

bool Call::from_handler(const py::object& exception) const {
  // Raised once more, an exception keeps the traceback that it had: the newest frames come first.
  if (last_ && exception.is(last_)) return false;
  py::set codes;
  for (const py::handle handler : handlers_)
    if (const py::object code = code_of(py::reinterpret_borrow<py::object>(handler));
        !code.is_none())
      codes.add(code);
  constexpr int deepest = 1000;  // Python's own limit of calls within calls
  py::object at = exception.attr("__traceback__");
  for (int i = 0; i < deepest && !at.is_none(); ++i, at = at.attr("tb_next"))
    if (codes.contains(at.attr("tb_frame").attr("f_code"))) return true;
  return false;
}

void Call::raise_if_ended() const {
  if (raise_) raise(raise_);
}

void Call::raise_last() const { raise(last_); }

std::string in_words(const py::handle& exception) {
  const std::string type = Py_TYPE(exception.ptr())->tp_name;
  try {
    const std::string words = py::str(exception);
    return words.empty() ? type : type + ": " + words;
  } catch (py::error_already_set&) {  // an exception whose str() raises
    return type;
  }
}

py::object exception_of(py::error_already_set& error) {
  py::object exception = error.value();
  if (error.trace()) PyException_SetTraceback(exception.ptr(), error.trace().ptr());
  return exception;
}

py::object from_signals() {
  if (PyErr_CheckSignals() == 0) return {};
  py::error_already_set error;
  return exception_of(error);
}

void Progress::tell(std::size_t done, std::size_t total, std::string text) {
  {
    const std::scoped_lock lock(mutex_);
    news_ = News{done, total, std::move(text)};
  }
  Call* const call =
      Call::current();  // null in a thread of built-in work, where do_beside() passes on
  if (!call || call->ended() || std::chrono::steady_clock::now() - last_ < between_looks) return;
  if (py::object raised = pass_on([call] { call->request_stop(); })) call->end(std::move(raised));
}

py::object Progress::pass_on(const std::function<void()>& stop) {
  std::optional<News> news;
  {
    const std::scoped_lock lock(mutex_);
    news.swap(news_);
  }
  if (!news) return {};
  last_ = std::chrono::steady_clock::now();
  try {
    if (callable_(news->done, news->total, news->text).is(py::bool_(false))) stop();
    return {};
  } catch (py::error_already_set& error) {
    return exception_of(error);
  }
}

void do_here(const std::function<void(Call&)>& work, Progress* progress) {
  const auto lock = my_turn();
  Call call;
  try {
    work(call);
    if (progress && !call.ended())
      if (py::object raised = progress->pass_on([] {})) call.end(std::move(raised));
  } catch (const VerbEnded&) {
  } catch (const CallableRaised&) {
    call.raise_if_ended();
    call.raise_last();
  } catch (...) {
    call.raise_if_ended();
    throw;
  }
  call.raise_if_ended();
}

void do_beside(const std::function<void(const std::stop_token&)>& work, Progress* progress) {
  std::stop_source stop;
  std::packaged_task<void()> task([&] { work(stop.get_token()); });
  std::future<void> done = task.get_future();
  py::object raised;
  {
    py::gil_scoped_release released;
    std::jthread worker(std::move(task));
    while (done.wait_for(between_looks) != std::future_status::ready) {
      py::gil_scoped_acquire held;
      if (!raised) raised = from_signals();
      if (!raised && progress) raised = progress->pass_on([&] { stop.request_stop(); });
      if (raised) stop.request_stop();
      if (raised && progress) progress->abandon();
    }
  }
  if (!raised && progress) raised = progress->pass_on([] {});
  if (raised) raise(raised);
  done.get();
}

void refuse_within_callable(const char* verb, const char* expected) {
  if (Call::current())
    throw std::invalid_argument(std::string(verb) +
                                " inside a model's function that a verb is calling; expected " +
                                expected);
}

}  // namespace tiltrim::python
