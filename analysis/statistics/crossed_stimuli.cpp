#include "analysis/statistics/crossed_stimuli.h"

#include <algorithm>
#include <map>
#include <set>

#include "data/base/cell_name.h"

namespace palpate::analysis {

std::optional<CrossedStimuli> crossed_stimuli(const std::vector<std::string>& stimuli,
                                              const std::vector<StudyFactor>& all) {
  CrossedStimuli out;
  std::map<std::string, std::size_t> place;
  std::vector<std::set<std::string>> levels(all.size());
  for (std::size_t i = 0; i < stimuli.size(); ++i) {
    const CellName cell = cell_name(stimuli[i]);
    place.emplace(stimuli[i], i);
    if (std::ranges::find(out.plain, cell.base) == out.plain.end()) out.plain.push_back(cell.base);
    for (std::size_t f = 0; f < all.size(); ++f) {
      if (!cell.level(all[f].name).empty()) levels[f].insert(cell.level(all[f].name));
    }
  }
  std::size_t cells = out.plain.size();
  for (std::size_t f = 0; f < all.size(); ++f) {
    if (levels[f].empty()) continue;
    StudyFactor& factor = out.factors.emplace_back(StudyFactor{all[f].name, {}});
    for (const std::string& level : all[f].levels) {
      if (levels[f].contains(level)) factor.levels.push_back(level);
    }
    cells *= factor.levels.size();
  }
  if (out.factors.empty() || cells != stimuli.size()) return std::nullopt;
  for (std::size_t i = 0; i < cells; ++i) {
    CellName name{out.plain[i % out.plain.size()]};
    std::size_t rest = i / out.plain.size();
    for (std::size_t f = out.factors.size(); f-- > 0;) {
      const StudyFactor& factor = out.factors[f];
      name.levels.insert(name.levels.begin(),
                         {factor.name, factor.levels[rest % factor.levels.size()]});
      rest /= factor.levels.size();
    }
    const auto at = place.find(name.text());
    if (at == place.end()) return std::nullopt;
    out.cells.push_back(at->second);
  }
  return out;
}

}  // namespace palpate::analysis
