/// Flights as text, CSV, JSON and gnuplot scripts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "flight/fly.hpp"
#include "flight/hand_over.hpp"
#include "flight/monte_carlo.hpp"
#include "flight/paper_flight.hpp"
#include "flight/tilt_rate.hpp"
#include "report/sheet.hpp"
#include "simulate/simulate.hpp"

namespace tiltrim {

struct FlightReport {
  std::string name;  ///< of the study
  FlightPlan plan;
  std::vector<HandOverCheck> hand_over;
  std::optional<FlightResult> flown;  ///< empty without a trim to start from
  FlightTable table;                  ///< of the flight
  std::vector<PaperFact> facts;       ///< empty unless the flight is the paper's
};
/// The contents of the text, for documents.
std::vector<Sheet> flight_document(const FlightReport& report);
std::string flight_text(const FlightReport& report, const TextStyle& style);
std::string flight_json(const FlightReport& report);
/// The text between the tables, one string per paragraph.
std::vector<std::string> flight_words(const FlightReport& report);
/// Every sample.
Sheet flight_sheet(const FlightReport& report);
Sheet table_sheet(const FlightTable& table);

/// A gnuplot script for the paper's Figures 5-9, which reads flight.csv in its folder and writes
/// each figure as NAME.svg and NAME.png.
std::string flight_plots(const FlightReport& report);
/// Their names: "fig5_angles", ...
std::vector<std::string> flight_plot_names();

std::vector<Sheet> tilt_rate_document(const TiltRateLimit& limit);
std::string tilt_rate_text(const TiltRateLimit& limit, const TextStyle& style);
std::string tilt_rate_json(const TiltRateLimit& limit);
/// All flights of the search.
Sheet tilt_rate_sheet(const TiltRateLimit& limit);

struct NamedResponse {
  std::string name;  ///< of the condition
  Response response;
};
std::vector<Sheet> responses_document(const std::vector<NamedResponse>& responses);
std::string responses_text(const std::vector<NamedResponse>& responses, const TextStyle& style);
std::string responses_json(const std::vector<NamedResponse>& responses);
/// Every sample of each response: linear, nonlinear, difference.
Sheet responses_sheet(const std::vector<NamedResponse>& responses);

std::vector<Sheet> monte_carlo_document(const MonteCarlo& run);
std::string monte_carlo_text(const MonteCarlo& run, const TextStyle& style);
std::string monte_carlo_json(const MonteCarlo& run);
/// The worst flights.
Sheet monte_carlo_sheet(const MonteCarlo& run);

}  // namespace tiltrim
