#pragma once
// The columns that tables of this program have, whatever the study: no factor has such a name.

#include <string_view>

namespace palpate {

/// Whether a table has such a column, in small letters or capitals.
bool is_column_name(std::string_view name);

}  // namespace palpate
