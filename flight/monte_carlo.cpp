#include "flight/monte_carlo.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <numbers>
#include <set>

#include "runtime/log.hpp"
#include "runtime/random.hpp"
#include "runtime/rounding.hpp"
#include "runtime/threads.hpp"
#include "vehicles/tiltrotor/numbers.hpp"

namespace tiltrim {

namespace {

std::mt19937_64 random_for(std::uint64_t seed, long number) {
  std::seed_seq mixed{std::uint32_t(seed), std::uint32_t(seed >> 32), std::uint32_t(number),
                      std::uint32_t(std::uint64_t(number) >> 32)};
  return std::mt19937_64(mixed);
}

// The scattered parameters of a flight, SI.
std::vector<double> numbers_of(const MonteCarloTable& table, long number) {
  std::mt19937_64 random = random_for(table.seed, number);
  std::vector<double> numbers;
  for (const Uncertain& u : table.scatter)
    numbers.push_back(u.lower + uniform(random) * (u.upper - u.lower));
  return numbers;
}

// Sets the parameter of this name in a plan; false if it is no parameter of the aircraft or a gain.
bool set_of_vehicle(Flight& flight, const std::string& name, double value) {
  const auto among = [&](const Signals& signals) { return std::size_t(find(signals, name)); };
  if (find(aircraft_signals(), name) >= 0) {
    aircraft_value(flight.vehicle.aircraft, among(aircraft_signals())) = value;
    return true;
  }
  if (find(gain_signals(), name) < 0) return false;
  gain_value(flight.vehicle.gains, among(gain_signals())) = value;
  for (Gains& gains : flight.gains.gains) gain_value(gains, among(gain_signals())) = value;
  return true;
}

FlightPlan scattered(const ScatteredFlights& flights, long number) {
  const MonteCarloTable& table = flights.table;
  const std::vector<double> numbers = numbers_of(table, number);
  FlightPlan plan = flights.nominal;
  std::vector<GustTable> gusts = flights.gusts;
  std::mt19937_64 seeds = random_for(~table.seed, number);
  for (GustTable& gust : gusts) gust.seed = seeds();
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const std::string& name = table.scatter[k].name;
    if (set_of_vehicle(plan.flight, name, numbers[k])) continue;
    if (name == "gust_size")
      for (GustTable& gust : gusts) gust.size = numbers[k];
    else if (name == "height")
      plan.start.state.height = numbers[k];
    else
      put({{name, numbers[k]}}, plan.flight.axes, plan.start.state);
  }
  if (!gusts.empty()) plan.flight.wind = weather(gusts).wind;
  plan.options.integrate.sample = std::max(plan.options.integrate.sample, 0.5);
  return plan;
}

Outcome judged(const FlightPlan& plan, const MonteCarloTable& table, long number,
               const FlightResult& flown) {
  const FlightState& x = flown.states.back();
  const FlightPoint end = flight_point(plan.flight, flown.modes.back(), flown.t.back(), x);
  Outcome o{number, flown.status};
  o.t = flown.t.back();
  o.height = x.height;
  o.V_off = end.V - end.command.V;
  o.gamma_off = end.gamma - end.command.gamma;
  for (const FlightState& state : flown.states)
    o.theta_most = std::max(o.theta_most, std::abs(state.theta));
  const bool whole = flown.status == (plan.lands ? FlightStatus::landed : FlightStatus::flown);
  const double attitude = o.theta_most / table.theta_within;
  const double aims =
      std::max(std::abs(o.V_off) / table.V_within, std::abs(o.gamma_off) / table.gamma_within);
  constexpr double early = 1e6;  // above any miss of a flight that reaches its end
  o.miss = whole ? std::max(attitude, plan.lands ? 0.0 : aims)
                 : early * (2 - o.t / plan.options.duration);
  if (std::isnan(o.miss)) o.miss = 2 * early;
  o.good = o.miss <= 1;
  return o;
}

bool worse(const Outcome& a, const Outcome& b) {
  return a.miss != b.miss ? a.miss > b.miss : a.number < b.number;
}

// Result of a block of flights: counts and the worst flights.
struct Tally {
  long flown = 0, good = 0;
  std::array<long, flight_statuses> ends{};
  std::vector<Outcome> worst;

  void add(const Outcome& o) {
    ++flown;
    good += o.good;
    ++ends[std::size_t(o.status)];
    worst.push_back(o);
  }
  void add(const Tally& other) {
    flown += other.flown;
    good += other.good;
    for (std::size_t k = 0; k < ends.size(); ++k) ends[k] += other.ends[k];
    worst.insert(worst.end(), other.worst.begin(), other.worst.end());
  }
  void keep(std::size_t most) {
    std::ranges::sort(worst, worse);
    if (worst.size() > most) worst.resize(most);
  }
};

using Bytes = std::vector<std::byte>;

Bytes as_bytes(const Tally& tally) {
  Bytes bytes;
  const auto put = [&](const auto& value) {
    const auto* from = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), from, from + sizeof value);
  };
  put(tally.flown);
  put(tally.good);
  for (const long n : tally.ends) put(n);
  for (const Outcome& o : tally.worst) {
    put(o.number);
    put(long(o.status));
    put(long(o.good));
    for (const double v : {o.t, o.height, o.V_off, o.gamma_off, o.theta_most, o.miss}) put(v);
  }
  return bytes;
}

