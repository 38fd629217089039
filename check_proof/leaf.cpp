#include "check_proof/leaf.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tiltrim::checking {

bool unbalanced(const Statement& s, const Side& side, std::size_t numbers, const Region& region,
                const std::array<double, 3>& weights) {
  std::array<Form, 3> y;
  for (std::size_t i = 0; i < 3; ++i) {
    const Bounds& of = region[i];
    y[i] = Form::variable(halved(Ball(of.lower) + Ball(of.upper)),
                          halved(Ball(of.upper) - Ball(of.lower)), numbers + i, numbers + 3);
  }
  const Numbers& a = side.numbers;
  const Form alpha = y[0] - a.gamma, none;
  const Form &a1s = side.cyclic ? y[2] : none, &delta_e = side.cyclic ? none : y[2];
  const Polars<Form> polar = (*s.polar)(alpha);
  const Form V_rate = speed_rate(a, polar, a.V, a.gamma, alpha, y[1], a1s);
  const Rates<Form> rates =
      airframe(a, polar, a.V, a.gamma, alpha, none, y[1], a1s, delta_e, V_rate);
  const Form sum =
      Form(weights[0]) * rates.V + Form(weights[1]) * rates.gamma + Form(weights[2]) * rates.q;
  const Ball all = range(sum);
  return all.is_positive() || all.is_negative();
}

namespace {

// A box within a leaf's, and d of the leaf's record there.
struct Part {
  Box box;
  std::vector<Form> d;
};

Part part_of(const Box& whole, const Box& box) {
  Part part{box, {}};
  for (std::size_t k = 0; k < box.size(); ++k) {
    const Ball m((whole[k].lower + whole[k].upper) / 2);
    Ball r = Ball(whole[k].upper) - m;
    if (const Ball other = m - Ball(whole[k].lower); less(r, other)) r = other;
    const Ball middle = halved(Ball(box[k].lower) + Ball(box[k].upper));
    const Ball half = halved(Ball(box[k].upper) - Ball(box[k].lower));
    part.d.push_back(Form::variable((middle - m) / r, half / r, k, box.size()));
  }
  return part;
}

using Names = std::array<std::string_view, 3>;
constexpr Names integrals{"theta", "energy_integral", "distribution_integral"};
constexpr Names actuators{"theta", "theta0", "deflection"};
constexpr std::array<std::size_t, 3> unknown_state{2, 4, 5};

using Tube = std::array<Form, 3>;

// z + S d
Tube centre_of(const Record& record, const Part& part) {
  Tube line;
  for (std::size_t i = 0; i < 3; ++i) {
    line[i] = Form(record.z[i]);
    for (std::size_t k = 0; k < part.d.size(); ++k) line[i] += Form(record.S[i][k]) * part.d[k];
  }
  return line;
}

Form widened(Form by, const Ball& radius) {
  by.rest = upper(by.rest + magnitude(radius));
  return by;
}

std::array<Form, 6> states(const Tube& tube) {
  std::array<Form, 6> x;
  for (std::size_t i = 0; i < 3; ++i) x[unknown_state[i]] = tube[i];
  return x;
}

std::array<Dual, 6> independent(const std::array<Form, 6>& values) {
  std::array<Dual, 6> x;
  for (std::size_t i = 0; i < 6; ++i) {
    x[i] = Dual(values[i]);
    x[i].slopes[i] = Form(1.0);
  }
  return x;
}

// V_err', gamma_err', q': zero at an equilibrium.
template <class S>
std::array<S, 3> balance(const Loop<S>& loop) {
  return {S(0.0) - loop.rates.V, S(0.0) - loop.rates.gamma, loop.rates.q};
}

using Matrix = std::array<std::array<Form, 3>, 3>;

// 2 C - (C G_z) C with the linear part of C G_z: near the inverse of G_z over the box, not only in
// its middle. Any matrix for each number of the box serves.
Matrix preconditioner(const Record& r, const std::array<Dual, 3>& slopes, std::size_t n) {
  Matrix all;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      Form turned, linear;
      for (std::size_t m = 0; m < 3; ++m)
        turned += Form(r.C[i][m]) * slopes[m].slopes[unknown_state[j]];
      turned.reserve(n);
      linear.reserve(n);
      linear.value() = midpoint(turned.value());
      for (std::size_t k = 0; k < n; ++k) linear.slope(k) = midpoint(turned.slope(k));
      const Form left = Form(i == j ? 2.0 : 0.0) - linear;
      for (std::size_t m = 0; m < 3; ++m) all[i][m] += left * Form(r.C[j][m]);
    }
  return all;
}

