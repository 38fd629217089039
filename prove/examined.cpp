// Answers as bytes, and back: the same bits.
#include "prove/examined.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <type_traits>

#include "runtime/log.hpp"

namespace tiltrim::proving {

namespace {

using Bytes = std::vector<std::byte>;

// What is passed on, in one order for both directions.
void pass(auto& on, auto& exclusion) requires requires { exclusion.weights; }
{
  on(exclusion.split);
  on(exclusion.at);
  on(exclusion.weights);
}
void pass(auto& on, auto& record) requires requires { record.absent; }
{
  on(record.z);
  on(record.Z);
  on(record.S);
  on(record.C);
  on(record.T);
  on(record.w);
  on(record.v);
  on(record.roots);
  on(record.ray_w);
  on(record.ray_v);
  on(record.outside);
  on(record.absent);
}
void pass(auto& on, auto& answer) requires requires { answer.verdict; }
{
  on(answer.verdict);
  on(answer.failure.cause);
  on(answer.failure.cut);
  on(answer.sides);
  on(answer.z);
  on(answer.S);
  on(answer.found);
}

template <class T>
concept Matrix = requires(T x) {
  x.rows();
};
template <class T>
concept List = !Matrix<T> && requires(T x) {
  x.size();
};

struct Writer {
  Bytes bytes{};

  template <class T>
  void operator()(const T& x) {
    if constexpr (Matrix<T>) {
      (*this)(std::uint64_t(x.rows()));
      (*this)(std::uint64_t(x.cols()));
      raw(x.data(), std::size_t(x.size()));
    } else if constexpr (List<T>) {
      (*this)(std::uint64_t(x.size()));
      for (const auto& one : x) (*this)(one);
    } else if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&x, 1);
    } else {
      pass(*this, x);
    }
  }
  template <class T>
  void raw(const T* from, std::size_t count) {
    const auto all = std::as_bytes(std::span(from, count));
    bytes.insert(bytes.end(), all.begin(), all.end());
  }
};

struct Reader {
  std::span<const std::byte> left;

  template <class T>
  void operator()(T& x) {
    if constexpr (Matrix<T>) {
      const std::size_t rows = size(), columns = size();
      x.resize(Eigen::Index(rows), Eigen::Index(columns));
      raw(x.data(), rows * columns);
    } else if constexpr (List<T>) {
      x.resize(size());
      for (auto& one : x) (*this)(one);
    } else if constexpr (std::is_trivially_copyable_v<T>) {
      raw(&x, 1);
    } else {
      pass(*this, x);
    }
  }
  std::size_t size() {
    std::uint64_t n = 0;
    (*this)(n);
    if (n > left.size()) throw LogError("the log of the proof has a record of another program");
    return std::size_t(n);
  }
  template <class T>
  void raw(T* to, std::size_t count) {
    if (count > left.size() / sizeof(T))
      throw LogError("the log of the proof has a record of another program");
    if (count > 0) std::memcpy(static_cast<void*>(to), left.data(), count * sizeof(T));
    left = left.subspan(count * sizeof(T));
  }
};

constexpr int bits_of_box = 40;

}  // namespace

Examined::Examined(const ProveOptions& options) : log_(options.log), part_(options.log_part) {
  if (!log_) return;
  for (const Log::Record& record : log_->recovered()) {
    if (record.tile != ((part_ << bits_of_box) | known_.size())) continue;
    for (Reader reader{record.bytes}; !reader.left.empty();) reader(known_.emplace_back());
  }
}

std::optional<Answer> Examined::take(std::size_t box) {
  if (box >= known_.size()) return {};
  return std::move(known_[box]);
}

void Examined::append(std::size_t first, std::span<const std::optional<Answer>> answers) {
  if (!log_) return;
  Writer writer;
  const std::size_t start = std::max(first, known_.size());
  for (std::size_t i = start - first; i < answers.size() && answers[i]; ++i) writer(*answers[i]);
  if (writer.bytes.empty()) return;
  log_->append((part_ << bits_of_box) | start, writer.bytes);
  log_->sync();
}

std::size_t Examined::at_once() const {
  constexpr std::size_t few = 256;  // a second or two of one processor
  return log_ ? few : std::numeric_limits<std::size_t>::max();
}

}  // namespace tiltrim::proving
