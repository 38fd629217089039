/// The processes of one sweep: this process, or all ranks of an MPI run. Internal to tiltrim.
#pragma once

#include <cstddef>
#include <vector>

namespace tiltrim {

using Bytes = std::vector<std::byte>;

int rank();   ///< 0 .. ranks() - 1
int ranks();  ///< 1 without MPI

/// Every rank's bytes, in rank order, on every rank.
std::vector<Bytes> gather(const Bytes& own);
/// Rank 0's bytes on every rank.
Bytes broadcast(const Bytes& own);

}  // namespace tiltrim
