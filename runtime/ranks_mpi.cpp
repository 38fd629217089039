#include <mpi.h>

#include <limits>
#include <numeric>
#include <stdexcept>

#include "runtime/ranks.hpp"

namespace tiltrim {

namespace {

// MPI for the lifetime of the program. Only the first thread communicates.
struct Session {
  Session() {
    int level = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
  }
  ~Session() { MPI_Finalize(); }
  int rank = 0, size = 1;
};

const Session& session() {
  static const Session the_one;
  return the_one;
}

int count_of(std::size_t bytes) {
  if (bytes > std::size_t(std::numeric_limits<int>::max()))
    throw std::runtime_error("more than 2 GiB from one rank at once");
  return int(bytes);
}

}  // namespace

int rank() { return session().rank; }
int ranks() { return session().size; }

std::vector<Bytes> gather(const Bytes& own) {
  const int n = ranks(), mine = count_of(own.size());
  std::vector<int> sizes(std::size_t(n), 0), starts(std::size_t(n), 0);
  MPI_Allgather(&mine, 1, MPI_INT, sizes.data(), 1, MPI_INT, MPI_COMM_WORLD);
  const std::size_t total = std::accumulate(sizes.begin(), sizes.end(), std::size_t{0});
  (void)count_of(total);
  std::exclusive_scan(sizes.begin(), sizes.end(), starts.begin(), 0);
  Bytes all(total);
  MPI_Allgatherv(own.data(), mine, MPI_BYTE, all.data(), sizes.data(), starts.data(), MPI_BYTE,
                 MPI_COMM_WORLD);
  std::vector<Bytes> parts;
  for (std::size_t i = 0; i < std::size_t(n); ++i)
    parts.emplace_back(all.begin() + starts[i], all.begin() + starts[i] + sizes[i]);
  return parts;
}

Bytes broadcast(const Bytes& own) {
  unsigned long long size = own.size();
  MPI_Bcast(&size, 1, MPI_UNSIGNED_LONG_LONG, 0, MPI_COMM_WORLD);
  Bytes all = own;
  all.resize(size);
  constexpr std::size_t piece = 1 << 30;
  for (std::size_t at = 0; at < all.size(); at += piece)
    MPI_Bcast(all.data() + at, count_of(std::min(piece, all.size() - at)), MPI_BYTE, 0,
              MPI_COMM_WORLD);
  return all;
}

}  // namespace tiltrim
