/// A whole study in one report: its tables, its figures, what it says first. Computes nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "report/conditions.hpp"
#include "report/figure.hpp"
#include "report/flights.hpp"
#include "report/motions.hpp"
#include "report/sheet.hpp"
#include "study/analyses.hpp"
#include "sweep/map.hpp"
#include "tables/tables.hpp"

namespace tiltrim {

struct StudyReport {
  Study study;
  std::string program;  ///< "tiltrim 0.1.0"
  std::string command;  ///< that makes the report again
  std::vector<ConditionReport> conditions;
  std::vector<LoopsAnswer> loops;  ///< of the closed loops
  struct Map {
    SweepMap map;      ///< over one axis or two
    std::string file;  ///< it was read from; empty: computed
  };
  std::vector<Map> maps;
  std::optional<FlightReport> flight;
  std::optional<MotionAnswer> motion{};  ///< of a study with [model] and [simulate]
  std::optional<PaperTables> paper;
  std::vector<std::string>
      not_examined{};  ///< after an interrupt: "condition 'climb'", "the flight"
};

/// Something that has no answer, why, and what would or would not help.
struct Unanswered {
  std::string what, why;
  std::vector<std::string> more{};
};
/// Conditions first, then maps, margins, flight, tables.
std::vector<Unanswered> unanswered(const StudyReport& report);
/// Flown to its end, or landed.
bool flown_well(const FlightReport& flight);
/// The first thing to read: what has no answer, what is stable and what is not.
std::string verdict_in_words(const StudyReport& report);

/// A table and the name of its files: letters, digits, '_', '-'.
struct NamedSheet {
  std::string name;
  Sheet sheet;
};
/// Every table of the report, in its order.
std::vector<NamedSheet> report_sheets(const StudyReport& report);

/// Numbers along one parameter that figures show and a reader can go along.
struct Track {
  std::string name;   ///< "along_h_level": letters, digits, '_', '-'
  std::string title;  ///< "along h"
  struct Column {
    std::string key, title, unit;
    std::vector<double> values;
  };
  std::vector<Column> columns;  ///< the parameter first
  /// Modes of a sweep: mode m has the columns re_m and im_m.
  std::vector<std::string> modes;
};

/// A map over two axes as a reader looks it up.
struct MapGrid {
  std::string name;            ///< "map_1_level"
  std::string x_name, y_name;  ///< of the axes, "h", "K_Lp"
  SweepAxis::Column x, y;
  /// [x * count of y + y]: verdict as Verdict, -1 without trim; largest real part in 1/s or NaN.
  std::vector<int> verdict;
  std::vector<double> abscissa;
};

struct ReportFigures {
  std::vector<Figure> figures;  ///< in the report's order
  std::vector<Track> tracks;
  std::vector<MapGrid> grids;
};
/// Of conditions, the first `most` only.
ReportFigures report_figures(const StudyReport& report);
inline constexpr std::size_t most_drawn = 12;  ///< conditions with figures of their own

/// Letters, digits, '_' and '-' of a name, anything else as '_'; with its number in front so that
/// no two are the same.
std::string file_name_of(const std::string& what, std::size_t number, const std::string& name);

/// The page: one HTML file that needs nothing else. `svg`: what gnuplot drew for each figure of
/// report_figures(), in its order. Throws std::runtime_error if a drawing is none.
std::string report_page(const StudyReport& report, const ReportFigures& figures,
                        const std::vector<std::string>& svg);

}  // namespace tiltrim
