#include "analysis/report/html_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "analysis/figures/figure_svg.h"
#include "analysis/figures/svg.h"
#include "analysis/report/html_elements.h"
#include "analysis/report/report_assets.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

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

void put_list(std::string& out, const std::vector<std::string>& sentences) {
  if (sentences.empty()) return;
  out += "<ul>\n";
  for (const std::string& sentence : sentences)
    out += "<li>" + escaped_sentence(sentence) + "</li>\n";
  out += "</ul>\n";
}

}  // namespace palpate::analysis
