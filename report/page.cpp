// Assembles the report's page from text, tables and drawings; computes nothing.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "report/figure_parts.hpp"
#include "report/json.hpp"
#include "report/map_parts.hpp"
#include "report/map_sheets.hpp"
#include "report/page_assets.hpp"
#include "report/page_data.hpp"
#include "report/study_report.hpp"

namespace tiltrim {

using json::ordered_json;

namespace {

// ---- Colours ------------------------------------------------------------------------------------

// "#rrggbb" as gnuplot writes it.
std::string as_drawn(const std::string& colour) {
  const auto part = [&](std::size_t at) { return std::stoi(colour.substr(at, 2), nullptr, 16); };
  return fmt::format("rgb({:3}, {:3}, {:3})", part(1), part(3), part(5));
}

// Replaces gnuplot's fixed colours by the page's, which follow its light or dark theme.
std::string colour_styles() {
  std::string light, dark, rules;
  const std::vector<FigureColour>& colours = figure_colours();
  for (std::size_t k = 0; k < colours.size(); ++k) {
    light += fmt::format("--figure-{}:{};", k, colours[k].light);
    dark += fmt::format("--figure-{}:{};", k, colours[k].dark);
    for (const char* attribute : {"stroke", "fill", "color"})
      rules += fmt::format(".figure [{0}=\"{1}\"]{{{0}:var(--figure-{2})}}\n", attribute,
                           as_drawn(colours[k].light), k);
  }
  return fmt::format(
      ":root{{{0}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{1}}}}}\n{2}", light,
      dark, rules);
}

// ---- Parts --------------------------------------------------------------------------------------

// Sources of the page's parts.
struct Parts {
  const StudyReport& report;
  const ReportFigures& figures;
  std::vector<NamedSheet> sheets;
  std::map<std::string, std::string> drawn;                     // figures by name
  std::vector<std::pair<std::string, std::string>> sections{};  // id and title
};

std::string paragraph(const std::string& words) { return "<p>" + html_escaped(words) + "</p>\n"; }

std::string section(Parts& parts, const std::string& id, const std::string& title,
                    const std::string& body) {
  if (body.empty()) return "";
  parts.sections.emplace_back(id, title);
  return fmt::format(
      "<section id=\"{0}\" aria-labelledby=\"{0}-title\">\n<h2 "
      "id=\"{0}-title\">{1}</h2>\n{2}</section>\n",
      id, html_escaped(title), body);
}

std::string table(const Parts& parts, const std::string& name) {
  const auto found = std::ranges::find(parts.sheets, name, &NamedSheet::name);
  if (found == parts.sheets.end() || found->sheet.rows.empty()) return "";
  return fmt::format(
      "<div class=\"table\" data-table=\"{}\" role=\"group\" aria-label=\"{}\" "
      "tabindex=\"0\">\n{}</div>\n",
      name, html_escaped(found->sheet.title.empty() ? name : found->sheet.title),
      as_html(found->sheet));
}

// All tables whose names begin with the prefix.
std::string tables(const Parts& parts, const std::string& prefix) {
  std::string all;
  for (const NamedSheet& s : parts.sheets)
    if (s.name.starts_with(prefix)) all += table(parts, s.name);
  return all;
}

std::string figure(const Parts& parts, const std::string& name) {
  const auto drawn = parts.drawn.find(name);
  if (drawn == parts.drawn.end()) return "";
  const Figure& f = *std::ranges::find(parts.figures.figures, name, &Figure::name);
  return fmt::format(
      "<figure>\n<div class=\"plot\">{}<div class=\"tip\" "
      "aria-hidden=\"true\"></div></div>\n<figcaption>{}</figcaption>\n</figure>\n",
      drawn->second, html_escaped(f.caption + "."));
}

std::string slider(const std::string& id, const std::string& label, std::size_t count) {
  return fmt::format(
      "<div><label for=\"{0}\">{1}</label><input type=\"range\" id=\"{0}\" min=\"0\" max=\"{2}\" "
      "step=\"1\" value=\"0\"></div>\n",
      id, html_escaped(label), count - 1);
}

std::string controls(const Parts& parts, const std::string& track) {
  const auto t = std::ranges::find(parts.figures.tracks, track, &Track::name);
  if (t == parts.figures.tracks.end()) return "";
  const Track::Column& p = t->columns.front();
  return fmt::format(
      "<div class=\"controls{}\" data-track=\"{}\">\n{}<output for=\"slider-{}\" "
      "aria-live=\"polite\"></output></div>\n",
      t->modes.empty() ? " still" : "", track,
      slider("slider-" + track, figures::with_unit(p.title, p.unit), p.values.size()), track);
}

std::string conditions_part(Parts& parts) {
  return section(parts, "conditions", "Conditions",
                 table(parts, "conditions") + tables(parts, "trims_"));
}

std::string unanswered_part(Parts& parts) {
  const std::vector<Unanswered> open = unanswered(parts.report);
  std::string body;
  if (open.empty())
    body = paragraph(
        "Nothing is missing: every condition and every point of the maps has a verified "
        "equilibrium and a verdict.");
  for (const Unanswered& u : open) {
    std::string more;
    for (const std::string& words : u.more) more += "<li>" + html_escaped(words) + "</li>";
    body += fmt::format("<dt>{}</dt><dd>{}{}</dd>\n", html_escaped(u.what), html_escaped(u.why),
                        more.empty() ? "" : "<ul>" + more + "</ul>");
  }
  if (!open.empty()) body = "<dl class=\"unanswered\">\n" + body + "</dl>\n";
  return section(parts, "unanswered", "Unanswered, and why", body);
}

std::string modes_part(Parts& parts) {
  std::string body;
  for (std::size_t i = 0; i < parts.report.conditions.size(); ++i) {
    const std::string id = file_name_of("", i, parts.report.conditions[i].answer.condition.name);
    body += table(parts, "modes_" + id);
    body += figure(parts, "participation_" + id);
  }
  if (!body.empty() && parts.report.conditions.size() > most_drawn)
    body = paragraph(
               fmt::format("Figures show the first {} conditions; tables show all.", most_drawn)) +
           body;
  return section(parts, "modes", "Eigenvalues and modes", body);
}

// The file that a map was read from, and what it covers: perhaps not what the study asks for.
std::string origin(const StudyReport::Map& map) {
  if (map.file.empty()) return "";
  std::string axes;
  for (const SweepAxis& axis : map.map.axes)
    axes += (axes.empty() ? "" : "; ") + axis_in_words(axis);
  return paragraph("Read from " + map.file + ": " + axes + ".");
}

std::string lines_part(Parts& parts) {
  std::string all;
  std::size_t number = 0;
  for (const StudyReport::Map& m : parts.report.maps)
    for (std::size_t c = 0; c < m.map.conditions.size(); ++c, ++number) {
      if (m.map.axes.size() != 1) continue;
      const std::string id = file_name_of("", number, m.map.conditions[c]);
      const std::string name = name_of(parts.report, m, c);
      std::string body =
          paragraph(counts_in_words(m.map, c) +
                    (m.map.intervals.empty() ? "." : "; " + line_in_words(m.map, c, 0) + "."));
      body += origin(m);
      body += table(parts, "intervals_" + id) + controls(parts, "along_" + id);
      if (const auto same = parts.figures.constant.find("trim_" + id);
          same != parts.figures.constant.end())
        body += paragraph(same->second + ".");
      for (const char* what : {"trim_", "locus_", "locus_slow_", "modes_"})
        body += figure(parts, what + id);
      all += section(parts, "along-" + id,
                     fmt::format("Along {}{}", m.map.axes[0].name, name.empty() ? "" : ": " + name),
                     body);
    }
  return all;
}

std::string maps_part(Parts& parts) {
  std::string body;
  std::size_t number = 0;
  for (const StudyReport::Map& m : parts.report.maps)
    for (std::size_t c = 0; c < m.map.conditions.size(); ++c, ++number) {
      if (m.map.axes.size() != 2) continue;
      const std::string id = file_name_of("", number, m.map.conditions[c]);
      const MapGrid& g = *std::ranges::find(parts.figures.grids, "map_" + id, &MapGrid::name);
      body += "<h3>" +
              html_escaped(fmt::format("{} and {}: {}{}", g.x_name, g.y_name, m.map.conditions[c],
                                       m.file.empty() ? "" : ", " + m.file)) +
              "</h3>\n";
      body += paragraph(counts_in_words(m.map, c) + ".");
      body += origin(m);
      body += figure(parts, "stability_" + id);
      body += fmt::format(
          "<div class=\"controls still\" data-grid=\"{}\">\n{}{}<output "
          "aria-live=\"polite\"></output></div>\n",
          g.name, slider("x-" + g.name, figures::with_unit(g.x_name, g.x.unit), g.x.values.size()),
          slider("y-" + g.name, figures::with_unit(g.y_name, g.y.unit), g.y.values.size()));
    }
  return section(parts, "maps", "Stability maps", body);
}

std::string margins_part(Parts& parts) {
  std::string body = table(parts, "margins");
  for (std::size_t i = 0; i < parts.report.loops.size(); ++i) {
    const std::string id = file_name_of("", i, parts.report.loops[i].trimmed.condition.name);
    const std::string bode = figure(parts, "bode_" + id);
    if (!bode.empty()) body += controls(parts, "bode_" + id) + bode + figure(parts, "disk_" + id);
  }
  return section(parts, "margins", "Margins", body);
}

std::string proofs_part(Parts& parts) {
  std::string body;
  for (std::size_t i = 0; i < parts.report.theorems.size(); ++i) {
    const Theorem& t = parts.report.theorems[i];
    body += paragraph(fmt::format(
        "{}: shares of the box proved stable {:.9g}, unstable {:.9g}, without trim {:.9g}; "
        "undecided {:.3g}. Stable: every eigenvalue has a real part below {:.6g} 1/s.",
        t.name, t.stable, t.unstable, t.no_trim, t.undecided, t.margin == 0 ? 0.0 : -t.margin));
    body += figure(parts, "proof_" + file_name_of("", i, t.name));
  }
  return section(parts, "proofs", "What is proved", body);
}

std::string flight_part(Parts& parts) {
  if (parts.report.motion)
    return section(parts, "flight", "The motion",
                   paragraph(outcome_of(*parts.report.motion)) + figure(parts, "motion") +
                       tables(parts, "motion_"));
  if (!parts.report.flight) return "";
  const FlightReport& f = *parts.report.flight;
  std::string body;
  for (const std::string& words : flight_words(f)) body += paragraph(words);
  body += controls(parts, "flight");
  for (const char* name :
       {"flight_angles", "flight_speeds", "flight_controls", "flight_energy", "flight_path"})
    body += figure(parts, name);
  return section(parts, "flight", "The flight", body + tables(parts, "flight_"));
}

std::string paper_part(Parts& parts) {
  if (!parts.report.paper) return "";
  const PaperTables& t = *parts.report.paper;
  std::string body =
      paragraph("Source: " + t.published.source +
                ". Columns \"off\": computed less printed, in units of the last printed digit.");
  body += tables(parts, "paper_");
  std::string slips;
  for (const Slip& slip : t.slips) {
    slips += fmt::format("<li><strong>{}</strong> ({}). Printed: {}. Consistent: {}. Why: {}<ul>",
                         html_escaped(slip.where), slip.confirmed() ? "confirmed" : "not confirmed",
                         html_escaped(slip.printed), html_escaped(slip.consistent),
                         html_escaped(slip.why));
    constexpr double rounding = 1e-14;  // of differences between numbers near 1
    for (const Evidence& e : slip.evidence)
      slips += fmt::format("<li>{}: {:.6g}{}</li>", html_escaped(e.what),
                           std::abs(e.value) < rounding ? 0 : e.value,
                           html_escaped(e.unit.empty() ? "" : " " + e.unit));
    slips += "</ul></li>\n";
  }
  body += fmt::format(
      "<details><summary>{} slips in the printed equations and "
      "tables</summary>\n<ol>\n{}</ol></details>\n",
      t.slips.size(), slips);
  body += "<h3>Findings</h3>\n<ul>\n";
  for (const std::string& finding : t.findings) body += "<li>" + html_escaped(finding) + "</li>\n";
  return section(parts, "paper", "The paper's Tables 1–3", body + "</ul>\n");
}

std::string study_part(Parts& parts) {
  const StudyReport& r = parts.report;
  std::string body = paragraph("Made by " + r.program +
                               " from the study below; the same command reproduces this page.");
  body += "<pre><code>" + html_escaped(r.command) + "</code></pre>\n";
  body += paragraph(
      "Tables as text, CSV, Markdown and LaTeX: --tables DIR. Figures as SVG, PDF and PNG for a "
      "column of 88 mm: --figures DIR.");
  return section(
      parts, "study", "The study, and how to reproduce this page",
      body + fmt::format("<details><summary>{}</summary>\n<pre><code>{}</code></pre></details>\n",
                         html_escaped(r.study.file.filename().string()),
                         html_escaped(r.study.text)));
}

// Good only if everything is.
const char* tone_of(const StudyReport& report) {
  const bool stable = std::ranges::all_of(report.conditions, [](const ConditionReport& c) {
    return c.modes && c.modes->verdict == Verdict::stable;
  });
  const bool between = std::ranges::all_of(report.maps, [](const StudyReport::Map& m) {
    return m.map.axes.size() > 1 || std::ranges::all_of(m.map.intervals, [](const AxisInterval& i) {
             return i.verdict == IntervalVerdict::stable;
           });
  });
  if (!unanswered(report).empty()) return "doubtful";
  const bool flown = (!report.flight || flown_well(*report.flight)) &&
                     (!report.motion || report.motion->answered());
  return stable && between && flown ? "good" : "bad";
}

}  // namespace

std::string report_page(const StudyReport& report, const ReportFigures& figures,
                        const std::vector<std::string>& svg) {
  Parts parts{report, figures, report_sheets(report), {}};
  for (std::size_t k = 0; k < figures.figures.size(); ++k)
    parts.drawn[figures.figures[k].name] = inline_svg(figures.figures[k], svg.at(k));
  // Analyses without an answer come first, if any.
  const bool open = !unanswered(report).empty();
  std::string body = open ? unanswered_part(parts) : "";
  for (const auto part : {conditions_part, proofs_part, lines_part, maps_part, modes_part,
                          margins_part, flight_part, paper_part})
    body += part(parts);
  if (!open) body += unanswered_part(parts);
  body += study_part(parts);
  std::string links;
  for (const auto& [id, title] : parts.sections)
    links += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", id, html_escaped(title));
  const std::string name = html_escaped(report.study.file.filename().string());
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; script-src 'nonce-tiltrim'; img-src data:\">\n"
      "<meta name=\"generator\" content=\"{0}\">\n<link rel=\"icon\" href=\"data:,\">\n<title>{1}: "
      "tiltrim report</title>\n<style>\n{2}{3}</style>\n</head>\n<body>\n"
      "<a class=\"skip\" href=\"#main\">Skip to the report</a>\n"
      "<header>\n<p class=\"kicker\">tiltrim report</p>\n<h1>{1}</h1>\n<p id=\"verdict\" "
      "class=\"verdict {4}\">{5}</p>\n</header>\n"
      "<nav aria-label=\"Parts of the report\">\n<ul>\n{6}</ul>\n</nav>\n{7}\n<main "
      "id=\"main\">\n{8}</main>\n"
      "<footer><p>{0}</p></footer>\n"
      "<script type=\"application/json\" id=\"data\">{9}</script>\n<script "
      "nonce=\"tiltrim\">\n{10}</script>\n</body>\n</html>\n",
      html_escaped(report.program), name, page_style, colour_styles(), tone_of(report),
      html_escaped(verdict_in_words(report)), links, svg.empty() ? "" : svg_shapes(svg.front()),
      body, script_data(figures), page_script);
}

}  // namespace tiltrim
