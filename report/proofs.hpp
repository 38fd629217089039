/// Theorems as text and JSON, and their certificate. Internal to report/ and cli/.
#pragma once

#include <string>
#include <vector>

#include "prove/prove.hpp"
#include "report/sheet.hpp"
#include "study/study.hpp"

namespace tiltrim {

/// Why there is no certificate for a study with [model].
inline constexpr const char* no_certificate =
    "a proof about [model] has no certificate: check-proof knows the equations of the tiltrotor "
    "only";

std::string theorems_text(const Study& study, const std::vector<Theorem>& theorems);
/// `certificate`: the file written, or empty.
std::string theorems_json(const Study& study, const std::vector<Theorem>& theorems,
                          const std::string& certificate);
/// The evidence of every box, for an independent check: docs/prove.md. Empty for a study with
/// [model].
std::string certificate_of(const Study& study, const std::vector<Theorem>& theorems);

}  // namespace tiltrim
