/// Square matrices from other programs: CSV, JSON, MATLAB.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tiltrim::cli {

constexpr Eigen::Index largest_matrix = 1000;  // rows: about half a minute

struct MatrixFile {
  Eigen::MatrixXd values;
  std::vector<std::string> states;  ///< names given in the file; else empty
  bool named = false;               ///< a variable of a MATLAB file or JSON object
};

/// Reads a file, or standard input if it is "-". A name ending in .mat is a MATLAB file; a name
/// ending in .json, or contents starting with [ or {, is JSON; anything else is numbers separated
/// by commas, semicolons or blanks. `variable` selects a variable of a MATLAB file or JSON object.
/// Throws std::runtime_error "FILE:line:column: what; expected what" unless the file holds a square
/// matrix of finite numbers, nonnegative if these are bounds.
MatrixFile read_matrix(const std::filesystem::path& file, const std::string& variable,
                       bool bounds = false);

/// Throws an error at a place in a file.
[[noreturn]] void refuse(const std::string& where, const std::string& what,
                         const std::string& expected);
/// A quotation from a file, shortened and safe on a terminal.
std::string in_quotes(std::string_view text);
/// Throws unless the matrix is square and not too large.
void check_size(const std::string& where, std::size_t rows, std::size_t columns);
/// A matrix from the bytes of a MATLAB Level 5 file.
Eigen::MatrixXd read_mat(const std::string& file, std::string_view bytes,
                         const std::string& variable);

}  // namespace tiltrim::cli
