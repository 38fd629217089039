/// Random numbers and matrices, the same in every run.
#pragma once

#include <Eigen/Core>
#include <random>

using Random = std::mt19937_64;

/// Random stream of this number; different for every TILTRIM_SEED of the environment, as for `make
/// planted`.
Random draws(std::uint64_t number);
/// If TILTRIM_SEED is set, prints a line for `make planted` to sum: numbers of trials with planted
/// truth, of wrong results, and of missing results.
void tally(const char* kind, int trials, int wrong, int unanswered);

double uniform(Random& random, double low, double high);
/// [0, 1), the same with every standard library.
double uniform(std::mt19937& random);
Eigen::VectorXd uniform(Random& random, Eigen::Index n, double low, double high);

/// Entries of the standard normal distribution.
Eigen::MatrixXd normal(Random& random, Eigen::Index rows, Eigen::Index columns);
