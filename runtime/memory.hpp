/// Memory that is freed and taken again. Internal to tiltrim.
#pragma once

#include <cstddef>
#include <cstdlib>

namespace tiltrim {

/// glibc gives large blocks back to the system when they are freed, and takes fresh pages for the
/// next ones. After this it keeps twice as many bytes: it does so from the largest block that was
/// ever freed on (mallopt(3), M_MMAP_THRESHOLD).
inline void keep_freed_memory(std::size_t bytes) {
  void* volatile block = std::malloc(bytes);  // or the compiler leaves both out
  std::free(block);
}

}  // namespace tiltrim
