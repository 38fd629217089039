/// Lanes: as many doubles as a register holds, worked on together. A source that includes this is
/// compiled once for each instruction set, everything of it in namespace TILTRIM_LANES.
/// Internal to linearize/.
#pragma once

#include <experimental/simd>

#ifndef TILTRIM_LANES
#error "compiled once for each instruction set: see tiltrim_lanes() in CMakeLists.txt"
#endif

namespace tiltrim::TILTRIM_LANES {

#ifdef TILTRIM_LANES_SCALAR
using Lanes = std::experimental::simd<double, std::experimental::simd_abi::scalar>;
#else
using Lanes = std::experimental::native_simd<double>;
#endif
using LaneMask = Lanes::mask_type;
inline constexpr std::size_t lane_count = Lanes::size();

}  // namespace tiltrim::TILTRIM_LANES
