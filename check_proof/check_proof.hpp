/// @file
/// Verifies a certificate of `tiltrim prove` without the prover: its own equations, its own
/// arithmetic (Arb), no search.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tiltrim {

/// One theorem of a verified certificate.
struct CheckedTheorem {
  /// A number of the box; SI units, radians.
  struct Number {
    std::string key;  ///< as in the study
    double from;      ///< lower end
    double to;        ///< upper end
  };
  std::string condition;        ///< its name in the study
  std::vector<Number> numbers;  ///< the box
  double margin = 0;            ///< 1/s: every root has Re < -margin where proved stable
  double damping = 0;           ///< and a damping ratio above this; 0: any
  std::size_t leaves = 0;       ///< of the tree
  double stable = 0;            ///< share of the box's volume
  double unstable = 0;          ///< the same
  double no_trim = 0;           ///< the same
  double undecided = 0;         ///< the same
};

/// How check_proof() ends.
enum class CertificateStatus {
  verified,   ///< the file proves what it states
  refused,    ///< it does not: see line, box, reason
  unreadable  ///< not a certificate, or not readable
};

/// The result of check_proof().
struct ProofCheck {
  CertificateStatus status = CertificateStatus::refused;  ///< how it ended
  std::vector<CheckedTheorem> theorems;                   ///< empty unless verified
  std::size_t line = 0;  ///< of the first failure; 0: the file as a whole
  std::string box;       ///< the failing leaf's, empty if the failure is not in one
  std::string reason;    ///< what fails
};

/// What a theorem must be about: every number, bit for bit.
struct ProofSubject {
  std::map<std::string, double> numbers;     ///< "V", "aircraft.mass", "gains.k_V", ...
  std::vector<double> tilts;                 ///< rad, of scheduled gains; empty: constant
  std::vector<std::vector<double>> gains;    ///< in the order of GainsOf, at each tilt
  std::vector<double> alpha;                 ///< rad, nodes of the polar
  std::array<std::vector<double>, 3> polar;  ///< CL, CD, CM there
  std::map<std::string, std::array<double, 2>> domain{};  ///< of the parameters, by key; empty: any
  double margin = 0;                                      ///< at least
  double damping = 0;                                     ///< at least
  std::map<std::string, std::array<double, 2>> limits;    ///< theta0, a1s, delta_e, theta
};

/// Options of check_proof().
struct CheckProofOptions {
  int threads = 0;  ///< 0: one per processor; the result does not depend on it
  /// By the name of the condition. Empty: the certificate's own numbers, whatever they are.
  std::map<std::string, ProofSubject> about{};
};

/// False if the build has no Arb: then check_proof() throws std::runtime_error.
bool can_check_proofs();

/// Verifies all theorems of a certificate.
[[nodiscard]] ProofCheck check_proof(const std::filesystem::path& file,
                                     const CheckProofOptions& options = {});

/// The same for a certificate's text.
[[nodiscard]] ProofCheck check_proof_text(const std::string& text,
                                          const CheckProofOptions& options = {});

}  // namespace tiltrim