// K = -C G + (I - C G_z) ζ lies strictly inside the radii: then G has exactly one zero in the tube
// for each number of the box, and C is regular [101]. It lies in z + S d + K, which replaces the
// tube.
std::optional<std::string> krawczyk(const Record& r, const Names& names, const Loop<Form>& centre,
                                    const Loop<Dual>& over, Tube& tube) {
  const std::array<Form, 3> G = balance(centre);
  const std::array<Dual, 3> slopes = balance(over);
  const Matrix C = preconditioner(r, slopes, tube[0].n);
  for (std::size_t i = 0; i < 3; ++i) {
    Form step;
    for (std::size_t j = 0; j < 3; ++j) step += C[i][j] * G[j];
    Ball around;
    for (std::size_t j = 0; j < 3; ++j) {
      Form left(i == j ? 1.0 : 0.0);
      for (std::size_t m = 0; m < 3; ++m) left -= C[i][m] * slopes[m].slopes[unknown_state[j]];
      around += magnitude(range(left)) * Ball(r.Z[j]);
    }
    const Ball image = magnitude(range(step)) + around;
    if (!less(image, Ball(r.Z[i])))
      return fmt::format(
          "no equilibrium is proved: the image of the tube in {} has radius {:.6g}, the tube "
          "{:.6g}",
          names[i], double_above(image), r.Z[i]);
    tube[i] = widened(tube[i] - step, around);
  }
  return {};
}

std::optional<std::string> beyond_limits(const Statement& s, const Loop<Dual>& over,
                                         const Form& theta) {
  const auto check = [](const char* name, const Bounds& limits,
                        const Form& value) -> std::optional<std::string> {
    const Ball all = range(value);
    if (less_equal(Ball(limits.lower), all) && less_equal(all, Ball(limits.upper))) return {};
    return fmt::format("{} is not within its limits: {:.9g} to {:.9g}", name, double_below(all),
                       double_above(all));
  };
  if (auto failed = check("theta", s.theta, theta)) return failed;
  if (auto failed = check("theta0", s.theta0, over.theta0.value)) return failed;
  if (auto failed = check("a1s", s.a1s, over.a1s.value)) return failed;
  return check("delta_e", s.delta_e, over.delta_e.value);
}

// Whether theta0 and the deflection determine both integrals.
bool integrals_follow(const Side& side) {
  const auto nonzero = [](const Form& gain) {
    const Ball all = range(gain);
    return all.is_positive() || all.is_negative();
  };
  return (side.cyclic || side.elevator) && nonzero(side.numbers.K_Ei) && nonzero(side.numbers.K_Li);
}

std::optional<std::string> sector_refuted(const Pencil& p, const Ball& damping,
                                          const Record& record) {
  if (auto failed = excluded(p, ray_of(damping), record.ray))
    return "of the damping ratio: " + *failed;
  const std::optional<bool> less = less_damped(p, damping);
  if (!less) return "the damping of the roots is undecided";
  if (*less != record.less_damped)
    return fmt::format("{} root has less damping, the file states otherwise", *less ? "a" : "no");
  return {};
}

std::optional<std::string> refuted(const Statement& s, const Part& part, const Side& side,
                                   const Record& record) {
  if (!range(side.numbers.V).is_positive()) return "the airspeed may vanish";
  if (s.actuators && !integrals_follow(side)) return "the integrals do not follow the actuators";
  const Numbers& a = side.numbers;
  Tube tube = centre_of(record, part), wide = tube;
  for (std::size_t i = 0; i < 3; ++i) wide[i] = widened(wide[i], Ball(record.Z[i]));
  const std::array<Form, 6> line = states(tube);
  const std::array<Dual, 6> around = independent(states(wide));
  if (auto failed = s.actuators ? krawczyk(record, actuators, without_law(a, *s.polar, line),
                                           without_law(a, *s.polar, around), tube)
                                : krawczyk(record, integrals, closed_loop(a, *s.polar, line),
                                           closed_loop(a, *s.polar, around), tube))
    return failed;
  const Held held{tube[1], tube[2]};
  const Loop<Dual> loop =
      closed_loop(a, *s.polar, independent(states(tube)), s.actuators ? &held : nullptr);
  if (auto failed = beyond_limits(s, loop, tube[0])) return failed;
  const Pencil p = pencil(side.numbers, loop);
  const Ball sigma(s.margin);
  if (auto failed = excluded(p, line_at(sigma), record.line)) return failed;
  const std::optional<int> roots = roots_right(p, sigma);
  if (!roots) return "the roots right of the line cannot be counted";
  if (*roots != record.roots)
    return fmt::format("{} roots right of the line, the file states {}", *roots, record.roots);
  return s.damping > 0 ? sector_refuted(p, Ball(s.damping), record) : std::nullopt;
}

constexpr int most_halvings_of_regions = 12;

bool no_balance(const Statement& s, const Side& side, std::size_t numbers, const Region& region,
                const std::array<double, 3>& weights, int halvings) {
  if (unbalanced(s, side, numbers, region, weights)) return true;
  if (halvings == most_halvings_of_regions) return false;
  Region low = region, high = region;
  const std::size_t k = std::size_t(halvings % 3);
  const double middle = region[k].lower + (region[k].upper - region[k].lower) / 2;
  low[k].upper = high[k].lower = middle;
  return no_balance(s, side, numbers, low, weights, halvings + 1) &&
         no_balance(s, side, numbers, high, weights, halvings + 1);
}

