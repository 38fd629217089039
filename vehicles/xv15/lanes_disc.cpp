// Sums over a rotor disc, the azimuths on SIMD lanes. No product is fused with a sum and the lanes
// are summed in one order, so that every instruction set gives the same bits.
#include "runtime/lanes.hpp"
#include "vehicles/xv15/disc_kernel.hpp"

namespace tiltrim::TILTRIM_LANES {

namespace {

using xv15::AxisView, xv15::Corner, xv15::Element, xv15::SectionView, xv15::Silence;

constexpr std::size_t count = xv15::azimuth_count;
constexpr double pi = 3.14159265358979323846;
using Number = Pack<count / lane_count>;
using Mask = PackMask<count / lane_count>;
using Two [[gnu::vector_size(16), gnu::may_alias]] = double;  // lift, drag
using Eight = double[count];

// Moshier's rational approximation of atan on [0, 0.66], to 2e-16 (Cephes, atan.c); beyond it,
// about 45 degrees.
[[gnu::always_inline]] inline Number first_octant(const Number& least, const Number& most) {
  const Mask beyond = most * 0.66 < least;
  // atan(y/x) = pi/4 + atan((y - x)/(y + x))
  const Number t = choose(beyond, least - most, least) / choose(beyond, least + most, most);
  const Number z = t * t;
  const Number P = ((((z * -8.750608600031904122785e-1 - 1.615753718733365076637e1) * z -
                      7.500855792314704667340e1) *
                         z -
                     1.228866684490136173410e2) *
                        z -
                    6.485021904942025371773e1) *
                   z;
  const Number Q = ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z +
                     4.328810604912902668951e2) *
                        z +
                    4.853903996359136964868e2) *
                       z +
                   1.945506571482613964425e2;
  return choose(beyond, Number(pi / 4), Number(0.0)) + (t + t * P / Q);
}

// atan2(y, x), for y and x that do not both vanish.
[[gnu::always_inline]] inline Number angle_of(const Number& y, const Number& x) {
  const Number up = abs(y), along = abs(x);
  const Mask steep = along < up;
  const Number octant = first_octant(choose(steep, along, up), choose(steep, up, along));
  const Number quadrant = choose(steep, Number(pi / 2) - octant, octant);
  const Number half = choose(x < Number(0.0), Number(pi) - quadrant, quadrant);
  return choose(y < Number(0.0), -half, half);
}

// The nearest inner entry, the distance d from it, |d| with its rounded kink and its slope.
struct Placed {
  std::size_t entry[count];
  alignas(64) Eight d, g, slope, moves;
};

[[gnu::always_inline]] inline bool place(const AxisView& axis, Number x, Placed& p) {
  const Mask held = axis.hold ? Number(axis.to) < x : x < x;
  x = choose(held, Number(axis.to), x);
  if (any_of(!(Number(axis.from) <= x && x <= Number(axis.to)))) return false;
  alignas(64) Eight at, steps, width, per_width;
  x.store(at);
  ((x - axis.from) * axis.per_step).store(steps);
  for (std::size_t l = 0; l < count; ++l) {
    std::size_t k = axis.nearest[std::size_t(int(steps[l]))];
    k += at[l] > axis.corners[k].until;
    const Corner& corner = axis.corners[k];
    p.entry[l] = k;
    at[l] = corner.at;
    width[l] = corner.width;
    per_width[l] = corner.per_width;
  }
  Number middle, w, per_w;
  middle.load(at);
  w.load(width);
  per_w.load(per_width);
  const Number d = x - middle, whole = d * per_w;
  const Number low = max(whole, Number(-1.0)), t = choose(Number(1.0) < low, Number(1.0), low);
  const Number t2 = t * t;
  // Outside the corner its polynomial stays at the corner's end.
  const Number g = w * t2 * ((t2 * 0.375 - 1.25) * t2 + 1.875) + max(abs(d) - w, Number(0.0));
  d.store(p.d);
  g.store(p.g);
  (t * ((t2 * 2.25 - 5.0) * t2 + 3.75)).store(p.slope);
  choose(held, Number(0.0), Number(1.0)).store(p.moves);
  return true;
}

// Lift and drag coefficients, their slopes with incidence [1/rad] and Mach.
struct Coefficients {
  Number value[2], alpha[2], mach[2];
};

