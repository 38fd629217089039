// Figures of one condition: participation, Bode plots, disk margins.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "report/figure_parts.hpp"

namespace tiltrim::figures {

using Eigen::Index;

namespace {

Figure participation_figure(const ConditionReport& c, const std::string& id) {
  Figure figure{
      "participation_" + id,
      fmt::format("Participation of the states in each mode: {}", c.answer.condition.name),
      "Participation of the states in each mode. ",
      "",
      {}};
  std::vector<const Mode*> shown;
  for (const Mode& m : c.modes->modes)
    if (m.eigenvalue.imag() >= 0) shown.push_back(&m);
  const std::size_t n = shown.size();
  Panel panel{{"share of each state", {0, 1}, false, {}, ""},
              {"", {0.4, double(n) + 0.6}, false, {}, ""},
              {},
              {},
              {},
              2.2 * double(n) + 1,
              ""};
  for (Index k = 0; k < Index(c.linear->states.size()); ++k)
    panel.boxes.push_back(
        {c.linear->states[std::size_t(k)].name, curve_colour(std::size_t(k)), true, {}});
  for (std::size_t i = 0; i < n; ++i) {
    const Mode& m = *shown[i];
    const double y = double(n - i);
    panel.y.ticks.emplace_back(
        y, fmt::format(
               "{:#.3g}{}", m.eigenvalue.real(),
               m.eigenvalue.imag() > 0 ? fmt::format(" ± {:#.3g}i", m.eigenvalue.imag()) : ""));
    double from = 0.0;
    for (Index k = 0; k < m.participation.size(); ++k) {
      panel.boxes[std::size_t(k)].corners.push_back(
          {from, from + m.participation[k], y - 0.35, y + 0.35});
      from += m.participation[k];
    }
    figure.alternative += fmt::format("{}: {:.4g}, {}. ", i + 1, m.eigenvalue.real(), m.name);
  }
  figure.panels.push_back(panel);
  return figure;
}

Track bode_track(const LoopsAnswer& c, const std::string& id) {
  Track track{"bode_" + id, "frequency, " + c.trimmed.condition.name, {}, {}};
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    if (track.columns.empty())
      track.columns.push_back({"parameter", "frequency", "rad/s", l.bode.frequency});
    Track::Column magnitude{l.actuator + "_dB", "|L| of " + l.actuator, "dB", {}},
        phase{l.actuator + "_phase_deg", "phase of " + l.actuator, "degrees", {}};
    for (const double v : l.bode.magnitude) magnitude.values.push_back(20 * std::log10(v));
    for (const double v : l.bode.phase) phase.values.push_back(v * degrees);
    track.columns.insert(track.columns.end(), {magnitude, phase});
  }
  return track;
}

// A line from a loop's curve to 0 dB or -180°, where it crosses the other of them, and the margin.
void add_margin(Panel& panel, const PlotCurve& curve, double frequency, double from, double to,
                const std::string& words) {
  const Range& x = panel.x.range;
  if (!(frequency >= x.lower && frequency <= x.upper) || !std::isfinite(from + to)) return;
  PlotCurve margin = curve;
  margin.title.clear();
  margin.x_key.clear();
  margin.y_key.clear();
  margin.dash = 1;
  margin.width = 1.2;
  margin.x = {frequency, frequency};
  margin.y = {from, to};
  PlotCurve end = margin;
  end.kind = PlotCurve::Kind::points;
  end.dash = 7;
  end.width = 0.5;
  panel.curves.insert(panel.curves.end(), {margin, end});
  FigureLabel label{{}, words};
  for (const double share : {1.0, 0.0, 0.5, 0.75, 0.25})
    label.at.push_back({frequency, from + share * (to - from)});
  panel.labels.push_back(label);
}

// Interpolated over the logarithm of the frequency.
double value_at(const PlotCurve& curve, double frequency) {
  const auto next = std::ranges::lower_bound(curve.x, frequency) - curve.x.begin();
  if (next == 0 || next == std::ssize(curve.x)) return std::numeric_limits<double>::quiet_NaN();
  const auto k = std::size_t(next);
  const double t = std::log(frequency / curve.x[k - 1]) / std::log(curve.x[k] / curve.x[k - 1]);
  return curve.y[k - 1] + t * (curve.y[k] - curve.y[k - 1]);
}

double nearest_level(double phase) { return -180 + 360 * std::round((phase + 180) / 360); }

void add_margins(const Margins& m, const PlotCurve& gain_curve, const PlotCurve& phase_curve,
                 Panel& gain, Panel& phase) {
  if (!m.stable()) return;
  for (const auto& [factor, at] :
       {std::pair{m.gain_up, m.gain_up_at}, {m.gain_down, m.gain_down_at}}) {
    const double change = 20 * std::log10(factor);
    add_margin(gain, gain_curve, at, 0, -change, fmt::format("{:+.3g} dB", change));
  }
  const double phase_there = value_at(phase_curve, m.phase_at);
  add_margin(phase, phase_curve, m.phase_at, nearest_level(phase_there), phase_there,
             fmt::format("{:.3g}°", m.phase * degrees));
}

Figure bode_figure(const LoopsAnswer& c, const Track& track, const std::string& id) {
  const std::vector<double>& frequency = track.columns.front().values;
  FigureAxis x{"ω [rad/s]", {frequency.front(), frequency.back()}, true, {}, "parameter"};
  std::vector<double> gains, phases;
  Panel gain{x, {"|L| [dB]", {}, false, {}, "gain"}, {}, {}, {}, 12.0, ""},
      phase{x, {"phase of L [°]", {}, false, {}, "phase"}, {}, {}, {}, 12.0, ""};
  std::string words;
  std::size_t k = 0;
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    const auto add = [&](Panel& panel, const std::string& key, const std::string& title,
                         std::vector<double>& all) {
      const Track::Column& y = *column(track, key);
      PlotCurve curve = nth_curve(k, title);
      curve.x = frequency;
      curve.y = y.values;
      curve.x_key = "parameter";
      curve.y_key = key;
      panel.curves.push_back(curve);
      all.insert(all.end(), y.values.begin(), y.values.end());
      return curve;
    };
    const PlotCurve of_gain = add(gain, l.actuator + "_dB", l.actuator, gains),
                    of_phase = add(phase, l.actuator + "_phase_deg", "", phases);
    add_margins(l.margins, of_gain, of_phase, gain, phase);
    words += fmt::format("{}{}", words.empty() ? "" : ", ", l.actuator);
    ++k;
  }
  gains.push_back(0);
  phases.push_back(-180);
  gain.y.range = around(gains);
  phase.y.range = around(phases);
  gain.x.label.clear();
  gain.curves.push_back(level_line(x.range, 0));
  for (double level = nearest_level(phase.y.range.lower); level <= phase.y.range.upper;
       level += 360)
    if (level >= phase.y.range.lower) phase.curves.push_back(level_line(x.range, level));
  return {
      "bode_" + id,
      fmt::format("Bode plot of each loop broken at its actuator, with the gain and phase margins "
                  "that lie in this range: {}",
                  c.trimmed.condition.name),
      fmt::format("Bode plot of the loops of {}: {}. Their margins are in the table.",
                  c.trimmed.condition.name, words),
      track.name,
      {gain, phase}};
}

