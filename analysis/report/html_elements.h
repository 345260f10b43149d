#pragma once
// HTML of sentences and tables, and the hash of a script for a content security policy.

#include <string>
#include <string_view>
#include <vector>

#include "analysis/report/tables.h"

namespace palpate::analysis {

/// Escaped text with no-break spaces before percent signs.
std::string escaped_sentence(std::string_view text);

/// Escaped line by line, as escaped() makes line ends and tabs visible.
std::string escaped_lines(std::string_view text);

/// Appends a table in a box that scrolls horizontally, with its notes below. At most 400 rows and
/// 60 columns, with a note if it was cut.
void put_table(std::string& out, const Table& table);

/// Appends tables in a collapsed <details> element.
void put_collapsible_tables(std::string& out, std::string_view summary,
                            const std::vector<Table>& tables);

/// Source expression `sha256-BASE64` of a script for a content security policy.
std::string script_hash(std::string_view script);

}  // namespace palpate::analysis
