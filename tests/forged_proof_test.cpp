// Damaged and altered certificates: none is accepted. Each TILTRIM_SEED makes others
// (make forge).
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "check_proof/certificate.hpp"
#include "check_proof/check_proof.hpp"
#include "tests/check.hpp"
#include "tests/proof_writer.hpp"
#include "tests/random_draws.hpp"

using namespace tiltrim;
using nlohmann::ordered_json;

namespace forged_proof_test {

namespace {

using Lines = std::vector<std::string>;

Lines split(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}
std::string joined(const Lines& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

double number(const ordered_json& text) {
  return std::strtod(text.get<std::string>().c_str(), nullptr);
}
std::string hex(double x) { return fmt::format("{:a}", x); }

struct Forger {
  Random random = draws(41);
  Lines original;

  std::size_t below(std::size_t n) { return std::size_t(random() % n); }
  double share() { return std::uniform_real_distribution<double>(0, 1)(random); }
  /// A random line with evidence of a tube.
  std::size_t leaf() {
    for (;;) {
      const std::size_t i = 1 + below(original.size() - 1);
      if (original[i].find("\"roots\"") != std::string::npos) return i;
    }
  }
  /// Whether the tubes of two leaves have hardly a pitch angle in common.
  bool apart(std::size_t i, std::size_t j) const {
    const auto tube = [&](std::size_t line) {
      const ordered_json record = ordered_json::parse(original[line])["sides"][0];
      double reach = number(record["Z"][0]);
      for (const auto& s : record["S"][0]) reach += std::abs(number(s));
      return std::pair(number(record["z"][0]), reach);
    };
    const auto [z, reach] = tube(i);
    const auto [other, other_reach] = tube(j);
    return std::abs(z - other) > 0.5 * (reach + other_reach);
  }
  template <class Edit>
  std::string edited(std::size_t line, const Edit& edit) {
    Lines lines = original;
    ordered_json object = ordered_json::parse(lines[line]);
    edit(object);
    lines[line] = object.dump();
    return joined(lines);
  }
  template <class Edit>
  std::string records(const Edit& edit) {
    return edited(leaf(), [&](ordered_json& object) {
      for (ordered_json& record : object["sides"]) edit(object, record);
    });
  }
  std::string header(const auto& edit) { return edited(0, edit); }
};

using Forgery = std::pair<const char*, std::string (*)(Forger&)>;

// Each makes the file state what is false, or leaves out what it needs.
const std::vector<Forgery>& forgeries() {
  static const std::vector<Forgery> all{
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
         const std::size_t i = f.below(l.size());
         l.insert(l.begin() + std::ptrdiff_t(i), l[i]);
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
      {"verdict exchanged",
       [](Forger& f) {
         return f.edited(f.leaf(), [](ordered_json& o) {
           o["leaf"] = o["leaf"] == "stable" ? "unstable" : "stable";
         });
       }},
      {"verdict and count exchanged",
       [](Forger& f) {
         const int count = 1 + int(f.below(6));
         return f.records([&](ordered_json& o, ordered_json& r) {
           const bool stable = r["roots"] == 0;
           o["leaf"] = stable ? "unstable" : "stable";
           r["roots"] = stable ? count : 0;
         });
       }},
      {"no trim where there is one",
       [](Forger& f) {
         return f.edited(f.leaf(), [](ordered_json& o) {
           o = {{"leaf", "no_trim"},
                {"sides", {{{"exclude", {{{"y", {"0x1p+0", "0x0p+0", "0x0p+0"}}}}}}}}};
         });
       }},
      {"evidence lost",
       [](Forger& f) { return f.edited(f.leaf(), [](ordered_json& o) { o["sides"].clear(); }); }},
      {"radii shrunk",
       [](Forger& f) {
         const double by = 1e-3 * f.share();
         return f.records([&](ordered_json&, ordered_json& r) {
           for (auto& Z : r["Z"]) Z = hex(by * number(Z));
         });
       }},
      {"radii negative",
       [](Forger& f) {
         return f.records([](ordered_json&, ordered_json& r) {
           for (auto& Z : r["Z"]) Z = hex(-number(Z));
         });
       }},
      {"tube moved",
       [](Forger& f) {
         const std::size_t i = f.below(3);
         const double by = 3 + f.share();
         return f.records([&](ordered_json&, ordered_json& r) {
           r["z"][i] = hex(number(r["z"][i]) + by * number(r["Z"][i]));
         });
       }},
      {"slopes reversed",
       [](Forger& f) {
         return f.records([](ordered_json&, ordered_json& r) {
           for (auto& row : r["S"])
             for (auto& s : row) s = hex(-number(s));
         });
       }},
      {"preconditioner reversed",
       [](Forger& f) {
         return f.records([](ordered_json&, ordered_json& r) {
           for (auto& row : r["C"])
             for (auto& c : row) c = hex(-number(c));
         });
       }},
      {"direction reversed",
       [](Forger& f) {
         return f.records([&](ordered_json&, ordered_json& r) {
           auto& v = r["v"][f.below(r["v"].size())];
           for (auto& part : v) part = hex(-number(part));
         });
       }},
      {"direction zero",
       [](Forger& f) {
         return f.records([&](ordered_json&, ordered_json& r) {
           r["v"][f.below(r["v"].size())] = {"0x0p+0", "0x0p+0"};
         });
       }},
      {"frequencies not from zero",
       [](Forger& f) {
         return f.records(
             [&](ordered_json&, ordered_json& r) { r["w"][0] = hex(0.1 * f.share() + 1e-300); });
       }},
      {"frequencies turned",
       [](Forger& f) {
         return f.records([&](ordered_json&, ordered_json& r) {
           const std::size_t i = 1 + f.below(r["w"].size() - 2);
           std::swap(r["w"][i], r["w"][i + 1]);
         });
       }},
      {"box enlarged",
       [](Forger& f) {
         const double by = 1 + f.share();
         const bool up = f.below(2) == 0;
         return f.header([&](ordered_json& h) {
           auto& p = h["parameters"][0];
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
         return f.header([&](ordered_json& h) {
           auto& p = h["parameters"][0];
           p["from"] = hex(number(p["from"]) + by);
           p["to"] = hex(number(p["to"]) + by);
         });
       }},
      {"margin raised",
       [](Forger& f) {
         const double to = 5 + 10 * f.share();
         return f.header([&](ordered_json& h) { h["margin"] = hex(to); });
       }},
      {"a number changed",
       [](Forger& f) {
         // Not rotor_z, which acts on the cyclic alone: none of it at these heights.
         constexpr std::array names{"aircraft.wing_area",     "aircraft.air_density",
                                    "aircraft.gravity",       "aircraft.chord",
                                    "aircraft.thrust_excess", "aircraft.CM_de"};
         const char* name = names[f.below(names.size())];
         const double by = 2 + f.share();
         return f.header(
             [&](ordered_json& h) { h["numbers"][name] = hex(by * number(h["numbers"][name])); });
       }},
      {"gains changed",
       [](Forger& f) {
         const double by = 2 + f.share();
         return f.header([&](ordered_json& h) {
           for (auto& set : h["schedule"]["gains"]) set[2] = hex(by * number(set[2]));
         });
       }},
      {"polar changed",
       [](Forger& f) {
         const double by = 0.1 + f.share();
         const char* of = f.below(2) == 0 ? "CL" : "CM";
         return f.header([&](ordered_json& h) {
           for (auto& y : h["polar"][of]) y = hex(number(y) + by);
         });
       }},
      {"limits tightened",
       [](Forger& f) {
         const char* of = f.below(2) == 0 ? "theta0" : "theta";
         return f.header([&](ordered_json& h) { h["limits"][of] = {hex(1.2), hex(1.3)}; });
       }},
      {"split outside",
       [](Forger& f) {
         Lines l = f.original;
         for (std::string& line : l)
           if (line.starts_with("{\"split\"")) {
             ordered_json o = ordered_json::parse(line);
             o["at"] = hex(1000 * (1 + f.share()));
             line = o.dump();
             break;
           }
         return joined(l);
       }},
  };
  return all;
}

ProofToWrite asked() {
  return {load_study(TILTRIM_SOURCE_DIR "/studies/scheduled.toml"),
          {{"h", {60, 66}}, {"aircraft.mass", {3.9, 4.1}}}};
}

}  // namespace

TEST_CASE("no altered certificate is accepted") {
  Forger forger;
  const std::string genuine = written_proof(asked());
  forger.original = split(genuine);
  REQUIRE(check_proof_text(genuine).status == CertificateStatus::verified);
  REQUIRE(forger.original.size() > 3);
  int count = trials(150);
  std::map<std::string, int> accepted;
  for (int i = 0; i < count; ++i) {
    const auto& [name, forge] = forgeries()[std::size_t(i) % forgeries().size()];
    const ProofCheck check = check_proof_text(forge(forger));
    if (check.status == CertificateStatus::verified) ++accepted[name];
  }
  for (const auto& [name, n] : accepted) FAIL_CHECK(fmt::format("{}: {} accepted", name, n));
  MESSAGE(count, " altered certificates refused");
}

// A flipped bit in the low digits of a hint leaves a valid proof of the same theorem: what is
// accepted must be that theorem, over the same box, with the same verdicts.
TEST_CASE("a certificate with a flipped bit is refused, or proves the same") {
  Forger forger;
  const std::string genuine = written_proof(asked());
  const ProofCheck truth = check_proof_text(genuine);
  REQUIRE(truth.status == CertificateStatus::verified);
  int count = trials(50);
  int harmless = 0;
  for (int i = 0; i < count; ++i) {
    std::string text = genuine;
    char& byte = text[forger.below(text.size())];
    byte = char(byte ^ char(1 << forger.below(7)));
    const ProofCheck check = check_proof_text(text);
    if (check.status != CertificateStatus::verified) continue;
    ++harmless;
    REQUIRE(check.theorems.size() == 1);
    const CheckedTheorem &own = check.theorems[0], &real = truth.theorems[0];
    CHECK(own.leaves == real.leaves);
    CHECK(own.stable == real.stable);
  }
  MESSAGE(count, " flipped bits, ", harmless, " without effect on what is proved");
}

namespace {

// Every number of a header: its text is in quotes.
std::vector<ordered_json*> numbers_of(ordered_json& value) {
  std::vector<ordered_json*> all;
  if (value.is_string() && value.get<std::string>().find("0x") != std::string::npos)
    all.push_back(&value);
  if (value.is_structured())
    for (ordered_json& part : value)
      for (ordered_json* one : numbers_of(part)) all.push_back(one);
  return all;
}

}  // namespace

// With --study a statement that differs in the last bit of any number is refused, although its
// evidence may still prove it.
TEST_CASE("a certificate about other numbers is never taken for one about the study") {
  Forger forger;
  const ProofToWrite of = asked();
  forger.original = split(written_proof(of));
  ProofSubject subject =
      subject_of(checking::read_certificate(joined(forger.original)).front().statement);
  for (const auto& [key, range] : of.parameters) subject.domain[key] = {range.lower, range.upper};
  const CheckProofOptions options{.threads = 1, .about = {{"corridor", subject}}};
  REQUIRE(check_proof_text(joined(forger.original), options).status == CertificateStatus::verified);
  int count = trials(300);
  int accepted = 0, replaced = 0;
  for (int i = 0; i < count; ++i) {
    std::string which;
    const std::string text = forger.header([&](ordered_json& header) {
      const std::vector<ordered_json*> all = numbers_of(header);
      ordered_json& one = *all[forger.below(all.size())];
      const double x = number(one), up = forger.below(2) == 0 ? 1e300 : -1e300;
      const double to = forger.below(2) == 0 ? std::nextafter(x, up) : x * (1 + forger.share()) + 1;
      one = hex(to);
      // Numbers that a parameter or the schedule replaces say nothing.
      for (const auto& [name, value] : header["numbers"].items())
        if (&value == &one) which = name;
    });
    const bool unused = which == "V" || which == "gamma" || which == "eta" ||
                        which == "aircraft.mass" || which.starts_with("gains.");
    replaced += unused;
    if (unused) continue;
    const ProofCheck check = check_proof_text(text, options);
    const bool more = check.status == CertificateStatus::verified &&
                      check.theorems.front().margin > 0;  // proves more than is asked
    accepted += check.status == CertificateStatus::verified && !more;
    CHECK_MESSAGE((check.status != CertificateStatus::verified || more), check.reason);
  }
  CHECK(accepted == 0);
  CHECK(replaced < count / 5);
}

// Evidence changed a little: it proves the same, or is refused.
TEST_CASE("evidence altered a little is refused, or proves the same") {
  Forger forger;
  const std::string genuine = written_proof(asked());
  const ProofCheck truth = check_proof_text(genuine);
  forger.original = split(genuine);
  int count = trials(30);
  count = std::max(count, 30);  // of so many, some are refused
  int same = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t line = 1 + forger.below(forger.original.size() - 1);
    const double by = std::pow(10.0, -16 * forger.share()) * (forger.below(2) == 0 ? 1 : -1);
    const std::string text = forger.edited(line, [&](ordered_json& object) {
      const std::vector<ordered_json*> all = numbers_of(object);
      if (all.empty()) return;
      ordered_json& one = *all[forger.below(all.size())];
      one = hex(number(one) * (1 + by) + by * 1e-3);
    });
    const ProofCheck check = check_proof_text(text);
    if (check.status != CertificateStatus::verified) continue;
    ++same;
    REQUIRE(check.theorems.size() == 1);
    const CheckedTheorem &own = check.theorems[0], &real = truth.theorems[0];
    CHECK(own.leaves == real.leaves);
    CHECK(own.stable == real.stable);
    for (std::size_t k = 0; k < own.numbers.size(); ++k) {
      CHECK(own.numbers[k].from == real.numbers[k].from);
      CHECK(own.numbers[k].to == real.numbers[k].to);
    }
  }
  CHECK(same < count);
}

}  // namespace forged_proof_test
