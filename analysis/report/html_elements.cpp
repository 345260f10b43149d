#include "analysis/report/html_elements.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "analysis/text.h"
#include "data/base/checksum.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kMostRows = 400, kMostColumns = 60;

void put_row(std::string& out, const std::vector<std::string>& cells, std::size_t n_names,
             bool header) {
  out += "<tr>";
  const std::size_t n = std::min(cells.size(), kMostColumns);
  for (std::size_t c = 0; c < n; ++c) {
    const std::string_view tag = header || c == 0 ? "th" : "td";
    out += '<';
    out += tag;
    if (header) {
      out += " scope=\"col\"";
    } else if (c == 0) {
      out += " scope=\"row\"";
    }
    if (c < n_names) out += " class=\"name\"";
    out += '>';
    out += escaped(printable(cells[c], 2000));
    out += "</";
    out += tag;
    out += '>';
  }
  out += "</tr>\n";
}

int digit_of(char hex) { return hex <= '9' ? hex - '0' : hex - 'a' + 10; }

}  // namespace

std::string escaped_sentence(std::string_view text) {
  std::string out = escaped(text);
  for (std::size_t at = 0; (at = out.find(" %", at)) != std::string::npos;) {
    out.replace(at, 1, "\u00a0");
  }
  return out;
}

std::string escaped_lines(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (line.ends_with('\r')) line.remove_suffix(1);
    std::string plain(line);
    std::ranges::replace(plain, '\t', ' ');
    out += escaped(plain);
    out += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

void put_table(std::string& out, const Table& table) {
  out += "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"";
  out += escaped(table.caption) + "\">\n<table>\n<caption>" + escaped_sentence(table.caption) +
         "</caption>\n<thead>\n";
  put_row(out, table.header, table.n_names, true);
  out += "</thead>\n<tbody>\n";
  const std::size_t n = std::min(table.rows.size(), kMostRows);
  for (std::size_t r = 0; r < n; ++r) put_row(out, table.rows[r], table.n_names, false);
  out += "</tbody>\n</table>\n</div>\n";
  const auto note = [&](std::string_view text) {
    out += "<p class=\"note\">" + escaped_sentence(printable(text, 4000)) + "</p>\n";
  };
  if (n < table.rows.size() || table.header.size() > kMostColumns) {
    note("Cut to " + std::to_string(kMostRows) + " rows and " + std::to_string(kMostColumns) +
         " columns; the JSON file has all.");
  }
  for (const std::string& text : table.notes) note(text);
}

void put_collapsible_tables(std::string& out, std::string_view summary,
                            const std::vector<Table>& tables) {
  out += "<details>\n<summary>" + escaped(summary) + "</summary>\n";
  for (const Table& table : tables) put_table(out, table);
  out += "</details>\n";
}

std::string script_hash(std::string_view script) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string hex = checksum_hex(script);
  std::string out = "sha256-";
  for (std::size_t at = 0; at < hex.size(); at += 6) {  // 3 bytes are 4 base64 digits
    std::uint32_t bits = 0;
    const std::size_t n = std::min<std::size_t>(6, hex.size() - at);
    for (std::size_t i = 0; i < 6; ++i) {
      bits = bits * 16 + static_cast<std::uint32_t>(i < n ? digit_of(hex[at + i]) : 0);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      out += i <= n / 2 ? kDigits[(bits >> (18 - 6 * i)) & 63] : '=';
    }
  }
  return out;
}

}  // namespace palpate::analysis
