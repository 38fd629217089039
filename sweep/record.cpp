#include "sweep/record.hpp"

#include <array>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "sweep/verdict_runs.hpp"

namespace tiltrim {

namespace {

// One description of each record serves both writing and reading.
void visit(LinePoints& p, auto&& field) {
  field(p.status), field(p.verdict), field(p.second_branch), field(p.reason), field(p.reasons);
  field(p.residual), field(p.spectral_abscissa), field(p.damping), field(p.state), field(p.input);
  field(p.eigenvalue_re), field(p.eigenvalue_im), field(p.confidence), field(p.second);
  field(p.second_state), field(p.second_input), field(p.second_re), field(p.second_im);
  field(p.second_verdict);
}

void visit(AxisCrossing& c, auto&& field) {
  field(c.condition), field(c.axis), field(c.at), field(c.error), field(c.kind);
  field(c.unstable_before), field(c.unstable_after), field(c.frequency), field(c.mode);
  field(c.mode_name);
}

void visit(AxisInterval& i, auto&& field) {
  field(i.condition), field(i.axis), field(i.at), field(i.from), field(i.to), field(i.verdict);
  field(i.unstable), field(i.abscissa), field(i.abscissa_at);
}

void visit(LineVerdicts& v, auto&& field) { field(v.crossings), field(v.intervals); }

void visit(VerdictLines& v, auto&& field) { field(v.runs), field(v.located), field(v.borders); }

struct Writer {
  Bytes bytes;

  void raw(const void* from, std::size_t size) {
    const auto* first = static_cast<const std::byte*>(from);
    bytes.insert(bytes.end(), first, first + size);
  }
  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      raw(&value, sizeof value);
    } else if constexpr (requires {
                           value.data();
                           value.push_back({});
                         }) {
      const std::uint64_t size = value.size();
      raw(&size, sizeof size);
      using Element = typename T::value_type;
      if constexpr (std::is_arithmetic_v<Element>)
        raw(value.data(), value.size() * sizeof(Element));
      else
        for (Element& e : value) (*this)(e);
    } else {
      visit(value, *this);
    }
  }
};

struct Reader {
  const Bytes& bytes;
  std::size_t at = 0;

  void raw(void* to, std::size_t size) {
    if (size > bytes.size() - at) throw std::runtime_error("is damaged: a line is truncated");
    if (size > 0) std::memcpy(to, bytes.data() + at, size);
    at += size;
  }
  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      raw(&value, sizeof value);
    } else if constexpr (requires {
                           value.data();
                           value.push_back({});
                         }) {
      std::uint64_t size = 0;
      raw(&size, sizeof size);
      if (size > bytes.size() - at) throw std::runtime_error("is damaged: a line is truncated");
      value.resize(size);
      using Element = typename T::value_type;
      if constexpr (std::is_arithmetic_v<Element>)
        raw(value.data(), value.size() * sizeof(Element));
      else
        for (Element& e : value) (*this)(e);
    } else {
      visit(value, *this);
    }
  }
};

template <class T>
Bytes written(T value) {
  Writer writer;
  visit(value, writer);
  return std::move(writer.bytes);
}

template <class T>
T read(const Bytes& bytes) {
  T value;
  Reader reader{bytes};
  visit(value, reader);
  if (reader.at != bytes.size()) throw std::runtime_error("is damaged: a line is too long");
  return value;
}

void check_that(bool fits) {
  if (!fits) throw std::runtime_error("is damaged: a line does not match the sweep");
}

// Throws unless all numbers are in first, ..., last - 1.
void check_within(const auto& numbers, int first, std::size_t last) {
  for (const auto number : numbers)
    check_that(std::cmp_greater_equal(number, first) &&
               (std::cmp_less(number, 0) || std::cmp_less(number, last)));
}

void check(const LinePoints& line, const LineSizes& sizes) {
  const std::size_t points = sizes.points, second = line.second.size();
  for (const auto* list : {&line.status, &line.verdict, &line.second_branch})
    check_that(list->size() == points);
  for (const auto* list : {&line.residual, &line.spectral_abscissa, &line.damping})
    check_that(list->size() == points);
  for (const auto* list : {&line.state, &line.eigenvalue_re, &line.eigenvalue_im})
    check_that(list->size() == points * sizes.states);
  check_that(line.reason.size() == points && line.confidence.size() == points * sizes.states);
  check_that(line.input.size() == points * sizes.inputs);
  for (const auto* list : {&line.second_state, &line.second_re, &line.second_im})
    check_that(list->size() == second * sizes.states);
  check_that(line.second_input.size() == second * sizes.inputs);
  check_that(line.second_verdict.size() == second);
  check_within(line.status, -1, std::size_t(TrimStatus::interrupted) + 1);
  for (const auto* list : {&line.verdict, &line.second_verdict})
    check_within(*list, -1, std::size_t(Verdict::undecided) + 1);
  check_within(line.second_branch, 0, 2);
  check_within(line.reason, 0, line.reasons.size());
  check_within(line.second, 0, points);
}

// Checks that a crossing or an interval lies on a line along one of the axes.
void check_place(const auto& one, const LineSizes& sizes) {
  check_within(std::array{one.condition}, 0, sizes.conditions);
  check_within(std::array{one.axis}, 0, sizes.axes);
  check_that(one.at.size() == sizes.axes);
}

void check(const AxisCrossing& c, const LineSizes& sizes) {
  check_place(c, sizes);
  check_within(std::array{int(c.kind)}, 0, std::size_t(CrossingKind::end) + 1);
  check_within(std::array{c.mode}, -1, sizes.states);
}

void check(const VerdictLines& lines, const LineSizes& sizes) {
  std::size_t at = 0;
  for (std::size_t l = 0; l < lines.located.size(); ++l)
    each_run(lines.runs, at, sizes.points, [](std::int8_t, std::size_t) {});
  check_that(at == lines.runs.size());
  check_within(lines.located, 0, 2);
  for (const AxisCrossing& c : lines.borders) check(c, sizes);
}

void check(const LineVerdicts& line, const LineSizes& sizes) {
  for (const AxisCrossing& c : line.crossings) check(c, sizes);
  for (const AxisInterval& i : line.intervals) {
    check_place(i, sizes);
    check_within(std::array{int(i.verdict)}, 0, std::size_t(IntervalVerdict::undecided) + 1);
  }
}

template <class T>
T checked(const Bytes& bytes, const LineSizes& sizes) {
  const T line = read<T>(bytes);
  check(line, sizes);
  return line;
}

}  // namespace

Bytes as_bytes(const LinePoints& line) { return written(line); }
Bytes as_bytes(const LineVerdicts& line) { return written(line); }
Bytes as_bytes(const VerdictLines& lines) { return written(lines); }
LinePoints points_from(const Bytes& bytes, const LineSizes& sizes) {
  return checked<LinePoints>(bytes, sizes);
}
LineVerdicts verdicts_from(const Bytes& bytes, const LineSizes& sizes) {
  return checked<LineVerdicts>(bytes, sizes);
}

VerdictLines verdict_lines_from(const Bytes& bytes, const LineSizes& sizes) {
  return checked<VerdictLines>(bytes, sizes);
}

}  // namespace tiltrim
