#include "runner/session/station.h"

#include <algorithm>
#include <cstddef>

namespace palpate::runner::session {

double largest_reach(const Station& station) {
  double reach = 0;
  for (std::size_t i = 0; i < station.library.size(); ++i)
    reach = std::max(reach, station.library.reach(static_cast<int>(i)));
  return reach;
}

}  // namespace palpate::runner::session
