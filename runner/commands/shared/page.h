#pragma once
// A report as one static page: sentences, figures, tables. No scripts, nothing from the network.

#include <string>
#include <vector>

#include "analysis/report/tables.h"

namespace palpate::runner {

/// Text is escaped here; figures are SVG documents.
struct ReportPage {
  std::string title;                   ///< the answer in a sentence
  std::vector<std::string> sentences;  ///< what to know, below it
  struct Figure {
    std::string svg, caption;
  };
  std::vector<Figure> figures;
  std::vector<analysis::Table> tables;
  std::vector<std::string> notes;  ///< how to read it; what was measured, and where
};

std::string page_html(const ReportPage& page);

}  // namespace palpate::runner
