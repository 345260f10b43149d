#include "analysis/report/report_text.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kPageWidth = 100;
constexpr std::size_t kNameColumns = 24;   // largest width of a name in a table
constexpr std::size_t kValueColumns = 70;  // largest width of a text in the provenance table

std::string repeated(const char* what, std::size_t times) {
  std::string out;
  for (std::size_t i = 0; i < times; ++i) out += what;
  return out;
}

/// Appends a paragraph in lines of at most kPageWidth columns; a longer word is cut.
void put_wrapped(std::string& out, const std::string& text, const std::string& indent) {
  const std::size_t room = kPageWidth - indent.size();
  const auto fits = [&](std::string_view line) { return width(line) <= room; };
  for (const std::string& line : wrapped(printable(text), fits)) {
    out += indent + shortened(line, room) + "\n";
  }
}

/// Appends columns first to last - 1, preceded by the `n_front` columns of names.
void put_columns(std::string& out, const std::vector<std::vector<std::string>>& rows,
                 const std::vector<std::size_t>& widths, std::size_t first, std::size_t last,
                 std::size_t n_front, std::size_t n_names) {
  for (std::size_t r = 0; r < rows.size(); ++r) {
    std::string line;
    std::size_t rule = 0;
    for (std::size_t c = 0; c < last; c = c + 1 == n_front ? first : c + 1) {
      line += "  ";
      line += c < n_names ? pad_right(rows[r][c], widths[c]) : pad_left(rows[r][c], widths[c]);
      rule += widths[c] + 2;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
    if (r == 0) out += "  " + repeated("─", rule - 2) + "\n";
  }
}

void put_text_table(std::string& out, const Table& table) {
  const bool text_only = table.n_names == table.header.size();  // its last column is not aligned
  std::vector<std::vector<std::string>> rows{table.header};
  rows.insert(rows.end(), table.rows.begin(), table.rows.end());
  std::vector<std::size_t> widths(table.header.size());
  for (auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      row[c] = shortened(printable(row[c]), text_only && c == 1 ? kValueColumns : kNameColumns);
      widths[c] = std::max(widths[c], width(row[c]));
    }
  }
  put_wrapped(out, table.caption, "");
  const std::size_t n_front = text_only ? 1 : table.n_names;
  std::size_t front = 0;
  for (std::size_t c = 0; c < n_front; ++c) front += 2 + widths[c];
  std::size_t first = n_front;
  while (first < widths.size()) {
    std::size_t last = first, used = front;
    while (last < widths.size() && (last == first || used + 2 + widths[last] <= kPageWidth)) {
      used += 2 + widths[last++];
    }
    if (first > n_front) out += "  (continued)\n";
    put_columns(out, rows, widths, first, last, n_front, table.n_names);
    first = last;
  }
  for (const std::string& note : table.notes) put_wrapped(out, note, "  ");
}

}  // namespace

std::string table_text(const Table& table) {
  std::string out;
  put_text_table(out, table);
  return out;
}

std::string paragraph_text(const std::string& text) {
  std::string out;
  put_wrapped(out, text, "");
  return out;
}

std::string report_text(const Analysis& analysis) {
  std::string out;
  const std::string label = simulated_label(analysis.table.simulated);
  if (!label.empty()) {
    out += repeated("═", kPageWidth) + "\n";
    put_wrapped(
        out,
        label + (analysis.table.simulated == Simulated::yes
                     ? ": all numbers below are from a model of a participant, not from humans."
                     : ": the numbers below mix simulated participants with humans."),
        "  ");
    out += repeated("═", kPageWidth) + "\n\n";
  }
  put_wrapped(out, conclusion(analysis), "");
  const Counts& counts = analysis.description.counts;
  put_wrapped(out,
              counted(counts.n_participants, "participant", "participants") + ", " +
                  counted(counts.n_trials, "trial", "trials") + ", " +
                  fixed(100 * counts.accuracy.value_or(0), 1) + " % correct; " +
                  counted(counts.n_used_for_times, "time", "times") + " used.",
              "");
  for (const std::string& warning : analysis.warnings) {
    put_wrapped(out, "Warning: " + warning, "");
  }
  for (const Table& table : all_tables(analysis)) {
    out += "\n";
    put_text_table(out, table);
  }
  return out;
}

}  // namespace palpate::analysis
