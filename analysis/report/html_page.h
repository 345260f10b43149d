#pragma once
// A self-contained HTML page with sections, figures and tables.

#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"

namespace palpate::analysis {

/// report.css and report.js, embedded by the build (report_assets.cmake).
std::string_view report_style();
std::string_view report_script();

/// Escaped text with no-break spaces before percent signs.
std::string escaped_sentence(std::string_view text);

/// Escaped line by line, as escaped() makes line ends and tabs visible.
std::string escaped_lines(std::string_view text);

/// Appends a table in a box that scrolls horizontally, with buttons to copy and to save it, and its
/// notes below. At most 400 rows and 60 columns, with a note if it was cut.
void put_table(std::string& out, const Table& table);

/// Appends tables in a collapsed <details> element.
void put_collapsible_tables(std::string& out, std::string_view summary,
                            const std::vector<Table>& tables);

/// Source expression `sha256-BASE64` of a script for a content security policy.
std::string script_hash(std::string_view script);

/// Builds the page. Its content security policy allows no network access and only its own script.
/// Texts are escaped here, except what is appended to body(), above_title() and below_title().
/// Figures are SVG; with scripts enabled they have tooltips, highlight a participant and can be
/// saved as SVG or PNG.
class HtmlPage {
 public:
  /// \param title of the page, such as the conclusion in a sentence \param label "SIMULATED
  /// PARTICIPANTS", or empty
  explicit HtmlPage(std::string title, std::string label = {});

  /// A line across the top of the page.
  void put_banner(std::string_view text);
  /// Escaped HTML above and below the title.
  std::string& above_title() { return above_title_; }
  std::string& below_title() { return below_title_; }

  /// \param id anchor, unique \param link text in the navigation
  void begin_section(std::string_view id, std::string_view title, std::string_view link);
  void end_section();
  /// Adds a figure to the section, with its notes as caption and buttons to save it.
  /// \param participants codes to choose from for highlighting, in all figures; empty: no choice
  void put_figure(const Figure& figure, const std::vector<std::string>& participants = {});
  /// A section with one figure, titled as the figure.
  void put_figure_section(const Figure& figure, std::string_view link);
  void put_note(std::string_view text);
  /// HTML that is already escaped.
  std::string& body() { return body_; }

  /// The complete page. \param footer a sentence
  std::string html(std::string_view footer) const;

 private:
  std::string head() const;

  std::string title_, label_, banner_, above_title_, below_title_, links_, body_;
};

/// The section on the registration, if there is something to say. \param check_page  "": no link
void put_registration_section(HtmlPage& page, const std::string& checked,
                              const std::string& check_page);

/// Appends an unordered list; nothing for no sentences.
void put_list(std::string& out, const std::vector<std::string>& sentences);
/// The same under the heading "To quote".
void put_quotable(std::string& out, const std::vector<std::string>& sentences);

}  // namespace palpate::analysis