[[gnu::always_inline]] inline void look_up(const SectionView& section, const Placed& mach,
                                           const Placed& alpha, Coefficients& c) {
  alignas(64) double value[2][count], by_alpha[2][count], by_mach[2][count];
  for (std::size_t l = 0; l < count; ++l) {
    const auto* const cell = reinterpret_cast<const Two*>(
        section.cells + (mach.entry[l] * section.columns + alpha.entry[l]) * 18);
    const double d = alpha.d[l], g = alpha.g[l], slope = alpha.slope[l];
    const Two V0 = cell[0] + d * cell[1] + g * cell[2], W0 = cell[1] + slope * cell[2];
    const Two V1 = cell[3] + d * cell[4] + g * cell[5], W1 = cell[4] + slope * cell[5];
    const Two V2 = cell[6] + d * cell[7] + g * cell[8], W2 = cell[7] + slope * cell[8];
    const Two at = V0 + mach.d[l] * V1 + mach.g[l] * V2;
    const Two with_alpha = W0 + mach.d[l] * W1 + mach.g[l] * W2;
    const Two with_mach = mach.moves[l] * (V1 + mach.slope[l] * V2);
    for (std::size_t j = 0; j < 2; ++j) {
      value[j][l] = at[j];
      by_alpha[j][l] = with_alpha[j];
      by_mach[j][l] = with_mach[j];
    }
  }
  for (std::size_t j = 0; j < 2; ++j) {
    c.value[j].load(value[j]);
    c.alpha[j].load(by_alpha[j]);
    c.alpha[j] = c.alpha[j] * (180 / pi);
    c.mach[j].load(by_mach[j]);
  }
}

// Sums over the elements of a blade: forces F_z, F_x over rho/2 times powers of r, and their slopes
// with U_T, U_P and pitch.
struct RadialSums {
  Number force[2][2];                 // [r^0, r^1][z, x]
  Number along[3][2], through[3][2];  // r^0 to r^2
  Number pitch[2][2];
};

template <std::size_t powers>
[[gnu::always_inline]] inline void add(Number (&sum)[powers][2], std::size_t j, const Number& G,
                                       double r) {
  sum[0][j] = sum[0][j] + G;
  sum[1][j] = sum[1][j] + G * r;
  if constexpr (powers == 3) sum[2][j] = sum[2][j] + G * (r * r);
}

struct Flow {
  double rotation, sound;
  Number along, through, swing, pitch;  // U_T = rotation r + along,  U_P = through + swing r
};

// Forces over rho/2 of an element, along the thrust and against the rotation:
//   F_z = U (cl U_T - cd U_P) c dr,  F_x = U (cl U_P + cd U_T) c dr,  alpha = theta - phi
[[gnu::always_inline]] inline Silence add_element(const Element& e, const Flow& f,
                                                  const SectionView& section, RadialSums& sum) {
  const Number T = f.along + f.rotation * e.r, P = f.through + f.swing * e.r;
  const Number U = sqrt(T * T + P * P), mach = U * (1 / f.sound);
  const Number a = f.pitch + e.twist - angle_of(P, T);
  const Number turned_back = choose(a < Number(0.0), a + 2 * pi, a - 2 * pi);
  const Number alpha = choose(Number(pi) < abs(a), turned_back, a) * (180 / pi);
  Placed by_mach, by_alpha;
  const bool known = place(section.mach, mach, by_mach);
  if (!known || !place(section.alpha, alpha, by_alpha)) {
    alignas(64) Eight at;
    (known ? alpha : mach).store(at);
    const AxisView& axis = known ? section.alpha : section.mach;
    std::size_t l = 0;
    while (l + 1 < count && at[l] >= axis.from && (at[l] <= axis.to || axis.hold)) ++l;
    return {true, !known, e.section, at[l]};
  }
  Coefficients c;
  look_up(section, by_mach, by_alpha, c);
  const Number area = e.chord * e.dr;
  const Number size = area * U, share = area / U, per_a = mach;
  for (std::size_t j = 0; j < 2; ++j) {
    // The other coefficient comes in by the inflow angle: -cd for F_z, cl for F_x.
    const double sign = j == 0 ? -1 : 1;
    const auto turned = [&](const Number(&by)[2]) __attribute__((always_inline)) {
      return by[j] * T + by[1 - j] * P * sign;
    };
    // alpha' = (P, -T)/U²,  Mach' = (T, P)/(U a)
    const Number force = turned(c.value), with_alpha = turned(c.alpha),
                 all = force + turned(c.mach) * per_a;
    add(sum.force, j, size * force, e.r);
    add(sum.along, j, share * (T * all + P * with_alpha) + size * c.value[j], e.r);
    add(sum.through, j, share * (P * all - T * with_alpha) + size * c.value[1 - j] * sign, e.r);
    add(sum.pitch, j, size * with_alpha, e.r);
  }
  return {};
}

