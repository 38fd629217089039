// A flight as NetCDF-4: built in memory and written at once, so no partial file is left.
#include <fmt/core.h>
#include <netcdf.h>
#include <netcdf_mem.h>

#include <cstdlib>
#include <map>
#include <memory>
#include <utility>

#include "flight/fly.hpp"
#include "runtime/whole_file.hpp"

namespace tiltrim {

namespace {

// Unit as UDUNITS spells it.
std::string udunits(const std::string& unit) {
  static const std::map<std::string, std::string> spelt{
      {"m/s", "m s-1"}, {"rad/s", "rad s-1"}, {"degrees", "degree"}};
  const auto at = spelt.find(unit);
  return at == spelt.end() ? unit : at->second;
}

class Dataset {
 public:
  explicit Dataset(const std::filesystem::path& file) : file_(file) {
    check(nc_create_mem("flight", NC_NETCDF4, 0, &id_));
  }
  ~Dataset() {
    NC_memio memory{};
    if (id_ >= 0 && nc_close_memio(id_, &memory) == NC_NOERR) std::free(memory.memory);
  }
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

  int dimension(const char* name, std::size_t size) {
    int dimension = -1;
    check(nc_def_dim(id_, name, size, &dimension));
    return dimension;
  }
  int variable(const std::string& name, nc_type type, int dimension) {
    int variable = -1;
    check(nc_def_var(id_, name.c_str(), type, 1, &dimension, &variable));
    return variable;
  }
  void text(int variable, const char* name, const std::string& value) {
    check(nc_put_att_text(id_, variable, name, value.size(), value.data()));
  }
  void put(int variable, const std::vector<double>& values) {
    if (!values.empty()) check(nc_put_var_double(id_, variable, values.data()));
  }
  void put(int variable, const std::vector<std::string>& texts) {
    std::vector<const char*> pointers;
    for (const std::string& t : texts) pointers.push_back(t.c_str());
    if (!texts.empty()) check(nc_put_var_string(id_, variable, pointers.data()));
  }
  void end_definitions() { check(nc_enddef(id_)); }
  void write() {
    NC_memio memory{};
    check(nc_close_memio(std::exchange(id_, -1), &memory));
    const std::unique_ptr<void, decltype(&std::free)> owned(memory.memory, &std::free);
    const std::span bytes(static_cast<const std::byte*>(memory.memory), memory.size);
    filing::write_whole(file_, {bytes});
  }

 private:
  const std::filesystem::path& file_;
  int id_ = -1;

  void check(int status) const {
    if (status != NC_NOERR) filing::refuse(file_, nc_strerror(status));
  }
};

}  // namespace

FlightNotes notes_of(const FlightResult& flown) {
  FlightNotes notes{
      "flight of the closed loop", "", "", to_string(flown.status), flown.message, {}};
  for (const FlightEvent& e : flown.events)
    notes.events.push_back({e.t, to_string(e.kind), e.what});
  return notes;
}

void write_netcdf(const FlightTable& table, const FlightNotes& notes,
                  const std::filesystem::path& file) {
  Dataset set(file);
  set.text(NC_GLOBAL, "Conventions", "CF-1.8");
  set.text(NC_GLOBAL, "title", notes.title);
  set.text(NC_GLOBAL, "study", notes.study);
  set.text(NC_GLOBAL, "program", notes.program);
  set.text(NC_GLOBAL, "status", notes.status);
  set.text(NC_GLOBAL, "message", notes.message);
  const int time = set.dimension("time", table.rows());
  const int event = set.dimension("event", notes.events.size());
  std::vector<int> columns;
  for (const FlightColumn& c : table.columns) {
    columns.push_back(set.variable(c.name, NC_DOUBLE, time));
    set.text(columns.back(), "units", udunits(c.unit));
    set.text(columns.back(), "long_name", c.what);
  }
  const int event_time = set.variable("event_time", NC_DOUBLE, event);
  set.text(event_time, "units", "s");
  const int event_kind = set.variable("event_kind", NC_STRING, event);
  const int event_what = set.variable("event_what", NC_STRING, event);
  set.end_definitions();
  std::vector<double> times;
  std::vector<std::string> kinds, whats;
  for (const FlightNotes::Event& e : notes.events) {
    times.push_back(e.t);
    kinds.push_back(e.kind);
    whats.push_back(e.what);
  }
  for (std::size_t k = 0; k < columns.size(); ++k) set.put(columns[k], table.columns[k].values);
  set.put(event_time, times);
  set.put(event_kind, kinds);
  set.put(event_what, whats);
  set.write();
}

}  // namespace tiltrim
