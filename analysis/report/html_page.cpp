#include "analysis/report/html_page.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "analysis/figures/svg.h"
#include "analysis/text.h"
#include "data/base/checksum.h"

namespace palpate::analysis {

namespace {

constexpr std::size_t kMostRows = 400, kMostColumns = 60;

/// \throws std::logic_error: its cells are not those of the header
void put_row(std::string& out, const std::vector<std::string>& cells, const Table& table,
             bool header) {
  if (cells.size() != table.header.size())
    throw std::logic_error("table '" + table.caption + "': a row of " +
                           std::to_string(cells.size()) + " cells under " +
                           std::to_string(table.header.size()) + " headings");
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
    if (c < table.n_names || c + table.n_remarks >= cells.size()) out += " class=\"name\"";
    out += '>';
    out += escaped(printable(cells[c], 2000));
    out += "</";
    out += tag;
    out += '>';
  }
  out += "</tr>\n";
}

int digit_of(char hex) { return hex <= '9' ? hex - '0' : hex - 'a' + 10; }

/// Buttons that the script shows: it reads the table above them.
void put_table_tools(std::string& out, std::string_view caption) {
  out += "<div class=\"tools of-table\">\n";
  for (const auto& [kind, name] : {std::pair{"copy", "Copy"}, std::pair{"csv", "Save as CSV"}}) {
    out += std::string("<button type=\"button\" data-table=\"") + kind +
           "\" hidden=\"hidden\" aria-label=\"" + name + ": the table “" + escaped(caption) +
           "”\">" + name + "</button>\n";
  }
  out += "</div>\n";
}

std::string colours(const Palette& palette) {
  std::string out = ":root {";
  for (std::size_t r = 0; r < kRoles; ++r) {
    out += " --";
    out += to_string(static_cast<Role>(r));
    out += ": " + palette[r] + ";";
  }
  return out + " }\n";
}

std::string style() {
  return colours(light_palette()) + "@media screen and (prefers-color-scheme: dark) {\n" +
         colours(dark_palette()) + "}\n" + std::string(report_style());
}

/// The light palette as JSON, for figures that the script saves.
std::string saved_colours() {
  nlohmann::ordered_json json;
  const Palette light = light_palette();
  for (std::size_t r = 0; r < kRoles; ++r) json[to_string(static_cast<Role>(r))] = light[r];
  return json.dump();
}

void put_choice(std::string& out, const std::vector<std::string>& participants) {
  out +=
      "<label hidden=\"hidden\">Highlight a participant <select id=\"person\"><option "
      "value=\"\">none</option>";
  for (const std::string& name : participants) {
    out += "<option value=\"" + escaped(name) + "\">" + escaped(name) + "</option>";
  }
  out += "</select></label>\n";
}

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
  put_row(out, table.header, table, true);
  out += "</thead>\n<tbody>\n";
  const std::size_t n = std::min(table.rows.size(), kMostRows);
  for (std::size_t r = 0; r < n; ++r) put_row(out, table.rows[r], table, false);
  out += "</tbody>\n</table>\n</div>\n";
  put_table_tools(out, table.caption);
  const auto note = [&](std::string_view text) {
    out += "<p class=\"note\">" + escaped_sentence(printable(text, 4000)) + "</p>\n";
  };
  if (n < table.rows.size() || table.header.size() > kMostColumns) {
    note("Cut to " + std::to_string(kMostRows) + " rows and " + std::to_string(kMostColumns) +
         " columns; the JSON file is complete.");
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

HtmlPage::HtmlPage(std::string title, std::string label)
    : title_(std::move(title)), label_(std::move(label)) {}

void HtmlPage::put_banner(std::string_view text) {
  banner_ += "<div class=\"flag\" role=\"note\">" + escaped(text) + "</div>\n";
}

void HtmlPage::begin_section(std::string_view id, std::string_view title, std::string_view link) {
  const std::string name(id);
  body_ += "<section id=\"" + name + "\" aria-labelledby=\"" + name + "-heading\">\n<h2 id=\"" +
           name + "-heading\">" + escaped(title) + "</h2>\n";
  links_ += "<li><a href=\"#" + name + "\">" + escaped(link) + "</a></li>\n";
}

void HtmlPage::end_section() { body_ += "</section>\n"; }

void HtmlPage::put_figure(const Figure& figure, const std::vector<std::string>& participants) {
  body_ += "<figure>\n<div class=\"drawing\">\n<div class=\"wide-screen\">" +
           figure_svg(figure, page_palette(), FigurePlacement::in_page) +
           "</div>\n<div class=\"narrow-screen\">" +
           figure_svg(figure, page_palette(), FigurePlacement::in_narrow_page) + "</div>\n</div>\n";
  if (!figure.notes.empty()) {
    body_ += "<figcaption>";
    for (const std::string& note : figure.notes) body_ += escaped_sentence(note) + " ";
    body_ += "</figcaption>\n";
  }
  body_ += "</figure>\n<div class=\"tools\" data-figure=\"" + figure.id + "\">\n";
  for (const auto& [kind, name] : {std::pair{"svg", "SVG"}, std::pair{"png", "PNG"}}) {
    body_ += std::string("<button type=\"button\" data-save=\"") + kind +
             "\" hidden=\"hidden\" aria-label=\"Save the figure “" + escaped(figure.title) +
             "” as " + name + "\">Save as " + name + "</button>\n";
  }
  if (!participants.empty()) put_choice(body_, participants);
  body_ += "</div>\n";
}

void HtmlPage::put_figure_section(const Figure& figure, std::string_view link) {
  begin_section(figure.id, figure.title, link);
  put_figure(figure);
  end_section();
}

void HtmlPage::put_note(std::string_view text) {
  body_ += "<p class=\"note\">" + escaped(text) + "</p>\n";
}

std::string HtmlPage::head() const {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src '";
  out += script_hash(report_script());
  out +=
      "'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>";
  if (!label_.empty()) out += label_ + ": ";
  return out + escaped_sentence(title_) +
         "</title>\n<link rel=\"icon\" href=\"data:,\"/>\n<style>" + style() +
         "</style>\n</head>\n";
}

std::string HtmlPage::html(std::string_view footer) const {
  std::string out = head();
  out += "<body>\n<a class=\"skip\" href=\"#content\">To the content</a>\n" + banner_ +
         "<header>\n" + above_title_ + "<h1>" + escaped_sentence(title_) + "</h1>\n" +
         below_title_ + "</header>\n<nav aria-label=\"Sections of the report\"><ul>\n" + links_ +
         "</ul></nav>\n<main id=\"content\">\n" + body_ + "</main>\n<footer><p>" + escaped(footer) +
         " This page is self-contained and loads nothing from the network.</p></footer>\n"
         "<script type=\"application/json\" id=\"saved-colours\">" +
         saved_colours() + "</script>\n<script>";
  out += report_script();
  return out + "</script>\n</body>\n</html>\n";
}

void put_registration_section(HtmlPage& page, const std::string& checked,
                              const std::string& check_page) {
  if (checked.empty()) return;
  page.begin_section("registration",
                     check_page.empty() ? "Registration" : "Check against the registration",
                     "Registration");
  page.body() += "<p>" + escaped_sentence(printable(checked, 4000)) + "</p>\n";
  if (!check_page.empty())
    page.body() += "<p><a href=\"" + escaped(check_page) + "\">The check, point by point</a></p>\n";
  page.end_section();
}

void put_list(std::string& out, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return;
  out += "<ul>\n";
  for (const std::string& sentence : sentences)
    out += "<li>" + escaped_sentence(sentence) + "</li>\n";
  out += "</ul>\n";
}

void put_quotable(std::string& out, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return;
  out += "<h3>To quote</h3>\n";
  put_list(out, sentences);
}

}  // namespace palpate::analysis
