/// @file
/// Verifies a certificate of `tiltrim prove` without the prover: its own equations, its own
/// arithmetic (Arb), no search.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace tiltrim {

/// One theorem of a verified certificate.
struct CheckedTheorem {
  /// A number of the box; SI units, radians.
  struct Number {
    std::string key;  ///< as in the study
    double from, to;
  };
  std::string condition;        ///< its name in the study
  std::vector<Number> numbers;  ///< the box
  double margin = 0;            ///< 1/s: every root has Re < -margin where proved stable
  std::size_t leaves = 0;       ///< of the tree
  /// Shares of the box's volume.
  double stable = 0, unstable = 0, no_trim = 0, undecided = 0;
};

/// How check_proof() ends.
enum class CertificateStatus {
  verified,   ///< the file proves what it states
  refused,    ///< it does not: see line, box, reason
  unreadable  ///< not a certificate, or not readable
};

/// The result of check_proof().
struct ProofCheck {
  CertificateStatus status = CertificateStatus::refused;
  std::vector<CheckedTheorem> theorems;  ///< empty unless verified
  std::size_t line = 0;                  ///< of the first failure; 0: the file as a whole
  std::string box;                       ///< the failing leaf's, empty if the failure is not in one
  std::string reason;                    ///< what fails
};

/// False if the build has no Arb: then check_proof() throws std::runtime_error.
bool can_check_proofs();

/// Verifies all theorems of a certificate. `threads` as elsewhere: 0 is one per processor; the
/// result does not depend on it.
[[nodiscard]] ProofCheck check_proof(const std::filesystem::path& file, int threads = 0);

/// The same for a certificate's text.
[[nodiscard]] ProofCheck check_proof_text(const std::string& text, int threads = 0);

}  // namespace tiltrim
