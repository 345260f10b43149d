// Whatever coincides: the ideal tool of an object of several convex parts is outside of all of
// them, and its force is that of its displacement.

#include <cstdlib>
#include <iostream>

#include "runner/evidence/verification/search.h"
#include "runner/evidence/verification/union_search.h"
#include "runner/evidence/verification/union_walks.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace palpate::runner::evidence;
  const UnionCounts counts =
      search_union(palpate::rendering::ray_renderer(), grid_walk({data, size}, 300));
  if (counts.wrong() == 0) return 0;
  for (const SearchFault& fault : counts.faults) {
    std::cerr << "tick " << fault.tick << ": " << fault.what << "\n";
  }
  std::abort();
}
