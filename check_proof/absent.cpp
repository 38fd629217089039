// The checker of a build without Arb.
#include <stdexcept>

#include "check_proof/check_proof.hpp"

namespace tiltrim {

bool can_check_proofs() { return false; }

ProofCheck check_proof_text(const std::string&, const CheckProofOptions&) {
  throw std::runtime_error(
      "check-proof: this program was built without Arb (Debian package libflint-arb-dev)");
}

ProofCheck check_proof(const std::filesystem::path&, const CheckProofOptions& options) {
  return check_proof_text({}, options);
}

}  // namespace tiltrim
