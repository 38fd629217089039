/// [sweep] and its axes, and the grids of [report].
/// Internal to study/.
#pragma once

#include "study/section.hpp"
#include "study/study.hpp"

namespace tiltrim::reading {

/// What the axes of a grid may name.
struct AxisKeys {
  std::vector<Key> keys;
  GainSchedule schedule;  ///< axes that move the tilt move scheduled gains with it
  bool corridor = true;   ///< h stands for the corridor (16)
  AxisKeys(const GainSchedule& gains) : keys(study_keys()), schedule(gains) {}
  AxisKeys(const std::shared_ptr<const UserModel>& own) : keys(own->keys), corridor(false) {}
};

/// Reads [sweep]; throws StudyError.
SweepTable read_sweep(const Section& section, const std::filesystem::path& file,
                      const AxisKeys& keys);

/// Reads [report] of a study whose conditions are read; throws StudyError. A grid has one axis or
/// two.
ReportTable read_report(const Section& section, const std::filesystem::path& file,
                        const AxisKeys& keys, const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
