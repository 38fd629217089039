#include "runtime/ranks.hpp"

namespace tiltrim {

int rank() { return 0; }
int ranks() { return 1; }
std::vector<Bytes> gather(const Bytes& own) { return {own}; }
Bytes broadcast(const Bytes& own) { return own; }

}  // namespace tiltrim
