#include "data/base/cell_name.h"

#include <algorithm>
#include <cstddef>

namespace palpate {

const std::string& CellName::level(const std::string& factor) const {
  static const std::string kNone;
  const auto found = std::ranges::find(levels, factor, &std::pair<std::string, std::string>::first);
  return found != levels.end() ? found->second : kNone;
}

std::string CellName::text() const {
  std::string out = base;
  for (const auto& [factor, level] : levels)
    out += (out.size() == base.size() ? '[' : ',') + factor + '=' + level;
  return levels.empty() ? out : out + ']';
}

CellName cell_name(const std::string& stored) {
  CellName out{base_name(stored)};
  std::size_t at = out.base.size();
  while (at < stored.size() && stored[at] != ']') {
    const std::size_t end = stored.find_first_of(",]", at + 1);
    const std::size_t equals = stored.find('=', at + 1);
    if (end == std::string::npos || equals == std::string::npos || equals > end) return {stored};
    out.levels.emplace_back(stored.substr(at + 1, equals - at - 1),
                            stored.substr(equals + 1, end - equals - 1));
    at = end;
  }
  return out;
}

std::string base_name(const std::string& stored) {
  return stored.ends_with(']') ? stored.substr(0, stored.find('[')) : stored;
}

}  // namespace palpate
