// Reads one real matrix from a MATLAB Level 5 MAT-file. matio is not used: it reads a truncated
// file as if it were complete.
// "MAT-File Format", The MathWorks: header of 128 bytes, then elements: type, size, data.
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>

#include "cli/matrix_file.hpp"

namespace tiltrim::cli {

using Eigen::Index;

namespace {

// Types of data, classes of arrays, flags.
enum : std::uint32_t {
  of_int8 = 1,
  of_uint8,
  of_int16,
  of_uint16,
  of_int32,
  of_uint32,
  of_single,
  of_double = 9,
  of_int64 = 12,
  of_uint64,
  of_matrix,
  compressed
};
enum : std::uint32_t { a_cell = 1, a_struct, an_object, a_text, a_sparse, a_double, a_uint64 = 15 };
constexpr std::uint32_t is_complex = 0x0800;

struct Element {
  std::uint32_t type = 0;
  std::string_view data;
};

template <class Number>
Number value_at(std::string_view data, std::size_t i, bool swapped) {
  char bytes[sizeof(Number)];
  std::memcpy(bytes, data.data() + i * sizeof(Number), sizeof(Number));
  if (swapped) std::reverse(bytes, bytes + sizeof(Number));
  return std::bit_cast<Number>(bytes);
}

// Removes the first element from the bytes; empty if it is incomplete.
std::optional<Element> take(std::string_view& bytes, bool swapped) {
  if (bytes.size() < 8) return {};
  const auto type = value_at<std::uint32_t>(bytes, 0, swapped);
  if (const std::uint32_t size = type >> 16; size != 0) {  // up to four bytes inside the tag
    if (size > 4) return {};
    const Element small{type & 0xFFFF, bytes.substr(4, size)};
    bytes.remove_prefix(8);
    return small;
  }
  const std::size_t size = value_at<std::uint32_t>(bytes, 1, swapped);
  if (size > bytes.size() - 8) return {};
  const Element element{type, bytes.substr(8, size)};
  const std::size_t padded = type == compressed ? size : (size + 7) / 8 * 8;
  bytes.remove_prefix(std::min(bytes.size(), 8 + padded));
  return element;
}

struct Inflated {
  std::string bytes;
  bool whole = false;  // complete, with a valid checksum
};

// The first `most` bytes of the decompressed data.
Inflated inflated(std::string_view data, std::size_t most) {
  Inflated result;
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return result;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data.data()));
  stream.avail_in = uInt(data.size());
  int status = Z_OK;
  while (status == Z_OK && result.bytes.size() < most) {
    char piece[1 << 14];
    stream.next_out = reinterpret_cast<Bytef*>(piece);
    stream.avail_out = sizeof piece;
    status = ::inflate(&stream, Z_NO_FLUSH);
    result.bytes.append(piece, sizeof piece - stream.avail_out);
  }
  result.whole = status == Z_STREAM_END;
  inflateEnd(&stream);
  return result;
}

// An array's header; `rest` holds its numbers.
struct Head {
  std::uint32_t flags = 0;
  std::vector<std::size_t> size;
  std::string name;
  std::string_view rest;
};

std::optional<Head> head_of(std::string_view bytes, bool swapped) {
  Head head;
  const auto flags = take(bytes, swapped), size = flags ? take(bytes, swapped) : flags,
             name = size ? take(bytes, swapped) : size;
  if (!name || flags->type != of_uint32 || flags->data.size() != 8 || size->type != of_int32 ||
      name->type != of_int8)
    return {};
  head.flags = value_at<std::uint32_t>(flags->data, 0, swapped);
  for (std::size_t i = 0; i < size->data.size() / 4; ++i) {
    const auto length = value_at<std::int32_t>(size->data, i, swapped);
    if (length < 0) return {};
    head.size.push_back(std::size_t(length));
  }
  head.name = name->data.substr(0, name->data.find('\0'));
  head.rest = bytes;
  return head;
}

template <class Number>
bool convert(std::string_view data, bool swapped, Eigen::MatrixXd& A) {
  if (data.size() != std::size_t(A.size()) * sizeof(Number)) return false;
  for (Index i = 0; i < A.size(); ++i)  // column-major, as in Eigen
    A.data()[i] = double(value_at<Number>(data, std::size_t(i), swapped));
  return true;
}

