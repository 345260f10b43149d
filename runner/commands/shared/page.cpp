#include "runner/commands/shared/page.h"

#include <string_view>

#include "analysis/text.h"

namespace palpate::runner {
namespace {

constexpr std::string_view kHead =
    R"html(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<style>
:root { color-scheme: light dark; --paper: #fff; --ink: #1f2328; --soft: #59636e; --rule: #d6dbe1; --band: #f6f8fa; }
@media (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e6e9ec; --soft: #9aa4af; --rule: #343b43; --band: #1c2126; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2.5rem 1.5rem 4rem; max-width: 76rem; background: var(--paper); color: var(--ink);
  font: 16px/1.55 system-ui, "Helvetica Neue", Arial, sans-serif; }
h1 { font-size: 1.75rem; line-height: 1.25; margin: 0 0 1rem; text-wrap: balance; max-width: 54rem; }
ul { padding-left: 1.1rem; max-width: 58rem; }
li { margin: .35rem 0; }
figure { margin: 2rem 0; overflow-x: auto; }
figure svg { width: 100%; height: auto; display: block; border-radius: .5rem; border: 1px solid var(--rule); }
figcaption, .note { color: var(--soft); font-size: .9rem; margin: .5rem 0 0; max-width: 58rem; }
section { margin: 2.25rem 0; overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }
caption { text-align: left; white-space: nowrap; font-weight: 600; font-size: 1.05rem; padding-bottom: .5rem; }
th, td { padding: .25rem .8rem; text-align: right; white-space: nowrap; border-bottom: 1px solid var(--rule); }
th { color: var(--soft); font-weight: 600; font-size: .82rem; border-bottom-width: 2px; white-space: normal; vertical-align: bottom; }
.name { text-align: left; }
th.name:first-child, td.name:first-child { padding-left: 0; }
tbody tr:hover { background: var(--band); }
@media print { body { max-width: none; padding: 0; font-size: 10pt; } section, figure { break-inside: avoid; } }
</style>
)html";

void put_row(std::string& out, const std::vector<std::string>& cells, std::size_t n_names,
             bool head) {
  out += "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    out += head ? "<th scope=\"col\"" : "<td";
    if (i < n_names) out += " class=\"name\"";
    out += '>';
    out += analysis::escaped(cells[i]);
    out += head ? "</th>" : "</td>";
  }
  out += "</tr>\n";
}

void put_table(std::string& out, const analysis::Table& table) {
  out +=
      "<section>\n<table>\n<caption>" + analysis::escaped(table.caption) + "</caption>\n<thead>\n";
  put_row(out, table.header, table.n_names, true);
  out += "</thead>\n<tbody>\n";
  for (const auto& row : table.rows) put_row(out, row, table.n_names, false);
  out += "</tbody>\n</table>\n";
  for (const std::string& note : table.notes)
    out += "<p class=\"note\">" + analysis::escaped(note) + "</p>\n";
  out += "</section>\n";
}

void put_list(std::string& out, const std::vector<std::string>& items) {
  if (items.empty()) return;
  out += "<ul>\n";
  for (const std::string& item : items) out += "<li>" + analysis::escaped(item) + "</li>\n";
  out += "</ul>\n";
}

}  // namespace

std::string page_html(const ReportPage& page) {
  std::string out(kHead);
  out += "<title>" + analysis::escaped(page.title) + "</title>\n</head>\n<body>\n<main>\n<h1>" +
         analysis::escaped(page.title) + "</h1>\n";
  put_list(out, page.sentences);
  for (const ReportPage::Figure& figure : page.figures) {
    out += "<figure>\n" + figure.svg;
    if (!figure.caption.empty())
      out += "<figcaption>" + analysis::escaped(figure.caption) + "</figcaption>\n";
    out += "</figure>\n";
  }
  for (const analysis::Table& table : page.tables) put_table(out, table);
  put_list(out, page.notes);
  return out + "</main>\n</body>\n</html>\n";
}

}  // namespace palpate::runner