// The tree over the region, from node `next` on.
std::optional<std::string> tree_refuted(const Statement& s, const Side& side, std::size_t numbers,
                                        const Exclusion& tree, std::size_t& next,
                                        const Region& region, int depth) {
  constexpr int deepest = 200;
  if (next >= tree.size() || depth > deepest) return "the tree of the exclusion is not complete";
  const Node node = tree[next++];
  if (node.split < 0) {
    if (no_balance(s, side, numbers, region, node.weights, 0)) return {};
    const auto& [theta, theta0, c] = region;
    return fmt::format(
        "an equilibrium is not excluded for theta in [{:.6g}, {:.6g}], theta0 in [{:.6g}, {:.6g}], "
        "{} in [{:.6g}, {:.6g}]",
        theta.lower, theta.upper, theta0.lower, theta0.upper, side.cyclic ? "a1s" : "delta_e",
        c.lower, c.upper);
  }
  if (node.split == (side.cyclic ? 3 : 2)) return "a split of an actuator that is not used";
  const auto k = std::min<std::size_t>(std::size_t(node.split), 2);
  if (!(region[k].lower < node.at && node.at < region[k].upper))
    return "a split of the exclusion lies outside its region";
  Region low = region, high = region;
  low[k].upper = high[k].lower = node.at;
  if (auto failed = tree_refuted(s, side, numbers, tree, next, low, depth + 1)) return failed;
  return tree_refuted(s, side, numbers, tree, next, high, depth + 1);
}

std::optional<std::string> refuted(const Statement& s, const Part& part, const Side& side,
                                   const Exclusion& tree) {
  if (!side.cyclic && !side.elevator) return "an exclusion needs the cyclic or the elevator alone";
  const Ball k_V = range(side.numbers.k_V);
  if (!k_V.is_positive() && !k_V.is_negative())
    return "k_V may vanish: then a speed error is possible";
  std::size_t next = 0;
  const Region limits{s.theta, s.theta0, side.cyclic ? s.a1s : s.delta_e};
  if (auto failed = tree_refuted(s, side, part.box.size(), tree, next, limits, 0)) return failed;
  if (next != tree.size()) return "the tree of the exclusion has nodes to spare";
  return {};
}

// Every side that may occur needs one piece of evidence.
template <class Evidence>
std::optional<std::string> sides_refuted(const Statement& s, const Part& part,
                                         const std::vector<Evidence>& all) {
  for (const Side& side : sides(s, part.box)) {
    std::string why = "there is no evidence";
    bool held = false;
    for (const Evidence& one : all) {
      const auto failed = refuted(s, part, side, one);
      if ((held = !failed)) break;
      why = *failed;
    }
    if (!held) return side.name + ": " + why;
  }
  return {};
}

// Where the bounds over the whole box are too wide, those over its halves may do.
template <class Evidence>
std::optional<std::string> box_refuted(const Statement& s, const Box& whole, const Box& box,
                                       const std::vector<Evidence>& all, int halvings) {
  const auto failed = sides_refuted(s, part_of(whole, box), all);
  if (!failed || halvings == 0) return failed;
  std::size_t widest = 0;
  double share = 0;
  for (std::size_t k = 0; k < box.size(); ++k) {
    const double own = (box[k].upper - box[k].lower) / (whole[k].upper - whole[k].lower);
    if (own > share) {
      share = own;
      widest = k;
    }
  }
  const double middle = box[widest].lower + (box[widest].upper - box[widest].lower) / 2;
  if (!(box[widest].lower < middle && middle < box[widest].upper)) return failed;
  Box low = box, high = box;
  low[widest].upper = high[widest].lower = middle;
  if (auto within = box_refuted(s, whole, low, all, halvings - 1)) return within;
  return box_refuted(s, whole, high, all, halvings - 1);
}

}  // namespace

std::optional<std::string> refuted(const Statement& s, const Leaf& leaf, int halvings) {
  if (leaf.claim == Claim::undecided) return {};
  if (leaf.claim == Claim::no_trim)
    return box_refuted(s, leaf.box, leaf.box, leaf.exclusions, halvings);
  for (const Record& record : leaf.records)
    if ((record.roots == 0 && !record.less_damped) != (leaf.claim == Claim::stable))
      return fmt::format("a leaf with {} roots right of the line{} is not {}", record.roots,
                         record.less_damped ? " and some of less damping" : "",
                         leaf.claim == Claim::stable ? "stable" : "unstable");
  return box_refuted(s, leaf.box, leaf.box, leaf.records, halvings);
}

}  // namespace tiltrim::checking
