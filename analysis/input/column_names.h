#pragma once
// Columns of a table that no reader knows but that look like one: "Level" for "level".

#include <string>
#include <string_view>
#include <vector>

namespace palpate::analysis {

/// A column of a table, and the one that is probably meant: it is not in the table.
struct AlikeColumn {
  std::string found, meant;
};

/// Alike: the same letters and digits whatever their case and what stands between them, or one edit
/// in a name of up to five letters, two in a longer one. \param found, known  names, each known one
/// once
std::vector<AlikeColumn> alike_columns(const std::vector<std::string>& found,
                                       const std::vector<std::string_view>& known);

/// "Column 'Level' is not known and was not read: 'level' is."
std::string sentence(const AlikeColumn& column);
/// "", or " (is 'Level' meant?)": what to add where a column is missing.
std::string hint_for(std::string_view missing, const std::vector<AlikeColumn>& alike);

}  // namespace palpate::analysis
