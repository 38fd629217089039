/// A plain prover for tests of the checker: bisection, with the checker itself as judge.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "check_proof/check_proof.hpp"
#include "check_proof/leaf.hpp"
#include "study/study.hpp"

struct ProofToWrite {
  tiltrim::Study study;
  std::vector<std::pair<std::string, tiltrim::checking::Bounds>> parameters;  ///< SI
  double margin = 0;
  int depth = 12;  ///< of the bisection; deeper boxes are undecided
};

/// The certificate's text, and its statement.
std::string written_proof(const ProofToWrite& asked);
tiltrim::checking::Statement statement_of(const ProofToWrite& asked);
/// What a checker must find in it, of everything but the box and the margin.
tiltrim::ProofSubject subject_of(const tiltrim::checking::Statement& statement);
