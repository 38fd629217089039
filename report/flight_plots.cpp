// The paper's Figures 5-9 of a flight, drawn by gnuplot.
#include <fmt/core.h>

#include "report/figure.hpp"
#include "report/flights.hpp"

namespace tiltrim {

namespace {

struct PaperLine {
  const char *column, *title;
  int style;  // of the script
};

struct PaperFigure {
  const char *name, *title, *x, *x_label, *y_label;
  std::vector<PaperLine> lines;
};

const std::vector<PaperFigure>& figures() {
  static const std::vector<PaperFigure> all{
      {"fig5_angles",
       "Pitch and flight path",
       "time",
       "time [s]",
       "[rad]",
       {{"theta_deg", "pitch θ", 1},
        {"gamma_deg", "path γ", 2},
        {"gamma_commanded_deg", "path commanded", 3}}},
      {"fig6_speeds",
       "Vertical and horizontal speed",
       "time",
       "time [s]",
       "[m/s]",
       {{"climb_rate", "vertical", 1}, {"ground_speed", "horizontal", 2}}},
      {"fig7_energy_errors",
       "Energy rate and distribution rate errors",
       "time",
       "time [s]",
       "[-]",
       {{"He", "He", 1}, {"Le", "Le", 2}}},
      {"fig8_path",
       "Height over distance",
       "distance",
       "distance [m]",
       "height [m]",
       {{"height", "", 1}}},
      {"fig9_height", "Height over time", "time", "time [s]", "height [m]", {{"height", "", 1}}}};
  return all;
}

// Angles are drawn in radians, as in the paper.
std::string value(const std::string& column) {
  const bool angle = column.ends_with("_deg");
  return fmt::format("(column('{}'){})", column, angle ? "*pi/180" : "");
}

std::string drawn(const PaperFigure& figure) {
  std::string plot;
  for (const PaperLine& line : figure.lines)
    plot +=
        fmt::format("{}'flight.csv' using {}:{} with lines ls {} {}",
                    plot.empty() ? "" : ", \\\n  ", value(figure.x), value(line.column), line.style,
                    *line.title == '\0' ? "notitle" : "title " + gnuplot_text(line.title));
  return plot;
}

}  // namespace

std::vector<std::string> flight_plot_names() {
  std::vector<std::string> names;
  for (const PaperFigure& f : figures()) names.emplace_back(f.name);
  return names;
}

std::string flight_plots(const FlightReport& report) {
  std::string script =
      "# Figures 5-9 of the paper for this flight: gnuplot figures.gp\n"
      "set encoding utf8\n"
      "set datafile separator ','\n"
      "set grid lc rgb '#d9dde2' lt 1\n"
      "set key tmargin left Left reverse horizontal samplen 3 width 2\n"
      "set border 3\n"
      "set tics nomirror\n"
      "# Colours that colour-blind people tell apart, and dashes that survive black-and-white "
      "print.\n"
      "set style line 1 lc rgb '#1c1cc4' lw 2 dt 1\n"
      "set style line 2 lc rgb '#b88a00' lw 2 dt 2\n"
      "set style line 3 lc rgb '#555555' lw 1.5 dt 3\n";
  // Marks the handovers.
  int arrow = 0;
  std::string marks;
  if (report.flown)
    for (const FlightEvent& e : report.flown->events)
      if (e.kind == FlightEventKind::hand_over && arrow < 5)
        marks += fmt::format(
            "set arrow {0} from {1:.6f}, graph 0 to {1:.6f}, graph 1 nohead dt 4 lc rgb '#777777'\n"
            "set label {0} 'handover {2}' at {1:.6f}, graph 0.03 offset 0.5,0 tc rgb '#555555' "
            "font ',10'\n",
            ++arrow, e.t, e.what);
  for (const PaperFigure& f : figures()) {
    const bool over_time = std::string(f.x) == "time";
    script += "\nunset arrow\nunset label\n" + (over_time ? marks : std::string());
    script += fmt::format("set title {} noenhanced\n",
                          gnuplot_text(fmt::format("{} ({})", f.title, report.name)));
    script += fmt::format("set xlabel {}\nset ylabel {}\n", gnuplot_text(f.x_label),
                          gnuplot_text(f.y_label));
    script += f.lines.size() > 1 ? "set key\n" : "unset key\n";
    script += "set xrange [0:*]\n";
    const std::string plot = drawn(f);
    script += fmt::format(
        "set terminal svg size 760,420 dynamic font 'sans-serif,13' background rgb 'white'\n"
        "set output '{0}.svg'\nplot {1}\n"
        "set terminal pngcairo size 1140,630 fontscale 1.2 font 'sans-serif,13'\n"
        "set output '{0}.png'\nreplot\n",
        f.name, plot);
  }
  return script + "set output\n";
}

}  // namespace tiltrim
