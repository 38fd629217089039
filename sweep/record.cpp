#include "sweep/record.hpp"

#include <cstring>
#include <stdexcept>
#include <type_traits>

namespace tiltrim {

namespace {

// One description of each kind of line serves writing and reading.
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
    if (size > bytes.size() - at) throw std::runtime_error("a line of the sweep is cut off");
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
      if (size > bytes.size() - at) throw std::runtime_error("a line of the sweep is cut off");
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
  if (reader.at != bytes.size()) throw std::runtime_error("a line of the sweep is too long");
  return value;
}

}  // namespace

Bytes as_bytes(const LinePoints& line) { return written(line); }
Bytes as_bytes(const LineVerdicts& line) { return written(line); }
LinePoints points_from(const Bytes& bytes) { return read<LinePoints>(bytes); }
LineVerdicts verdicts_from(const Bytes& bytes) { return read<LineVerdicts>(bytes); }

}  // namespace tiltrim
