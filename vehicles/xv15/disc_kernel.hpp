/// Blade elements at eight azimuths at once: their kernel, compiled once for each instruction set.
/// Internal to vehicles/xv15/.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/instruction_set.hpp"

namespace tiltrim {

namespace xv15 {

inline constexpr std::size_t azimuth_count = 8;

/// A blade element: position and weight of Gauss' rule between the borders of the sections.
struct Element {
  double r, dr, chord, twist;  ///< m, m, m, rad
  std::size_t section;         ///< of Data::airfoils
};

/// An inner entry of an axis, the end of its part of the axis and the reciprocals that its rounded
/// corner takes.
struct Corner {
  double at, until, width, per_width, down, up;
};
/// As Axis, for the kernel.
struct AxisView {
  const Corner* corners;
  const std::uint16_t* nearest;
  double from, to, per_step;
  bool hold;
};
/// As Pair, for the kernel.
struct SectionView {
  AxisView mach, alpha;
  const double* cells;
  std::size_t columns;
};

/// Sums over the disc before density: thrust, in-plane force, torque and the two flap moments, with
/// their slopes by Cause, column by column. `level` is V_n + v, `cosine` the share of U_P that is
/// r cos psi.
struct DiscTask {
  const Element* elements;
  std::size_t count;
  const SectionView* sections;
  double V_e, level, cosine, theta_75, B1, omega, a1, b1, sound, tan_delta3;
  double *value, *slope;
};
/// Where a table is silent, if one is.
struct Silence {
  bool any, of_mach;
  std::size_t section;
  double at;
};

}  // namespace xv15

template <InstructionSet>
xv15::Silence disc_sums(const xv15::DiscTask& task);

}  // namespace tiltrim
