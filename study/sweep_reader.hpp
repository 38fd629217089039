/// Reads [sweep], its axes, and the grids of [report]. Internal to study/.
#pragma once

#include "study/section.hpp"
#include "study/study.hpp"
#include "vehicles/tiltrotor/corridor.hpp"

namespace tiltrim::reading {

/// What the axes of a grid may vary.
struct AxisKeys {
  std::vector<Key> keys;
  GainSchedule schedule;  ///< axes over tilt vary the scheduled gains
  bool corridor = true;   ///< h sets the commands of the corridor (16)
  AxisKeys(const GainSchedule& gains) : keys(study_keys()), schedule(gains) {}
  AxisKeys(const std::shared_ptr<const UserModel>& own) : keys(own->keys), corridor(false) {}
};

/// Reads [sweep]; throws StudyError.
SweepTable read_sweep(const Section& section, const std::filesystem::path& file,
                      const AxisKeys& keys);

/// Reads [report] after the study's conditions; throws StudyError. A grid has one or two axes.
ReportTable read_report(const Section& section, const std::filesystem::path& file,
                        const AxisKeys& keys, const std::vector<Condition>& conditions);

}  // namespace tiltrim::reading
