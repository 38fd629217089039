/// @file
/// Attitude bandwidth and phase delay of a transfer function.
#pragma once

#include <limits>
#include <string>

#include "qualities/zeros.hpp"

namespace tiltrim {

/// What a constant stick commands.
enum class ResponseType {
  rate,      ///< a rate: the bandwidth is the lesser of the gain and the phase bandwidth
  attitude,  ///< an attitude: the bandwidth is the phase bandwidth
};

std::string to_string(ResponseType type);  ///< "rate", "attitude"

/// A frequency, or a time, with its error bound; infinite if the response never gets there.
struct Located {
  double value = std::numeric_limits<double>::infinity();  ///< rad/s, or s
  double error = 0.0;                                      ///< bound
};

/// Small-amplitude bandwidth and phase delay of attitude to stick [97, 3.3.2.1].
struct Bandwidth {
  bool known = false;       ///< false: the transfer function's zeros are not known; see `message`
  Located phase_bandwidth;  ///< rad/s: 45 degrees of phase margin, a phase of -135 degrees
  Located gain_bandwidth;   ///< rad/s: 6 dB of gain margin, |G| = 6 dB above |G(iω180)|
  Located bandwidth;        ///< rad/s: by the response type
  Located crossover;        ///< rad/s: ω180, a phase of -180 degrees
  Located phase_delay{0.0, 0.0};  ///< s: (-180° - phase(2 ω180))/(2 ω180); 0 without ω180
  std::string message;            ///< why it is not known, or what is ambiguous
};

/// Bandwidth of a transfer function from its zeros and poles, with the sign of the stick that
/// raises the nose first. Phases are continuous in frequency and end at -90 degrees for each of the
/// poles in excess of zeros.
[[nodiscard]] Bandwidth bandwidth(const ZerosAndPoles& transfer,
                                  ResponseType type = ResponseType::rate);

}  // namespace tiltrim
