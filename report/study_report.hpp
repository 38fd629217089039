/// A whole study in one report: tables, figures and summary. Computes nothing.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "prove/prove.hpp"
#include "report/conditions.hpp"
#include "report/figure.hpp"
#include "report/flights.hpp"
#include "report/motions.hpp"
#include "report/sheet.hpp"
#include "study/analyses.hpp"
#include "sweep/map.hpp"
#include "tables/tables.hpp"

namespace tiltrim {

/// An analysis without an answer, why, and what may help.
struct Unanswered {
  std::string what, why;
  std::vector<std::string> more{};
};

struct StudyReport {
  Study study;
  std::string program;  ///< "tiltrim 0.1.0"
  std::string command;  ///< reproduces the report
  std::vector<ConditionReport> conditions;
  std::vector<LoopsAnswer> loops;  ///< of the closed-loop conditions
  struct Map {
    SweepMap map;      ///< over one or two axes
    std::string file;  ///< the map's file; empty: computed
  };
  std::vector<Map> maps;
  std::optional<FlightReport> flight;
  std::optional<MotionAnswer> motion{};  ///< for a study with [model] and [simulate]
  std::optional<PaperTables> paper;
  std::vector<Theorem> theorems{};      ///< for a study with [prove]
  std::vector<Unanswered> not_swept{};  ///< maps that some of the study's conditions cannot have
  std::vector<std::string>
      not_examined{};  ///< after an interrupt: "condition 'climb'", "the flight"
};

/// Conditions first, then maps, margins, flight, tables.
std::vector<Unanswered> unanswered(const StudyReport& report);
/// True if the flight reached its end or landed.
bool flown_well(const FlightReport& flight);
/// What tells a line or map from others over the same axes: "level", "level, map.nc"; may be empty.
std::string name_of(const StudyReport& report, const StudyReport::Map& map, std::size_t condition);
/// The summary: what has no answer, what is stable and what is not.
std::string verdict_in_words(const StudyReport& report);

/// A table and the base name of its files: letters, digits, '_', '-'.
struct NamedSheet {
  std::string name;
  Sheet sheet;
};
/// All tables of the report, in order.
std::vector<NamedSheet> report_sheets(const StudyReport& report);

/// Values along one parameter, shown in figures and read with the page's slider.
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

/// A map over two axes, for reading on the page.
struct MapGrid {
  std::string name;            ///< "map_1_level"
  std::string x_name, y_name;  ///< of the axes, "h", "K_Lp"
  SweepAxis::Column x, y;
  /// [x * count of y + y]: the Verdict as a number, -1 without trim; largest real part in 1/s or
  /// NaN.
  std::vector<int> verdict;
  std::vector<double> abscissa;
};

struct ReportFigures {
  std::vector<Figure> figures;  ///< in order
  std::vector<Track> tracks;
  std::vector<MapGrid> grids;
  std::map<std::string, std::string> constant;  ///< trims that do not vary, in place of a figure
};
/// Figures of the first `most_drawn` conditions, and of everything else.
ReportFigures report_figures(const StudyReport& report);
inline constexpr std::size_t most_drawn = 12;  ///< conditions with figures

/// The number, then the name's letters, digits, '_' and '-' with '_' for anything else: a unique
/// file name.
std::string file_name_of(const std::string& what, std::size_t number, const std::string& name);

/// The page: one self-contained HTML file. `svg` holds gnuplot's drawing of each figure of
/// report_figures(), in order. Throws std::runtime_error for an invalid drawing.
std::string report_page(const StudyReport& report, const ReportFigures& figures,
                        const std::vector<std::string>& svg);

}  // namespace tiltrim