[[gnu::always_inline]] inline double mean(const Number& x) {
  alignas(64) Eight at;
  x.store(at);
  const auto two = [&](std::size_t k) { return Two{at[k], at[k + 1]}; };
  const Two sum = (two(0) + two(4)) + (two(2) + two(6));
  return (sum[0] + sum[1]) * (1.0 / count);
}

// Thrust and in-plane force, or flap moments and torque, of [z, x].
struct Disc {
  Number s, c, flap;
  [[gnu::always_inline]] void write(std::size_t m, const Number& z, const Number& x,
                                    double* to) const {
    if (m == 0) {
      to[0] = mean(z);
      to[1] = mean(x * s - z * (flap * c));
    } else {
      to[2] = mean(x);
      to[3] = mean(z * s) * 2;
      to[4] = mean(z * c) * 2;
    }
  }
};

constexpr double diagonal = 0.70710678118654752440;
constexpr double sines[count]{0, diagonal, 1, diagonal, 0, -diagonal, -1, -diagonal};
constexpr double cosines[count]{1, diagonal, 0, -diagonal, -1, -diagonal, 0, diagonal};

}  // namespace

}  // namespace tiltrim::TILTRIM_LANES

namespace tiltrim {

using namespace TILTRIM_LANES;

//   U_T = Omega r + V_e sin psi
//   U_P = V_n + v (1 + k_x r/R cos psi) + r (beta' - q cos psi) + V_e beta cos psi
template <>
xv15::Silence disc_sums<InstructionSet::TILTRIM_SET>(const xv15::DiscTask& t) {
  Disc disc;
  disc.s.load(sines);
  disc.c.load(cosines);
  const Number s = disc.s, c = disc.c;
  const Number flap = -(c * t.a1) - s * t.b1, tilt = s * t.a1 - c * t.b1;
  disc.flap = flap;
  const Flow flow{t.omega,
                  t.sound,
                  s * t.V_e,
                  flap * c * t.V_e + t.level,
                  tilt * t.omega + c * t.cosine,
                  Number(t.theta_75) - s * t.B1 - flap * t.tan_delta3};
  RadialSums sum;
  for (auto* all : {&sum.force, &sum.pitch})
    for (auto& row : *all) row[0] = row[1] = 0.0;
  for (auto* all : {&sum.along, &sum.through})
    for (auto& row : *all) row[0] = row[1] = 0.0;
  for (std::size_t k = 0; k < t.count; ++k) {
    const Element& e = t.elements[k];
    if (const Silence at = add_element(e, flow, t.sections[e.section], sum); at.any) return at;
  }
  for (std::size_t m = 0; m < 2; ++m) {
    disc.write(m, sum.force[m][0], sum.force[m][1], t.value);
    Number by[8][2];
    for (std::size_t j = 0; j < 2; ++j) {
      const Number along = sum.along[m][j], through = sum.through[m][j], pitch = sum.pitch[m][j],
                   swing = sum.through[m + 1][j];
      const Number flapped = through * (c * t.V_e) - pitch * t.tan_delta3;  // with the flap angle
      by[0][j] = along * s + through * (flap * c);
      by[1][j] = through;
      by[2][j] = swing * c;
      by[3][j] = pitch;
      by[4][j] = -pitch * s;
      by[5][j] = sum.along[m + 1][j] + swing * tilt;
      by[6][j] = swing * (s * t.omega) - flapped * c;
      by[7][j] = -swing * (c * t.omega) - flapped * s;
    }
    for (std::size_t i = 0; i < 8; ++i) disc.write(m, by[i][0], by[i][1], t.slope + 5 * i);
  }
  // The in-plane force leans with the flap angle itself.
  t.slope[5 * 6 + 1] += mean(sum.force[0][0] * c * c);
  t.slope[5 * 7 + 1] += mean(sum.force[0][0] * s * c);
  return {};
}

}  // namespace tiltrim
