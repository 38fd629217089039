#include "tests/forger.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <sstream>

Forger::Forger(const std::string& certificate) {
  std::istringstream in(certificate);
  for (std::string line; std::getline(in, line);) original.push_back(line);
}

std::string Forger::joined(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

double Forger::number(const Json& text) {
  return std::strtod(text.get<std::string>().c_str(), nullptr);
}

std::string Forger::hex(double x) { return fmt::format("{:a}", x); }

bool Forger::has(const std::string& text) const {
  return std::ranges::any_of(original,
                             [&](const std::string& line) { return line.find(text) != line.npos; });
}

std::size_t Forger::line_with(const std::string& text) {
  for (;;) {
    const std::size_t i = 1 + below(original.size() - 1);
    if (original[i].find(text) != std::string::npos) return i;
  }
}

bool Forger::apart(std::size_t i, std::size_t j) const {
  const auto tube = [&](std::size_t line) {
    const Json record = Json::parse(original[line])["sides"][0];
    double reach = number(record["Z"][0]);
    for (const auto& s : record["S"][0]) reach += std::abs(number(s));
    return std::pair(number(record["z"][0]), reach);
  };
  const auto [z, reach] = tube(i);
  const auto [other, other_reach] = tube(j);
  return std::abs(z - other) > 0.5 * (reach + other_reach);
}

namespace forging {

namespace {

using Json = Forger::Json;
using Lines = Forger::Lines;

double number(const Json& text) { return Forger::number(text); }
std::string hex(double x) { return Forger::hex(x); }
std::string joined(const Lines& lines) { return Forger::joined(lines); }

void negate(Json& numbers) {
  if (numbers.is_array())
    for (Json& one : numbers) negate(one);
  else
    numbers = hex(-number(numbers));
}

const std::vector<Forgery> of_the_tree{
    {"cut off",
     [](Forger& f) {
       const std::string t = joined(f.original);
       return t.substr(0, f.below(t.size() - 1));
     }},
    {"a line lost",
     [](Forger& f) {
       Lines l = f.original;
       l.erase(l.begin() + std::ptrdiff_t(f.below(l.size())));
       return joined(l);
     }},
    {"a line twice",
     [](Forger& f) {
       Lines l = f.original;
       const auto i = std::ptrdiff_t(f.below(l.size()));
       l.insert(l.begin() + i, l[std::size_t(i)]);
       return joined(l);
     }},
    {"two leaves exchanged",
     [](Forger& f) {
       Lines l = f.original;
       const std::size_t i = f.leaf();
       std::size_t j = i;
       // Leaves whose tubes overlap (the mass hardly moves a trim) may prove each other's claim.
       while (!f.apart(i, j)) j = f.leaf();
       std::swap(l[i], l[j]);
       return joined(l);
     }},
    {"split outside",
     [](Forger& f) {
       const double at = 1000 * (1 + f.share());
       return f.edited(f.line_with("{\"split\""), [&](Json& o) { o["at"] = hex(at); });
     }},
};

const std::vector<Forgery> of_tubes{
    {"verdict exchanged",
     [](Forger& f) {
       return f.edited(f.leaf(),
                       [](Json& o) { o["leaf"] = o["leaf"] == "stable" ? "unstable" : "stable"; });
     }},
    {"verdict and count exchanged",
     [](Forger& f) {
       const int count = 1 + int(f.below(6));
       return f.records([&](Json& o, Json& r) {
         const bool stable = r["roots"] == 0;
         o["leaf"] = stable ? "unstable" : "stable";
         r["roots"] = stable ? count : 0;
       });
     }},
    {"no trim where there is one",
     [](Forger& f) {
       return f.edited(f.leaf(), [](Json& o) {
         o = {{"leaf", "no_trim"},
              {"sides", {{{"exclude", {{{"y", {"0x1p+0", "0x0p+0", "0x0p+0"}}}}}}}}};
       });
     }},
    {"evidence lost",
     [](Forger& f) { return f.edited(f.leaf(), [](Json& o) { o["sides"].clear(); }); }},
    {"radii shrunk",
     [](Forger& f) {
       const double by = 1e-3 * f.share();
       return f.records([&](Json&, Json& r) {
         for (auto& Z : r["Z"]) Z = hex(by * number(Z));
       });
     }},
    {"radii negative", [](Forger& f) { return f.records([](Json&, Json& r) { negate(r["Z"]); }); }},
    {"tube moved",
     [](Forger& f) {
       const std::size_t i = f.below(3);
       const double by = 3 + f.share();
       return f.records(
           [&](Json&, Json& r) { r["z"][i] = hex(number(r["z"][i]) + by * number(r["Z"][i])); });
     }},
    {"slopes reversed",
     [](Forger& f) { return f.records([](Json&, Json& r) { negate(r["S"]); }); }},
    {"preconditioner reversed",
     [](Forger& f) { return f.records([](Json&, Json& r) { negate(r["C"]); }); }},
    {"direction reversed",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) { negate(r["v"][f.below(r["v"].size())]); });
     }},
    {"direction zero",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) {
         r["v"][f.below(r["v"].size())] = {"0x0p+0", "0x0p+0"};
       });
     }},
    {"frequencies not from zero",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) { r["w"][0] = hex(0.1 * f.share() + 1e-300); });
     }},
    {"frequencies turned",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) {
         const std::size_t i = f.below(r["w"].size() - 1);
         std::swap(r["w"][i], r["w"][i + 1]);
       });
     }},
};

