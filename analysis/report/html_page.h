#pragma once
// A report as one HTML page.

#include <string>
#include <string_view>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/report/tables.h"

namespace palpate::analysis {

/// A page that is complete in itself: its content security policy allows no network and no script
/// but its own. Text is escaped here. Figures are SVG; where scripts run they have tooltips, a
/// participant can be picked out, and they can be saved.
class HtmlPage {
 public:
  /// \param title the answer in a sentence \param label "SIMULATED PARTICIPANTS", or empty
  explicit HtmlPage(std::string title, std::string label = {});

  /// A line across the top of the page.
  void put_banner(std::string_view text);
  /// What stands above the title, and below it.
  std::string& above_title() { return above_title_; }
  std::string& below_title() { return below_title_; }

  /// \param id its anchor, unique \param link its name in the line of links
  void begin_section(std::string_view id, std::string_view title, std::string_view link);
  void end_section();
  /// Into the section: with its notes as caption, and what saves it.
  /// \param participants one of whom can be picked out, in all figures; none: no choice
  void put_figure(const Figure& figure, const std::vector<std::string>& participants = {});
  /// A section of one figure, under its title.
  void put_figure_section(const Figure& figure, std::string_view link);
  void put_note(std::string_view text);
  /// HTML that is already escaped.
  std::string& body() { return body_; }

  /// \param footer a sentence
  std::string html(std::string_view footer) const;

 private:
  std::string head() const;

  std::string title_, label_, banner_, above_title_, below_title_, links_, body_;
};

/// A list of sentences.
void put_list(std::string& out, const std::vector<std::string>& sentences);

}  // namespace palpate::analysis
