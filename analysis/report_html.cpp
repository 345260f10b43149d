#include "analysis/report_html.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/figure.h"
#include "analysis/tables.h"
#include "analysis/text.h"

namespace palpate {

namespace {

constexpr std::string_view kStyle = R"css(
:root { color-scheme: light dark; --paper: #fff; --ink: #1f2328; --soft: #59636e; --rule: #d6dbe1;
  --band: #f6f8fa; --amber: #fff4d6; --amber-ink: #6b4303; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e6e9ec; --soft: #9aa4af;
  --rule: #343b43; --band: #1c2126; --amber: #3d2e0a; --amber-ink: #ffd98a; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 66rem; background: var(--paper);
  color: var(--ink); font: 16px/1.55 system-ui, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.75rem; line-height: 1.25; margin: 0 0 .5rem; text-wrap: balance; }
.lead { color: var(--soft); margin: 0 0 1.5rem; }
.simulated { background: var(--amber); color: var(--amber-ink); border-radius: .5rem;
  padding: .6rem 1rem; margin: 0 0 1.5rem; font-weight: 600; }
.warnings { border-left: 4px solid #b7791f; padding: .1rem 0 .1rem 1rem; margin: 0 0 1.5rem;
  list-style: none; }
.warnings li { margin: .3rem 0; overflow-wrap: anywhere; }
figure { margin: 0 0 2rem; overflow-x: auto; }
figure svg { width: 100%; height: auto; display: block; border-radius: .5rem;
  border: 1px solid var(--rule); }
section { margin: 2.25rem 0; overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .94rem; }
caption { text-align: left; white-space: nowrap; font-weight: 600; font-size: 1.05rem; padding-bottom: .5rem; }
th, td { padding: .3rem .9rem; text-align: right; white-space: nowrap; }
th { color: var(--soft); font-weight: 600; font-size: .85rem; border-bottom: 2px solid var(--rule); }
td { border-bottom: 1px solid var(--rule); }
.name { text-align: left; white-space: normal; overflow-wrap: anywhere; }
th.name:first-child, td.name:first-child { padding-left: 0; }
tbody tr:hover { background: var(--band); }
.note { color: var(--soft); font-size: .88rem; margin: .5rem 0 0; max-width: 48rem; }
@media print { body { max-width: none; padding: 0; font-size: 11pt; }
  section, figure { break-inside: avoid; } figure svg { min-width: 0 !important; } }
)css";

/// Text with each number kept on one line with its percent sign.
std::string escaped_sentence(std::string_view text) {
  std::string out = escaped(text);
  for (std::size_t at = 0; (at = out.find(" %", at)) != std::string::npos;) {
    out.replace(at, 1, "\u00a0");
  }
  return out;
}

void put_row(std::string& out, const std::vector<std::string>& cells, std::size_t n_names,
             const std::string& tag) {
  out += "<tr>";
  for (std::size_t c = 0; c < cells.size(); ++c) {
    out += "<" + tag;
    if (tag == "th") out += " scope=\"col\"";
    if (c < n_names) out += " class=\"name\"";
    out += ">" + escaped(cells[c]) + "</" + tag + ">";
  }
  out += "</tr>\n";
}

void put_table(std::string& out, const Table& table) {
  out += "<section>\n<table>\n<caption>" + escaped(table.caption) + "</caption>\n<thead>\n";
  put_row(out, table.header, table.n_names, "th");
  out += "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) put_row(out, row, table.n_names, "td");
  out += "</tbody>\n</table>\n";
  for (const std::string& note : table.notes) {
    out += "<p class=\"note\">" + escaped_sentence(note) + "</p>\n";
  }
  out += "</section>\n";
}

}  // namespace

std::string report_html(const Analysis& analysis) {
  const std::string label = simulated_label(analysis.table.simulated);
  const std::string title = escaped_sentence(answer(analysis));
  const Counts& counts = analysis.description.counts;
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'unsafe-inline'; base-uri 'none'; form-action 'none'\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>";
  if (!label.empty()) out += label + ": ";
  out += title;
  out += "</title>\n<style>";
  out += kStyle;
  out += "</style>\n</head>\n<body>\n<main>\n<h1>" + title + "</h1>\n<p class=\"lead\">";
  out += counted(counts.n_participants, "participant", "participants") + ", " +
         counted(counts.n_trials, "trial", "trials") + ", " +
         fixed(100 * counts.accuracy.value_or(0), 1) + " % correct; " +
         counted(counts.n_used_for_times, "time", "times") + " used.</p>\n";
  if (!label.empty()) {
    out += "<p class=\"simulated\">" + label;
    out += analysis.table.simulated == Simulated::yes
               ? ": every figure here comes from a model of a person, not from people.</p>\n"
               : ": the figures here mix a model of a person with people.</p>\n";
  }
  if (!analysis.warnings.empty()) {
    out += "<ul class=\"warnings\">\n";
    for (const std::string& warning : analysis.warnings) {
      out += "<li>Warning: " + escaped_sentence(warning) + "</li>\n";
    }
    out += "</ul>\n";
  }
  out += "<figure>\n" + figure15(analysis) + "</figure>\n";
  for (const Table& table : all_tables(analysis)) put_table(out, table);
  return out + "</main>\n</body>\n</html>\n";
}

}  // namespace palpate