const std::vector<Forgery> of_the_statement{
    {"box enlarged",
     [](Forger& f) {
       const double by = 1 + f.share();
       // Of an undecided leaf that grows nothing is claimed; below V without trim there may be
       // none.
       const bool up = f.coin() || f.has("\"undecided\"");
       return f.header([&](Json& h) {
         Json& p = h["parameters"][0];
         const double a = number(p["from"]), b = number(p["to"]);
         if (up)
           p["to"] = hex(b + by * (b - a));
         else
           p["from"] = hex(a - by * (b - a));
       });
     }},
    {"box moved",
     [](Forger& f) {
       const double by = 3 + f.share();
       return f.header([&](Json& h) {
         auto& p = h["parameters"][0];
         p["from"] = hex(number(p["from"]) + by);
         p["to"] = hex(number(p["to"]) + by);
       });
     }},
    {"another number enlarged",  // by much: a tube is wider than what the mass moves the trim
     [](Forger& f) {
       const double by = 2 + f.share();
       return f.header([&](Json& h) {
         Json& p = h["parameters"].back();  // the mass, CM_de or V
         p["to"] = hex(number(p["to"]) * (p["key"] == "aircraft.CM_de" ? 1 / by : by));
       });
     }},
    {"margin raised",
     [](Forger& f) {
       const double to = 5 + 10 * f.share();
       return f.header([&](Json& h) { h["margin"] = hex(to); });
     }},
    {"a number changed",
     [](Forger& f) {
       // Not rotor_z, which acts on the cyclic alone: none of it at most heights.
       constexpr std::array names{"aircraft.wing_area",     "aircraft.air_density",
                                  "aircraft.gravity",       "aircraft.chord",
                                  "aircraft.thrust_excess", "aircraft.CM_de"};
       const bool replaced = f.original[0].find("\"key\":\"aircraft.CM_de\"") != std::string::npos;
       const std::string name = names[f.below(names.size() - (replaced ? 1 : 0))];
       const double by = 2 + f.share();
       return f.header([&](Json& h) { h["numbers"][name] = hex(by * number(h["numbers"][name])); });
     }},
    // det A is proportional to it: the number of roots to the right becomes odd, or even.
    {"gain of an integral reversed",
     [](Forger& f) {
       const bool energy = f.coin();
       return f.header([&](Json& h) {
         Json& constant = h["numbers"][energy ? "gains.K_Ei" : "gains.K_Li"];
         negate(constant);
         if (!h.contains("schedule")) return;
         for (Json& set : h["schedule"]["gains"]) {
           negate(set[energy ? 2 : 4]);
         }
       });
     }},
    {"unknowns of the other kind",
     [](Forger& f) {
       return f.header([](Json& h) {
         if (h["unknowns"][1] == "theta0")
           h["unknowns"] = {"theta", "energy_integral", "distribution_integral"};
         else
           h["unknowns"] = {"theta", "theta0", "deflection"};
       });
     }},
    {"polar changed",
     [](Forger& f) {
       const double by = 0.1 + f.share();
       const char* of = f.below(2) == 0 ? "CL" : "CM";
       return f.header([&](Json& h) {
         for (auto& y : h["polar"][of]) y = hex(number(y) + by);
       });
     }},
    {"limits tightened",
     [](Forger& f) {
       const char* of = f.below(2) == 0 ? "theta0" : "theta";
       return f.header([&](Json& h) { h["limits"][of] = {hex(1.2), hex(1.3)}; });
     }},
};

// Tubes of the integrals move with the gains; those of actuators do not.
std::string gains_changed(Forger& f) {
  const double by = 2 + f.share();
  return f.header([&](Json& h) {
    for (Json& set : h["schedule"]["gains"]) set[2] = hex(by * number(set[2]));
  });
}

Json& a_split(Forger& f, Json& tree) {
  for (;;)
    if (Json& node = tree[f.below(tree.size())]; node.contains("split")) return node;
}

// The sign of the weights does not matter, so they are lost.
const std::vector<Forgery> of_no_trim{
    {"weights lost",
     [](Forger& f) {
       return f.exclusion([](Json& tree) {
         for (Json& node : tree)
           if (node.contains("y")) node["y"] = {"0x0p+0", "0x0p+0", "0x0p+0"};
       });
     }},
    {"node lost",
     [](Forger& f) { return f.exclusion([&](Json& tree) { tree.erase(f.below(tree.size())); }); }},
    {"node twice",
     [](Forger& f) {
       return f.exclusion([&](Json& tree) {
         const Json node = tree[f.below(tree.size())];
         tree.push_back(node);
       });
     }},
    {"split outside the region",
     [](Forger& f) {
       const double at = (f.coin() ? 100 : -100) * (1 + f.share());
       return f.exclusion([&](Json& tree) { a_split(f, tree)["at"] = hex(at); });
     }},
    {"split of the other actuator",  // the elevator alone controls pitch
     [](Forger& f) { return f.exclusion([&](Json& tree) { a_split(f, tree)["split"] = 2; }); }},
    {"exclusion where there is a trim",
     [](Forger& f) {
       Lines l = f.original;
       l[f.leaf()] = l[f.line_with("\"exclude\"")];
       return joined(l);
     }},
    {"tube where there is no trim",
     [](Forger& f) {
       Lines l = f.original;
       l[f.line_with("\"exclude\"")] = l[f.leaf()];
       return joined(l);
     }},
};

