#include "rendering/verification/search.h"

#include <algorithm>

namespace palpate::rendering {

SearchCounts& SearchCounts::operator+=(const SearchCounts& other) {
  walks += other.walks;
  ticks += other.ticks;
  in_contact += other.in_contact;
  entries += other.entries;
  walked_finely += other.walked_finely;
  passages += other.passages;
  missed += other.missed;
  passed_through += other.passed_through;
  phantom += other.phantom;
  penetrating += other.penetrating;
  floating += other.floating;
  shallow += other.shallow;
  wrong_force += other.wrong_force;
  not_finite += other.not_finite;
  endless += other.endless;
  faulted += other.faulted;
  fallbacks += other.fallbacks;
  turned_elsewhere += other.turned_elsewhere;
  worst_penetration = std::max(worst_penetration, other.worst_penetration);
  for (const SearchFault& fault : other.faults) {
    if (faults.size() < kFaultsKept) faults.push_back(fault);
  }
  return *this;
}

SearchCounts search_walks(std::uint64_t seed, std::uint64_t first_walk, std::uint64_t walks) {
  SearchCounts counts;
  for (std::uint64_t walk = first_walk; walk < first_walk + walks; ++walk) {
    counts += search_walk(walk % 4 == 0 ? point_renderer() : ray_renderer(), seed, walk);
  }
  return counts;
}

}  // namespace palpate::rendering
