/// The log of examined boxes. Internal to prove/.
#pragma once

#include <optional>
#include <span>

#include "prove/parts.hpp"

namespace tiltrim::proving {

/// Boxes are numbered as they are examined, the same in every run: the log has the answers of the
/// first ones.
class Examined {
 public:
  explicit Examined(const ProveOptions& options);

  /// The answer of a box that an earlier run examined; each is taken once.
  std::optional<Answer> take(std::size_t box);
  /// Appends the answers of the boxes from `first` on, up to one that is missing, without those
  /// that are in the log.
  void append(std::size_t first, std::span<const std::optional<Answer>> answers);
  /// Boxes between two writes; without a log, all.
  std::size_t at_once() const;

 private:
  Log* log_;
  std::uint64_t part_;
  std::vector<Answer> known_;
};

}  // namespace tiltrim::proving