// Over the boxes that are certified no damping ratio of 0.3 is kept.
const std::vector<Forgery> of_damping{
    {"damping raised",
     [](Forger& f) {
       const double to = 0.3 + 0.69 * f.share();
       return f.header([&](Json& h) { h["damping"] = hex(to); });
     }},
    {"ray lost", [](Forger& f) { return f.records([](Json&, Json& r) { r.erase("ray"); }); }},
    {"ray without damping",
     [](Forger& f) { return f.header([](Json& h) { h.erase("damping"); }); }},
    {"root of less damping",
     [](Forger& f) {
       const int count = 1 + int(f.below(6));
       return f.records([&](Json& o, Json& r) {
         o["leaf"] = "unstable";
         r["ray"]["roots"] = count;
       });
     }},
    {"ray not from zero",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) { r["ray"]["w"][0] = hex(0.1 * f.share() + 1e-300); });
     }},
    {"frequencies of the ray turned",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) {
         Json& w = r["ray"]["w"];
         const std::size_t i = f.below(w.size() - 1);
         std::swap(w[i], w[i + 1]);
       });
     }},
    {"direction of the ray reversed",
     [](Forger& f) {
       return f.records([&](Json&, Json& r) {
         Json& v = r["ray"]["v"];
         negate(v[f.below(v.size())]);
       });
     }},
};

// Edits a random leaf with two different tubes: of cyclic and elevator, whose deflections differ.
template <class Edit>
std::string of_two_tubes(Forger& f, const Edit& edit) {
  for (;;) {
    const std::size_t line = f.leaf();
    Json object = Json::parse(f.original[line]);
    Json& sides = object["sides"];
    const Json one = sides[f.below(sides.size())];
    const auto same = [&](const Json& side) {
      return std::abs(number(side["z"][2]) - number(one["z"][2])) < 1e-3;
    };
    if (std::all_of(sides.begin(), sides.end(), same)) continue;
    edit(sides, one, same);
    Lines lines = f.original;
    lines[line] = object.dump();
    return joined(lines);
  }
}

const std::vector<Forgery> of_the_handover{
    {"one side lost",
     [](Forger& f) {
       return of_two_tubes(f, [](Json& sides, const Json&, const auto& same) {
         Json others = Json::array();
         for (const Json& side : sides)
           if (!same(side)) others.push_back(side);
         sides = others;
       });
     }},
    {"one side for both",
     [](Forger& f) {
       return of_two_tubes(f, [](Json& sides, const Json& one, const auto&) {
         for (Json& side : sides) side = one;
       });
     }},
    {"one side unstable",
     [](Forger& f) {
       const int count = 1 + int(f.below(6));
       return of_two_tubes(f, [&](Json& sides, const Json&, const auto&) {
         sides[f.below(sides.size())]["roots"] = count;
       });
     }},
    {"handover moved",
     [](Forger& f) {
       const double by = (f.coin() ? 0.05 : -0.05) * (1 + f.share());  // rad
       return f.header([&](Json& h) {
         h["numbers"]["aircraft.cyclic_off"] =
             hex(number(h["numbers"]["aircraft.cyclic_off"]) + by);
       });
     }},
};

std::string undecided_claimed(Forger& f) {
  Lines l = f.original;
  l[f.line_with("\"undecided\"")] = l[f.leaf()];
  return joined(l);
}

}  // namespace

}  // namespace forging

std::vector<Forgery> forgeries_for(const Forger& of) {
  using namespace forging;
  std::vector<Forgery> all;
  const auto add = [&](const std::vector<Forgery>& more) {
    all.insert(all.end(), more.begin(), more.end());
  };
  if (of.has("[\"theta\",\"energy_integral\"")) add({{"gains changed", gains_changed}});
  if (of.has("\"undecided\"")) add({{"undecided leaf claimed", undecided_claimed}});
  if (of.has("\"exclude\"")) add(of_no_trim);
  if (of.has("\"damping\"")) add(of_damping);
  const auto two_tubes = [](const std::string& line) {
    if (line.find("\"roots\"") == line.npos) return false;
    const Json sides = Json::parse(line)["sides"];
    return std::any_of(sides.begin(), sides.end(), [&](const Json& side) {
      return std::abs(number(side["z"][2]) - number(sides[0]["z"][2])) > 1e-3;
    });
  };
  if (std::ranges::any_of(of.original, two_tubes)) add(of_the_handover);
  add(of_the_tree);
  add(of_tubes);
  add(of_the_statement);
  return all;
}