// Simultaneous gain and phase variations within the disk margin: (1 + z)/(1 - z), |z| < disk/2.
// [43]
Figure disk_figure(const LoopsAnswer& c, const std::string& id) {
  Panel panel{{"change of phase [°]", {}, false, {}, ""},
              {"change of gain [dB]", {}, false, {}, ""},
              {},
              {},
              {},
              16.0,
              ""};
  std::vector<double> xs{0}, ys{0};
  std::string words;
  std::size_t k = 0;
  for (const ActuatorLoop& l : c.loops) {
    if (!l.in_use) continue;
    const std::size_t at = k++;
    if (!l.margins.stable() || !std::isfinite(l.margins.disk)) continue;
    PlotCurve border = nth_curve(at, fmt::format("{}: disk {:.3f}", l.actuator, l.margins.disk));
    const double radius = std::min(l.margins.disk / 2, 0.98);
    for (int i = 0; i <= 720; ++i) {
      const std::complex<double> z = std::polar(radius, 2 * std::numbers::pi * i / 720.0);
      const std::complex<double> change = (1.0 + z) / (1.0 - z);
      border.x.push_back(std::arg(change) * degrees);
      border.y.push_back(20 * std::log10(std::abs(change)));
    }
    xs.insert(xs.end(), border.x.begin(), border.x.end());
    ys.insert(ys.end(), border.y.begin(), border.y.end());
    words += fmt::format("{}{} {:.3f}", words.empty() ? "" : ", ", l.actuator, l.margins.disk);
    panel.curves.push_back(border);
  }
  panel.x.range = around(xs, 0.1);
  panel.y.range = around(ys, 0.1);
  panel.curves.push_back(level_line(panel.x.range, 0));
  return {"disk_" + id,
          fmt::format(
              "Changes of gain and phase that each loop tolerates together, by its disk margin: {}",
              c.trimmed.condition.name),
          fmt::format("Disk margins of {}: {}.", c.trimmed.condition.name, words),
          "",
          {panel}};
}

}  // namespace

void add_participation(const ConditionReport& condition, const std::string& id,
                       ReportFigures& all) {
  all.figures.push_back(participation_figure(condition, id));
}

void add_loops(const LoopsAnswer& loops, const std::string& id, ReportFigures& all) {
  const Track track = bode_track(loops, id);
  if (track.columns.empty()) return;
  all.figures.push_back(bode_figure(loops, track, id));
  if (loops.modes.verdict == Verdict::stable) all.figures.push_back(disk_figure(loops, id));
  all.tracks.push_back(track);
}

}  // namespace tiltrim::figures
