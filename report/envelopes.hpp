/// Envelopes of trims, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// Intervals of speed with a trim, one row each.
Sheet envelope_sheet(const EnvelopeAnswer& envelope);
/// Every boundary point of all envelopes.
Sheet border_sheet(const std::vector<EnvelopeAnswer>& envelopes);

/// The contents of the text, for documents.
std::vector<Sheet> envelopes_document(const std::vector<EnvelopeAnswer>& envelopes);
std::string envelopes_text(const std::vector<EnvelopeAnswer>& envelopes, const TextStyle& style);
/// JSON as described in docs/cli.md.
std::string envelopes_json(const std::vector<EnvelopeAnswer>& envelopes);

}  // namespace tiltrim
