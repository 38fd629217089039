// proof_oracle CERTIFICATE STUDY.toml [POINTS]: random points of what is proved, judged by trim()
// and linearize(). Exit code 1: a contradiction.
#include <fmt/core.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "tests/proof_oracle.hpp"

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  std::ifstream in(argv[1], std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const tiltrim::Study study = tiltrim::load_study(argv[2]);
  const std::size_t count = argc > 3 ? std::size_t(std::atol(argv[3])) : 1'000'000;
  std::size_t contradictions = 0;
  for (const auto& theorem : tiltrim::checking::read_certificate(text)) {
    const OracleFindings found = oracle(theorem, study, count, 1);
    fmt::print("{}: {} stable, {} unstable, {} without trim; {} contradictions {}\n",
               theorem.statement.condition, found.stable, found.unstable, found.no_trim,
               found.contradictions, found.first);
    contradictions += found.contradictions;
  }
  return contradictions > 0;
}
