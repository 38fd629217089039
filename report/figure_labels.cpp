// Places labels in a panel so that they cover neither curves nor each other.
#include <algorithm>
#include <cmath>
#include <optional>

#include "report/figure.hpp"

namespace tiltrim {

namespace {

using Point = std::array<double, 2>;

struct LabelBox {
  double left, right, bottom, top;
};

struct Segment {
  Point from, to;
};

bool overlap(const LabelBox& a, const LabelBox& b) {
  return a.left < b.right && b.left < a.right && a.bottom < b.top && b.bottom < a.top;
}

// Clips the segment by the box's four sides. (Liang and Barsky)
bool overlap(const LabelBox& box, const Segment& s) {
  double enter = 0.0, leave = 1.0;
  for (const int k : {0, 1}) {
    const double step = s.to[std::size_t(k)] - s.from[std::size_t(k)],
                 from = s.from[std::size_t(k)];
    const double lower = k == 0 ? box.left : box.bottom, upper = k == 0 ? box.right : box.top;
    if (step == 0.0) {
      if (from < lower || from > upper) return false;
      continue;
    }
    const double a = (lower - from) / step, b = (upper - from) / step;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

double share(const FigureAxis& axis, double value) {
  const Range& r = axis.range;
  if (axis.logarithmic) return std::log(value / r.lower) / std::log(r.upper / r.lower);
  return (value - r.lower) / (r.upper - r.lower);
}

struct Paper {
  const Panel& panel;
  double width, height;
  Point at(double x, double y) const {
    return {share(panel.x, x) * width, share(panel.y, y) * height};
  }
};

// Everything drawn except the thin lines that labels belong to: grids and limits.
std::vector<Segment> obstacles(const Paper& paper) {
  std::vector<Segment> all;
  for (const PlotCurve& c : paper.panel.curves) {
    if (c.colour == colour::limit) continue;
    const bool line = c.kind == PlotCurve::Kind::line;
    for (std::size_t i = 0; i + (line ? 1 : 0) < c.x.size(); ++i) {
      const std::size_t next = line ? i + 1 : i;
      const Point from = paper.at(c.x[i], c.y[i]), to = paper.at(c.x[next], c.y[next]);
      if (std::isfinite(from[0] + from[1] + to[0] + to[1])) all.push_back({from, to});
    }
  }
  return all;
}

LabelBox box_of(const PlacedLabel& label) {
  constexpr double apart = 0.8;  // from the next label
  const double width = text_width(label.text) + apart;
  return {label.x - (label.right ? width : 0), label.x + (label.right ? 0 : width), label.y - 0.6,
          label.y + 0.6};
}

}  // namespace

double text_width(const std::string& text) {
  constexpr double letter = 0.62;
  return letter * double(std::ranges::count_if(
                      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::vector<PlacedLabel> placed_labels(const Panel& panel, double width, double height) {
  const Paper paper{panel, width, height};
  const std::vector<Segment> drawn = obstacles(paper);
  std::vector<PlacedLabel> placed;
  std::vector<LabelBox> taken;
  const auto covered = [&](const LabelBox& box) {
    const auto over = [&](const auto& other) { return overlap(box, other); };
    return std::ranges::count_if(drawn, over) + 1000 * std::ranges::count_if(taken, over);
  };
  for (const FigureLabel& label : panel.labels) {
    std::optional<PlacedLabel> best;
    auto least = label.needed ? std::ptrdiff_t(1'000'000) : std::ptrdiff_t(1);
    for (const auto& [x, y] : label.at)
      for (const bool right : {false, true})
        for (const double up : {0.8, -0.8}) {
          if (label.leftward && !right) continue;
          constexpr double apart = 0.35;
          const Point at = paper.at(x, y);
          const PlacedLabel here{at[0] + (right ? -apart : apart), at[1] + up, right, label.text};
          const LabelBox box = box_of(here);
          if (!(box.left >= 0 && box.right <= width && box.bottom >= 0 && box.top <= height))
            continue;
          if (const std::ptrdiff_t over = covered(box); over < least) least = over, best = here;
        }
    if (!best) continue;
    placed.push_back(*best);
    taken.push_back(box_of(*best));
  }
  return placed;
}

}  // namespace tiltrim
