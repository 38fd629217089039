// Tilt-rate limits, linear against nonlinear responses, Monte-Carlo flights.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "model/degrees.hpp"
#include "report/flights.hpp"
#include "report/json.hpp"

namespace tiltrim {

using Eigen::Index;
using json::ordered_json;

namespace {

std::string in_words(const TiltRateLimit& l, const TextStyle& style) {
  const auto rate = [](double r) { return fmt::format("{:.4g}°/s", r * degrees); };
  switch (l.status) {
    case TiltRateStatus::found:
      return toned(fmt::format("frozen eigenvalues predict the flight up to a tilt rate of {}",
                               rate(l.holds)),
                   Tone::good, style) +
             fmt::format(", not at {}", rate(l.fails));
    case TiltRateStatus::always:
      return toned(
          "frozen eigenvalues predict the flight at every rate tried, up to " + rate(l.holds),
          Tone::good, style);
    case TiltRateStatus::never:
      return toned("frozen eigenvalues do not predict the flight at any rate tried, down to " +
                       rate(l.fails),
                   Tone::bad, style);
    case TiltRateStatus::no_trim:
      return toned("no trim", Tone::bad, style);
    case TiltRateStatus::interrupted:
      return fmt::format("interrupted between {} and {}", rate(l.holds), rate(l.fails));
  }
  return "?";
}

std::string stretch_text(const SlowTilt& s) {
  const std::string where =
      fmt::format("tilts {:.4g}° to {:.4g}°: ", s.from * degrees, s.to * degrees);
  if (!s.stable) return where + "some frozen loop is unstable, so no rate can be certified";
  if (s.certified <= 0) {
    constexpr double width = 1e-6;  // rad, distance of the two sides of a switch
    return (s.from - s.to < width ? fmt::format("at the switch, {:.4g}°: ", s.from * degrees)
                                  : where) +
           "no rate can be certified";
  }
  return where + fmt::format(
                     "certified by a Lyapunov function up to {:.3g}°/s (largest eigenvalue of the "
                     "certificate {:.2g}), decided at {:.4g}°",
                     s.certified * degrees, s.certificate, s.decided_at * degrees);
}

// Largest deviation of one state over a response.
double largest(const Eigen::MatrixXd& x, Index i) { return x.row(i).cwiseAbs().maxCoeff(); }

bool is_angle(const Signal& s) { return s.unit == "rad" || s.unit == "rad/s"; }

}  // namespace

// ---- Tilt rate ----------------------------------------------------------------------------------

std::string tilt_rate_text(const TiltRateLimit& l, const TextStyle& style) {
  std::string text = wrapped(in_words(l, style), 0, style.width);
  if (!l.message.empty()) text += wrapped(l.message, 2, style.width);
  if (l.loops.empty()) return text;
  const auto worst = std::ranges::max_element(l.loops, {}, &FrozenLoop::abscissa);
  text +=
      "\n" + wrapped(fmt::format("frozen loops: {} tilts, {}; largest Re λ = {:.4g} 1/s at {:.4g}°",
                                 l.loops.size(), l.frozen_stable ? "all stable" : "not all stable",
                                 worst->abscissa, worst->eta * degrees),
                     0, style.width);
  for (const SlowTilt& s : l.stretches) text += wrapped(stretch_text(s), 2, style.width);
  for (const Growth& g : l.growth)
    text += wrapped(fmt::format("linear motion about the moving trim at {:.4g}°/s: largest growth "
                                "factor {:.3g}; {:.3g} from beginning to end",
                                g.rate * degrees, g.worst, g.whole),
                    2, style.width);
  const auto held = std::ranges::count_if(l.flights, &TiltFlight::holds);
  text += wrapped(
      fmt::format(
          "{} nonlinear flights with initial disturbances{}; {} end in trim", l.flights.size(),
          l.disturbance < 1 ? fmt::format(" scaled by {:.3g}", l.disturbance) : std::string(),
          held),
      2, style.width);
  return text;
}

std::vector<Sheet> tilt_rate_document(const TiltRateLimit& l) {
  return {paragraph_sheet(tilt_rate_text(l, unwrapped))};
}

std::string tilt_rate_json(const TiltRateLimit& l) {
  ordered_json root{{"status", to_string(l.status)},    {"message", l.message},
                    {"holds_deg_s", l.holds * degrees}, {"fails_deg_s", l.fails * degrees},
                    {"frozen_stable", l.frozen_stable}, {"disturbance", l.disturbance}};
  root["stretches"] = ordered_json::array();
  for (const SlowTilt& s : l.stretches)
    root["stretches"].push_back({{"from_deg", s.from * degrees},
                                 {"to_deg", s.to * degrees},
                                 {"stable", s.stable},
                                 {"certified_deg_s", s.certified * degrees},
                                 {"certificate", s.certificate},
                                 {"decided_at_deg", s.decided_at * degrees}});
  root["growth"] = ordered_json::array();
  for (const Growth& g : l.growth)
    root["growth"].push_back(
        {{"rate_deg_s", g.rate * degrees}, {"worst", g.worst}, {"whole", g.whole}});
  root["frozen"] = ordered_json::array();
  for (const FrozenLoop& f : l.loops)
    root["frozen"].push_back({{"eta_deg", f.eta * degrees}, {"spectral_abscissa", f.abscissa}});
  root["flights"] = ordered_json::array();
  for (const TiltFlight& f : l.flights)
    root["flights"].push_back({{"rate_deg_s", f.rate * degrees},
                               {"disturbed", f.disturbed},
                               {"holds", f.holds},
                               {"status", to_string(f.status)},
                               {"message", f.message}});
  return root.dump(2) + "\n";
}

Sheet tilt_rate_sheet(const TiltRateLimit& l) {
  Sheet sheet{"",
              {{"rate_deg_s", "rate", "°/s", "{:.4g}"},
               {"disturbed", "disturbed", ""},
               {"holds", "holds", ""},
               {"status", "status", ""},
               {"message", "message", ""}},
              {},
              {}};
  for (const TiltFlight& f : l.flights)
    sheet.rows.push_back(
        {f.rate * degrees, f.disturbed, f.holds ? "yes" : "no", to_string(f.status), f.message});
  return sheet;
}

// ---- Responses ----------------------------------------------------------------------------------

namespace {

// Outcome of a response: "level: " and the rest, wrapped.
std::string in_words(const NamedResponse& named, const TextStyle& style) {
  const Response& r = named.response;
  if (r.status == ResponseStatus::no_trim)
    return wrapped(named.name + ": " + toned("no trim", Tone::bad, style) + ": " + r.message, 0,
                   style.width);
  const std::string cut = r.status == ResponseStatus::cut_short
                              ? toned("the nonlinear motion ends early", Tone::bad, style) + ": " +
                                    r.message + "; until then "
                              : std::string();
  const std::string line = fmt::format(
      "{}: {}linear and nonlinear response differ by at most {:.3g} %; the linear model is valid "
      "up to {} this offset ({:.0f} % difference)",
      named.name, cut, 100 * r.apart,
      r.reach > 0 ? fmt::format("{:.3g} times", r.reach) : std::string("less than a millionth of"),
      10.0);
  return wrapped(line, 0, style.width);
}

// The largest value of each state over the response.
Sheet largest_sheet(const Response& r) {
  Sheet sheet{"",
              {{"state", "state", ""},
               {"offset", "offset", "", "{:.5g}"},
               {"linear", "linear peak", "", "{:.5g}"},
               {"nonlinear", "nonlinear peak", "", "{:.5g}"},
               {"apart", "largest difference", "", "{:.3g}"},
               {"unit", "", ""}},
              {},
              {}};
  for (Index i = 0; i < std::ssize(r.states); ++i) {
    const Signal& s = r.states[std::size_t(i)];
    const double scale = is_angle(s) ? degrees : 1.0;
    sheet.rows.push_back({s.name, r.offset[i] * scale, largest(r.linear, i) * scale,
                          largest(r.nonlinear, i) * scale,
                          largest(r.linear - r.nonlinear, i) * scale,
                          is_angle(s) ? (s.unit == "rad" ? "°" : "°/s") : s.unit});
  }
  return sheet;
}

}  // namespace

std::string responses_text(const std::vector<NamedResponse>& responses, const TextStyle& style) {
  std::string text;
  for (const NamedResponse& r : responses) {
    text += (text.empty() ? "" : "\n") + in_words(r, style);
    if (r.response.status != ResponseStatus::no_trim)
      text += as_text(largest_sheet(r.response), style);
  }
  return text;
}

std::vector<Sheet> responses_document(const std::vector<NamedResponse>& responses) {
  std::vector<Sheet> sheets;
  for (const NamedResponse& r : responses) {
    sheets.push_back(paragraph_sheet(in_words(r, unwrapped)));
    if (r.response.status == ResponseStatus::no_trim) continue;
    sheets.push_back(largest_sheet(r.response));
    sheets.back().title = r.name;
  }
  return sheets;
}

std::string responses_json(const std::vector<NamedResponse>& responses) {
  ordered_json root{{"responses", ordered_json::array()}};
  for (const auto& [name, r] : responses) {
    ordered_json one{{"name", name},
                     {"status", to_string(r.status)},
                     {"message", r.message},
                     {"apart", r.apart},
                     {"reach", r.reach}};
    if (r.status != ResponseStatus::no_trim) {
      one["t"] = r.t;
      for (const auto& [key, x] : {std::pair{"linear", &r.linear}, {"nonlinear", &r.nonlinear}})
        for (Index i = 0; i < x->rows(); ++i) {
          const Eigen::VectorXd row = x->row(i);
          one[key][r.states[std::size_t(i)].name] =
              std::vector<double>(row.data(), row.data() + row.size());
        }
    }
    root["responses"].push_back(std::move(one));
  }
  return root.dump(2) + "\n";
}

Sheet responses_sheet(const std::vector<NamedResponse>& responses) {
  Sheet sheet;
  sheet.columns = {{"name", "condition", ""}, {"t", "t", "s"}};
  if (responses.empty()) return sheet;
  for (const Signal& s : responses.front().response.states)
    for (const char* kind : {"linear", "nonlinear", "difference"})
      sheet.columns.push_back({s.name + "_" + kind, s.name, s.unit});
  for (const auto& [name, r] : responses)
    for (std::size_t k = 0; k < r.t.size(); ++k) {
      std::vector<SheetCell> row{name, r.t[k]};
      for (Index i = 0; i < std::ssize(r.states); ++i) {
        const double linear = r.linear(i, Index(k)), nonlinear = r.nonlinear(i, Index(k));
        for (const double v : {linear, nonlinear, nonlinear - linear}) row.emplace_back(v);
      }
      sheet.rows.push_back(std::move(row));
    }
  return sheet;
}

// ---- Monte Carlo --------------------------------------------------------------------------------

Sheet monte_carlo_sheet(const MonteCarlo& run) {
  Sheet sheet{"",
              {{"number", "flight", "", "{:.0f}"},
               {"status", "status", ""},
               {"t", "t", "s", "{:.2f}"},
               {"height", "h", "m", "{:.1f}"},
               {"V_off", "V error", "m/s", "{:.3f}"},
               {"gamma_off_deg", "γ error", "°", "{:.3f}"},
               {"theta_most_deg", "max |θ|", "°", "{:.2f}"},
               {"miss", "error/tolerance", "", "{:.4g}"}},
              {},
              {}};
  for (const std::string& name : run.names)
    sheet.columns.push_back({name, name.substr(name.rfind('.') + 1), "", "{:.5g}"});
  for (const auto& [o, numbers] : run.worst) {
    std::vector<SheetCell> row{double(o.number),
                               SheetCell(to_string(o.status), o.good ? Tone::plain : Tone::bad),
                               o.t,
                               o.height,
                               o.V_off,
                               o.gamma_off * degrees,
                               o.theta_most * degrees,
                               o.miss};
    row.insert(row.end(), numbers.begin(), numbers.end());
    sheet.rows.push_back(std::move(row));
  }
  return sheet;
}

namespace {

// The share of good flights, and how flights end.
std::string shares_in_words(const MonteCarlo& run, const TextStyle& style) {
  if (!run.message.empty()) return wrapped("no flight: " + run.message, 0, style.width);
  std::string line = fmt::format(
      "{} of {} flights succeeded: {:.4g} % (95 % confidence interval {:.4g} to {:.4g} %)",
      run.good, run.flown, 100 * run.share.share, 100 * run.share.lower, 100 * run.share.upper);
  if (run.interrupted) line += fmt::format(" (interrupted; {} were requested)", run.asked);
  std::string text = wrapped(
      toned(line, run.good == run.flown ? Tone::good : Tone::doubtful, style), 0, style.width);
  std::string ends;
  for (std::size_t k = 0; k < run.ends.size(); ++k)
    if (run.ends[k] > 0)
      ends += fmt::format("{}{} {}", ends.empty() ? "outcomes: " : ", ", run.ends[k],
                          to_string(FlightStatus(k)));
  std::ranges::replace(ends, '_', ' ');
  if (!ends.empty()) text += wrapped(ends, 0, style.width);
  return text;
}

Sheet worst_flights(const MonteCarlo& run) {
  Sheet worst = monte_carlo_sheet(run);
  constexpr double early = 1e6;  // Outcome::miss
  if (run.worst.front().outcome.miss >= early)
    worst.notes.push_back(
        "an error above a million tolerances means that the flight ended early; the earlier, the "
        "larger");
  return worst;
}

}  // namespace

std::string monte_carlo_text(const MonteCarlo& run, const TextStyle& style) {
  const std::string text = shares_in_words(run, style);
  if (!run.message.empty() || run.worst.empty()) return text;
  return text + "\nThe worst of them:\n" + as_text(worst_flights(run), style);
}

std::vector<Sheet> monte_carlo_document(const MonteCarlo& run) {
  std::vector<Sheet> sheets{paragraph_sheet(shares_in_words(run, unwrapped))};
  if (!run.message.empty() || run.worst.empty()) return sheets;
  sheets.push_back(worst_flights(run));
  sheets.back().title = "The worst flights";
  return sheets;
}

std::string monte_carlo_json(const MonteCarlo& run) {
  ordered_json root{{"asked", run.asked},
                    {"flown", run.flown},
                    {"good", run.good},
                    {"share", run.share.share},
                    {"lower", run.share.lower},
                    {"upper", run.share.upper},
                    {"interrupted", run.interrupted},
                    {"message", run.message}};
  for (std::size_t k = 0; k < run.ends.size(); ++k)
    root["ends"][to_string(FlightStatus(k))] = run.ends[k];
  root["worst"] = ordered_json::array();
  for (const auto& [o, numbers] : run.worst) {
    ordered_json one{{"number", o.number},
                     {"status", to_string(o.status)},
                     {"good", o.good},
                     {"t", o.t},
                     {"height", o.height},
                     {"V_off", o.V_off},
                     {"gamma_off_deg", o.gamma_off * degrees},
                     {"theta_most_deg", o.theta_most * degrees},
                     {"miss", o.miss}};
    for (std::size_t k = 0; k < numbers.size(); ++k) one["scattered"][run.names[k]] = numbers[k];
    root["worst"].push_back(std::move(one));
  }
  return root.dump(2) + "\n";
}

}  // namespace tiltrim