bool convert(const Element& numbers, bool swapped, Eigen::MatrixXd& A) {
  switch (numbers.type) {
    case of_int8:
      return convert<std::int8_t>(numbers.data, swapped, A);
    case of_uint8:
      return convert<std::uint8_t>(numbers.data, swapped, A);
    case of_int16:
      return convert<std::int16_t>(numbers.data, swapped, A);
    case of_uint16:
      return convert<std::uint16_t>(numbers.data, swapped, A);
    case of_int32:
      return convert<std::int32_t>(numbers.data, swapped, A);
    case of_uint32:
      return convert<std::uint32_t>(numbers.data, swapped, A);
    case of_int64:
      return convert<std::int64_t>(numbers.data, swapped, A);
    case of_uint64:
      return convert<std::uint64_t>(numbers.data, swapped, A);
    case of_single:
      return convert<float>(numbers.data, swapped, A);
    case of_double:
      return convert<double>(numbers.data, swapped, A);
    default:
      return false;
  }
}

Eigen::MatrixXd matrix_of(const std::string& where, Head head, bool swapped) {
  const char* const full = "a full matrix of real numbers";
  const std::uint32_t kind = head.flags & 0xFF;
  if (kind == a_sparse) refuse(where, "is sparse", std::string(full) + ", as full(A)");
  if (kind < a_double || kind > a_uint64)
    refuse(where,
           kind == a_struct ? "is a struct"
           : kind == a_cell ? "is a cell array"
           : kind == a_text ? "is text"
                            : "has no numbers",
           full);
  if ((head.flags & is_complex) != 0) refuse(where, "is complex", full);
  if (head.size.size() != 2)
    refuse(where, fmt::format("has {} dimensions", head.size.size()), "two");
  check_size(where, head.size[0], head.size[1]);
  Eigen::MatrixXd A(Index(head.size[0]), Index(head.size[1]));
  const auto numbers = take(head.rest, swapped);
  if (!numbers || !convert(*numbers, swapped, A))
    refuse(where, "its numbers are truncated or damaged", fmt::format("{} of them", A.size()));
  return A;
}

}  // namespace

Eigen::MatrixXd read_mat(const std::string& file, std::string_view bytes,
                         const std::string& variable) {
  constexpr std::size_t header = 128;
  const std::string_view mark =
      bytes.substr(0, header).size() == header ? bytes.substr(126, 2) : "";
  if (mark != "IM" && mark != "MI") {
    const bool hdf = bytes.starts_with("\x89HDF");
    refuse(file, hdf ? "is an HDF5 file" : "is not a MAT-file of version 5",
           "a file written by save -v7");
  }
  const bool swapped = mark == "MI";
  if (const auto version = value_at<std::uint16_t>(bytes, 62, swapped); version != 0x0100)
    refuse(file,
           version == 0x0200 ? "is a MAT-file of version 7.3" : "is not a MAT-file of version 5",
           "a file written by save -v7");
  bytes.remove_prefix(header);
  std::vector<std::string> names;
  while (!bytes.empty()) {
    auto element = take(bytes, swapped);
    if (!element) refuse(file, "ends within a variable, or is damaged", "a whole MAT-file");
    // In addition to the numbers: tags, dimensions, name, and a possible second element (an error).
    constexpr std::size_t most = std::size_t(largest_matrix * largest_matrix) * 8 + 4096;
    Inflated whole{{}, true};
    if (element->type == compressed) {
      whole = inflated(element->data, most);
      std::string_view inside = whole.bytes;
      // The header suffices to reject a matrix that is too large.
      if (inside.size() >= 8)
        element = Element{value_at<std::uint32_t>(inside, 0, swapped), inside.substr(8)};
    }
    if (element->type != of_matrix) continue;
    const auto head = head_of(element->data, swapped);
    if (!head || head->name != variable) {
      constexpr std::size_t shown = 20;
      if (head && !head->name.empty() && names.size() < shown)
        names.push_back(in_quotes(head->name));
      continue;
    }
    const std::string where = fmt::format("{}: variable {}", file, in_quotes(variable));
    Eigen::MatrixXd A = matrix_of(where, *head, swapped);
    if (!whole.whole) refuse(where, "is truncated or damaged", "a whole MAT-file");
    return A;
  }
  refuse(file, fmt::format("has no variable {}", in_quotes(variable)),
         names.empty() ? std::string("a matrix")
                       : fmt::format("one of {} (--variable)", fmt::join(names, ", ")));
}

}  // namespace tiltrim::cli