Tally tally_from(const Bytes& bytes) {
  std::size_t at = 0;
  const auto take = [&](auto value) {
    if (at + sizeof value > bytes.size()) throw std::runtime_error("a record is truncated");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  };
  Tally tally;
  tally.flown = take(0L);
  tally.good = take(0L);
  for (long& n : tally.ends) n = take(0L);
  while (at < bytes.size()) {
    Outcome o;
    o.number = take(0L);
    o.status = FlightStatus(take(0L));
    o.good = take(0L) != 0;
    for (double* v : {&o.t, &o.height, &o.V_off, &o.gamma_off, &o.theta_most, &o.miss})
      *v = take(0.0);
    tally.worst.push_back(o);
  }
  return tally;
}

class Trials {
 public:
  Trials(const ScatteredFlights& flights, const MonteCarloOptions& options)
      : flights_(flights),
        table_(flights.table),
        options_(options),
        block_(std::clamp(table_.flights / 100, 1L, 100L)) {}

  MonteCarlo run() {
    std::unique_ptr<Log> log;
    if (!options_.log.empty()) log = std::make_unique<Log>(options_.log, options_.identity);
    std::set<std::uint64_t> known;
    if (log)
      for (const Log::Record& record : log->recovered()) {
        all_.add(tally_from(record.bytes));
        known.insert(record.tile);
      }
    all_.keep(std::size_t(table_.worst));
    in_parallel(std::size_t((table_.flights + block_ - 1) / block_), [&](std::size_t number) {
      if (!known.contains(number)) finish(number, flown(long(number)), log.get());
    });
    MonteCarlo answer = so_far();
    answer.interrupted = answer.flown < answer.asked;
    if (log) log->sync();
    return answer;
  }

 private:
  const ScatteredFlights& flights_;
  const MonteCarloTable& table_;
  const MonteCarloOptions& options_;
  const long block_;  // flights per record
  std::mutex finishing_;
  Tally all_;
  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();

  bool stopped() const { return options_.stop.stop_requested(); }

  // Counts and worst flights do not depend on the order in which blocks finish.
  void finish(std::uint64_t number, const Tally& tally, Log* log) {
    if (tally.flown == 0) return;  // interrupted
    const std::lock_guard one_at_a_time(finishing_);
    all_.add(tally);
    all_.keep(std::size_t(table_.worst));
    if (log) log->append(number, as_bytes(tally));
    const std::chrono::duration<double> since = std::chrono::steady_clock::now() - synced_;
    if (log && since.count() >= options_.checkpoint) {
      log->sync();
      synced_ = std::chrono::steady_clock::now();
    }
    if (options_.observe) options_.observe(so_far());
  }

  // A complete block, or nothing of it if the run is interrupted.
  Tally flown(long number) const {
    Tally tally;
    for (long i = number * block_; i < std::min((number + 1) * block_, table_.flights); ++i) {
      if (stopped()) return {};
      const FlightPlan plan = scattered(flights_, i);
      tally.add(judged(plan, table_, i, tiltrim::fly(plan.flight, plan.start, plan.options)));
    }
    tally.keep(std::size_t(table_.worst));
    return tally;
  }

  MonteCarlo so_far() const {
    MonteCarlo answer;
    answer.asked = table_.flights;
    answer.flown = all_.flown;
    answer.good = all_.good;
    answer.ends = all_.ends;
    answer.share = proportion(all_.good, all_.flown);
    std::vector<double> per_si;  // in the study's units
    for (const Uncertain& u : table_.scatter) {
      const bool angle =
          u.name == "theta" || u.name == "aircraft.cyclic_off" || u.name == "aircraft.cyclic_blend";
      answer.names.push_back(u.name + (angle ? "_deg" : ""));
      per_si.push_back(angle ? 180 / std::numbers::pi : 1.0);
    }
    for (const Outcome& o : all_.worst) {
      std::vector<double> numbers = numbers_of(table_, o.number);
      for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] *= per_si[k];
      answer.worst.push_back({o, std::move(numbers)});
    }
    return answer;
  }
};

}  // namespace

MonteCarlo monte_carlo(const ScatteredFlights& flights, const MonteCarloOptions& options) {
  const RoundToNearest environment;
  MonteCarlo answer;
  answer.asked = flights.table.flights;
  answer.message = flights.nominal.message;
  if (!is_equilibrium(flights.nominal.start_status)) return answer;
  with_threads(options.threads, [&] { answer = Trials(flights, options).run(); });
  return answer;
}

FlightPlan flight_plan_of(const ScatteredFlights& flights, long number) {
  if (const long last = flights.table.flights; number < 0 || number >= last)
    throw std::invalid_argument(fmt::format(
        "no flight {}; the {} flights of [montecarlo] are numbered from 0", number, last));
  FlightPlan plan = scattered(flights, number);
  plan.options.integrate.sample = flights.nominal.options.integrate.sample;
  return plan;
}

}  // namespace tiltrim
