#pragma once
// Pieces of an HTML page. Internal to analysis/report_*.

#include <string>
#include <string_view>
#include <vector>

#include "analysis/report/tables.h"

namespace palpate::analysis {

/// Escaped text with each number kept on one line with its percent sign.
std::string escaped_sentence(std::string_view text);

/// A table in a box that scrolls when it is wider than the page, its notes below it. Long ones are
/// cut and say so.
void put_table(std::string& out, const Table& table);

/// The same, to be opened.
void put_folded(std::string& out, std::string_view summary, const std::vector<Table>& tables);

/// `sha256-...` of a script for a content security policy.
std::string script_hash(std::string_view script);

}  // namespace palpate::analysis
