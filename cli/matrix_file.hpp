/// Square matrices that other programs wrote: CSV, JSON, MATLAB.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tiltrim::cli {

constexpr Eigen::Index largest_matrix = 1000;  // rows: half a minute of work

struct MatrixFile {
  Eigen::MatrixXd values;
  std::vector<std::string> states;  ///< names that the file has; else empty
};

/// Reads a file, or standard input if it is "-". A name that ends in .mat is MATLAB's, one that
/// ends in .json is JSON, as is what begins with [ or {; all else is numbers with commas,
/// semicolons or blanks between. `variable` is whose value is read of MATLAB's files and of JSON
/// objects. Throws std::runtime_error "FILE:line:column: what; expected what" for all that is no
/// square matrix of finite numbers, and, if these are bounds, for what is below zero.
MatrixFile read_matrix(const std::filesystem::path& file, const std::string& variable,
                       bool bounds = false);

/// What is wrong at a place in a file, as an exception.
[[noreturn]] void refuse(const std::string& where, const std::string& what,
                         const std::string& expected);
/// What a file says, short and harmless on a terminal.
std::string in_quotes(std::string_view text);
/// Throws if rows and columns are no size of a matrix to take.
void check_size(const std::string& where, std::size_t rows, std::size_t columns);
/// A matrix out of the bytes of a MATLAB file of version 5.
Eigen::MatrixXd read_mat(const std::string& file, std::string_view bytes,
                         const std::string& variable);

}  // namespace tiltrim::cli
