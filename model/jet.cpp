#include "model/jet.hpp"

#include <algorithm>
#include <utility>

namespace tiltrim {

namespace {

bool involves(const Jet& a, std::size_t directions) {
  for (std::size_t i = 0; i < std::min(directions, a.slope.size()); ++i)
    if (!a.slope[i].zero()) return true;
  return false;
}

// Not told by the ranges: a side if no unknown decides, else nothing.
bool side_of(const Jet& a, const Jet& b, int told) {
  Branches& sides = *current_branches;
  if (involves(a, sides.unknowns) || involves(b, sides.unknowns)) {
    if (told < 0) sides.blocked = true;
    sides.all.push_back(char(told == 1));
    return told == 1;
  }
  if (sides.next == sides.taken.size()) {
    sides.taken.push_back(char(told == 1));
    sides.open.push_back(char(told < 0));
    if (told < 0 && sides.replay) sides.blocked = true;
  } else if (told < 0 && !sides.open[sides.next]) {
    sides.blocked = true;  // its other outcome was not foreseen
  } else if (told >= 0 && !sides.free && sides.taken[sides.next] != char(told)) {
    sides.blocked = true;
  }
  const char outcome = sides.taken[sides.next++];
  sides.all.push_back(outcome);
  return outcome != 0;
}

// Mean-value forms of slopes and value about the middle of all directions, where their extents
// are known.
Jet tightened(Jet a) {
  const std::size_t n = a.slope.size();
  if (!current_branches || n != current_branches->extents.size()) return a;
  const std::vector<double>& extents = current_branches->extents;
  if (!a.bend.empty()) {
    std::vector<Interval> form = a.tilt;
    for (std::size_t i = 0, at = 0; i < n; ++i)
      for (std::size_t j = 0; j <= i; ++j, ++at) {
        if (a.bend[at].zero()) continue;
        const double m = magnitude(a.bend[at]);
        if (extents[j] > 0) form[i] += extents[j] * Interval(-m, m);
        if (j != i && extents[i] > 0) form[j] += extents[i] * Interval(-m, m);
      }
    for (std::size_t i = 0; i < n; ++i) a.slope[i] = both(a.slope[i], form[i]);
  }
  Interval form = a.centre;
  for (std::size_t i = 0; i < n; ++i) {
    const double w = extents[i];
    if (w > 0 && !a.slope[i].zero()) form += a.slope[i] * Interval(-w, w);
  }
  a.value = both(a.value, form);
  return a;
}

Jet scaled(const Jet& a, const Interval& by) {
  Jet c(a.value * by);
  c.slope.reserve(a.slope.size());
  c.bend.reserve(a.bend.size());
  for (const Interval& s : a.slope) c.slope.push_back(s * by);
  for (const Interval& s : a.bend) c.bend.push_back(s * by);
  for (const Interval& s : a.tilt) c.tilt.push_back(s * by);
  c.centre = a.centre * by;
  return c;
}

}  // namespace

bool below(const Jet& a, const Jet& b, bool or_equal) {
  const Interval &x = a.value, &y = b.value;
  int told = -1;
  if (or_equal ? x.upper() <= y.lower() : x.upper() < y.lower()) told = 1;
  if (or_equal ? x.lower() > y.upper() : x.lower() >= y.upper()) told = 0;
  if (current_branches) return side_of(a, b, told);
  return told == 1;
}

Jet operator-(const Jet& a) {
  Jet c(-a.value);
  c.slope.reserve(a.slope.size());
  c.bend.reserve(a.bend.size());
  for (const Interval& s : a.slope) c.slope.push_back(-s);
  for (const Interval& s : a.bend) c.bend.push_back(-s);
  for (const Interval& s : a.tilt) c.tilt.push_back(-s);
  c.centre = -a.centre;
  return c;
}

Jet operator+(const Jet& a, const Jet& b) {
  if (a.slope.empty() && !b.slope.empty()) return b + a;
  Jet c = a;
  c.value += b.value;
  c.centre += b.centre;
  if (b.slope.empty()) return c;
  for (std::size_t i = 0; i < c.slope.size(); ++i) c.slope[i] += b.slope[i];
  for (std::size_t i = 0; i < c.bend.size(); ++i) c.bend[i] += b.bend[i];
  for (std::size_t i = 0; i < c.tilt.size(); ++i) c.tilt[i] += b.tilt[i];
  return tightened(std::move(c));
}

Jet operator-(const Jet& a, const Jet& b) { return a + -b; }

Jet operator*(const Jet& a, const Jet& b) {
  if (&a == &b)
    return chain(a, [](const Interval& x) { return Jet::Taylor{square(x), 2.0 * x, 2.0}; });
  if (b.slope.empty()) return scaled(a, b.value);
  if (a.slope.empty()) return scaled(b, a.value);
  Jet c(a.value * b.value);
  c.centre = a.centre * b.centre;
  const std::size_t n = a.slope.size();
  c.slope.resize(n);
  c.bend.resize(a.bend.size());
  for (std::size_t i = 0; i < n; ++i) c.slope[i] = a.value * b.slope[i] + b.value * a.slope[i];
  for (std::size_t i = 0; i < a.tilt.size(); ++i)
    c.tilt.push_back(a.centre * b.tilt[i] + b.centre * a.tilt[i]);
  if (!a.bend.empty())
    for (std::size_t i = 0, at = 0; i < n; ++i)
      for (std::size_t j = 0; j <= i; ++j, ++at)
        c.bend[at] = (a.value * b.bend[at] + b.value * a.bend[at]) +
                     (a.slope[i] * b.slope[j] + a.slope[j] * b.slope[i]);
  return tightened(std::move(c));
}

Jet operator/(const Jet& a, const Jet& b) {
  const Interval g = Interval(1.0) / b.value;
  if (b.slope.empty()) return scaled(a, g);
  return a * chain(b, [](const Interval& x) {
           const Interval inverse = Interval(1.0) / x, g2 = square(inverse);
           return Jet::Taylor{inverse, -g2, 2.0 * inverse * g2};
         });
}

Jet chain(const Jet& a, const Jet::Taylor& over, const Jet::Taylor& centre) {
  Jet c(over.value);
  c.centre = centre.value;
  const std::size_t n = a.slope.size();
  c.slope.resize(n);
  c.bend.resize(a.bend.size());
  for (std::size_t i = 0; i < n; ++i) c.slope[i] = over.slope * a.slope[i];
  for (const Interval& s : a.tilt) c.tilt.push_back(centre.slope * s);
  if (a.bend.empty()) return tightened(std::move(c));
  for (std::size_t i = 0, at = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j, ++at)
      c.bend[at] = over.slope * a.bend[at] +
                   over.bend * (i == j ? square(a.slope[i]) : a.slope[i] * a.slope[j]);
  return tightened(std::move(c));
}

}  // namespace tiltrim
