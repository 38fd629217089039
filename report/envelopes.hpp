/// Envelopes of trims, as text, CSV and JSON. Computes nothing.
#pragma once

#include <string>
#include <vector>

#include "report/sheet.hpp"
#include "study/analyses.hpp"

namespace tiltrim {

/// Speeds between which there is a trim, one row for each interval.
Sheet envelope_sheet(const EnvelopeAnswer& envelope);
/// Every point of the border of all envelopes.
Sheet border_sheet(const std::vector<EnvelopeAnswer>& envelopes);

/// What the text has, for documents.
std::vector<Sheet> envelopes_document(const std::vector<EnvelopeAnswer>& envelopes);
std::string envelopes_text(const std::vector<EnvelopeAnswer>& envelopes, const TextStyle& style);
/// The stable JSON that docs/cli.md describes.
std::string envelopes_json(const std::vector<EnvelopeAnswer>& envelopes);

}  // namespace tiltrim
