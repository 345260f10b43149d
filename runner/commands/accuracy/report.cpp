#include "runner/commands/accuracy/report.h"

#include <algorithm>
#include <sstream>

#include "analysis/report/html_page.h"
#include "analysis/text.h"
#include "rendering/accuracy/peers.h"

namespace palpate::runner {
namespace {

/// What was measured, how the numbers are defined, and what the methods are.
std::vector<std::string> how_to_read(const AccuracyReport& report) {
  const rendering::AccuracySettings& s = report.settings;
  std::vector<std::string> all;
  all.emplace_back(
      "Measured on " + std::to_string(s.paths) + " paths for each shape and probe, " +
      std::to_string(s.contact_ticks) +
      " ticks of contact each: a hand at 0.1 m/s, 1 to 2 mm deep, wandering over the shape "
      "with a stylus of " +
      significant(1e3 * s.length) + " mm (rendering/accuracy/analytic_stroke.h; seeds 1 to " +
      std::to_string(s.paths) +
      "). Sphere of radius 30 mm; cone and cylinder of radius 30 mm, 60 mm high; cube of 60 "
      "mm; box of 80 x 60 x 40 mm. Forces at 800 N/m.");
  all.emplace_back(
      "A result is compared with the exact local minimum of the penetration depth that is nearest "
      "to "
      "it in direction: a god-object keeps to the side by which it entered, which need not be that "
      "of least depth (\"not least\": such ticks). A lost contact counts with its whole depth and "
      "force.");
  all.emplace_back(
      "Depths are along that direction, angles in degrees, forces and torques (about the tip) "
      "differences of vectors, points on the ideal probe. Times are means over the ticks in "
      "contact, the fastest of three runs, on this machine.");
  all.emplace_back(
      "Contact points and torques are compared where the stylus is more than 2 degrees off every "
      "flat that it touches; closer, it is touched along a length and the contact point is a "
      "convention (equation "
      "(2)).");
  all.emplace_back(
      "Worst: about once in 10,000 ticks the contact on a tessellation leaves a side one tick "
      "before "
      "or after that on the shape does.");
  for (const rendering::MethodDefinition& method : rendering::contact_methods()) {
    std::string line = "Method ";
    line += method.name;
    line += ": ";
    line += method.description;
    all.push_back(line + ".");
  }
  for (const rendering::PeerLibrary& library : rendering::peer_libraries()) {
    if (library.make) continue;
    std::string line = "Method ";
    line += library.name;
    all.push_back(line + ": absent from this build (PALPATE_PEERS).");
  }
  return all;
}

constexpr const char* kQuestion =
    "Which tessellation? The coarsest with 99.9 % of ticks below what a hand can feel (force "
    "direction 10 degrees, surface position 1 mm), and below what a device resolves (0.03 mm); "
    "point and ray.";

void put_wrapped(std::ostream& out, const std::string& text) {
  constexpr std::size_t kColumns = 98;
  for (const std::string& line : analysis::wrapped(
           text, [](std::string_view part) { return analysis::width(part) <= kColumns; })) {
    out << "  " << line << "\n";
  }
}

}  // namespace

void put_table(std::ostream& out, const analysis::Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& name : table.header) widths.push_back(analysis::width(name));
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], analysis::width(row[i]));
  }
  out << "\n" << table.caption << "\n";
  const auto put = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      line += "  " + (i < table.n_names ? analysis::pad_right(cells[i], widths[i])
                                        : analysis::pad_left(cells[i], widths[i]));
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out << line << "\n";
  };
  put(table.header);
  for (const auto& row : table.rows) put(row);
  for (const std::string& note : table.notes) out << "  " << note << "\n";
}

std::string accuracy_text(const AccuracyReport& report) {
  std::ostringstream out;
  if (!report.rows.empty()) {
    put_wrapped(out, kQuestion);
    out << "\n";
    for (const std::string& sentence : recommendations(report)) out << "  " << sentence << "\n";
  }
  for (const analysis::Table& table : accuracy_tables(report)) put_table(out, table);
  if (!report.rows.empty()) {
    out << "\nHow to read it\n";
    for (const std::string& note : how_to_read(report)) put_wrapped(out, note);
  }
  return out.str();
}

std::string accuracy_page(const AccuracyReport& report) {
  const bool measured = !report.rows.empty();
  analysis::HtmlPage page(measured ? "How far the forces are from the exact ones, and at what cost"
                                   : "How many random ticks are wrong");
  if (measured) {
    std::vector<std::string> sentences = recommendations(report);
    sentences.insert(sentences.begin(), kQuestion);
    analysis::put_list(page.below_title(), sentences);
    page.put_figure_section(accuracy_figure(report), "Error over time");
  }
  page.begin_section("tables", "The numbers", "Numbers");
  for (const analysis::Table& table : accuracy_tables(report))
    analysis::put_table(page.body(), table);
  page.end_section();
  if (measured) {
    page.begin_section("reading", "How to read it", "How to read it");
    analysis::put_list(page.body(), how_to_read(report));
    page.end_section();
  }
  return page.html("palpate " PALPATE_VERSION ".");
}

}  // namespace palpate::runner
