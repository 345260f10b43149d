#include "analysis/statistics/conclusions.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/text.h"

namespace palpate::analysis {

namespace {

constexpr double kSignificant = 0.05;
constexpr std::size_t kLongestInPhrase = 40;            // bytes of a renderer's name
constexpr std::size_t kNamed = 6, kNamedAmongMany = 3;  // otherwise only counted
constexpr std::size_t kFewComparisons = 2, kMostComparisons = 6;

std::string with_reduction(const std::string& name, const PairedShape& shape) {
  return name + " (" + fixed(std::fabs(*shape.percent_reduction_geometric), 0) + " %)";
}

std::string sentence_start(std::string text, const RendererPair& pair) {
  if (with_article(pair.renderer) != pair.renderer) text.front() = 'T';
  return text;
}

/// Sentence for one comparison. \param most largest number of shapes listed by name
std::string comparison_answer(const Comparison& comparison, const std::vector<std::string>& shapes,
                              std::size_t most) {
  const RendererPair& pair = comparison.pair;
  std::vector<std::string> faster, slower, neither, unknown;
  for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
    const PairedShape& shape = comparison.shapes[s];
    if (!shape.t_test.p_holm) {
      unknown.push_back(shapes[s]);
    } else if (*shape.t_test.p_holm >= kSignificant) {
      neither.push_back(shapes[s]);
    } else {
      (*shape.mean_log_ratio < 0 ? faster : slower).push_back(with_reduction(shapes[s], shape));
    }
  }
  if (unknown.size() == shapes.size()) {
    return "These data cannot say whether " + pair.renderer + " or " + pair.reference +
           " is faster: " + comparison.shapes.front().t_test.undefined + ".";
  }
  const auto list = [&](const std::vector<std::string>& names) {
    if (names.size() <= most) return joined(names);
    return std::to_string(names.size()) + " of " + std::to_string(shapes.size()) + " shapes";
  };
  const auto differs = [&](const char* how) {
    return sentence_start(with_article(pair.renderer), pair) + " is " + how + " than " +
           with_article(pair.reference) + " for ";
  };
  std::vector<std::string> parts;
  if (!faster.empty()) parts.push_back(differs("faster") + list(faster));
  if (!slower.empty()) {
    parts.push_back((parts.empty() ? differs("slower") : "slower for ") + list(slower));
  }
  if (!neither.empty()) {
    parts.push_back((parts.empty() ? "No clear difference between " + pair.renderer + " and " +
                                         pair.reference + " for "
                                   : "no clear difference for ") +
                    list(neither));
  }
  if (!unknown.empty()) parts.push_back("not testable for " + list(unknown));
  std::string sentence;
  for (const std::string& part : parts) {
    if (!sentence.empty()) sentence += "; ";
    sentence += part;
  }
  return sentence + ".";
}

}  // namespace

std::string conclusion(const Analysis& analysis) {
  const std::vector<Comparison>& all = analysis.comparisons;
  const std::size_t shown = std::min(all.size(), kMostComparisons);
  std::string text;
  for (std::size_t c = 0; c < shown; ++c) {
    if (c > 0) text += ' ';
    text += comparison_answer(all[c], analysis.table.shapes,
                              all.size() <= kFewComparisons ? kNamed : kNamedAmongMany);
  }
  if (shown < all.size()) {
    text += " The tables have " +
            counted(all.size() - shown, "more comparison", "more comparisons") + ".";
  }
  return text;
}

std::string with_renderer(const Analysis& analysis, const std::string& joint) {
  const RendererPair& pair = analysis.comparisons.front().pair;
  const std::string reference = with_article(printable(pair.reference, kLongestInPhrase));
  if (analysis.comparisons.size() > 1) return joint + " " + reference;
  const std::string with = "with " + with_article(printable(pair.renderer, kLongestInPhrase));
  return pair.is_ray_minus_point() ? with : with + " " + joint + " " + reference;
}

const PaperEffect* paper_effect(const RendererPair& pair, std::string_view shape) {
  return pair.is_ray_minus_point() && pair.in_data() ? find_paper_effect(shape) : nullptr;
}

std::string paper_reduction(const RendererPair& pair, const std::string& shape) {
  const PaperEffect* effect = paper_effect(pair, shape);
  if (!effect) return {};
  return effect->percent_reduction ? fixed(*effect->percent_reduction, 0) + " %" : "n.s.";
}

bool compares_as_paper(const Analysis& analysis) {
  return std::ranges::any_of(analysis.comparisons, [&](const Comparison& comparison) {
    return std::ranges::any_of(analysis.table.shapes, [&](const std::string& shape) {
      return paper_effect(comparison.pair, shape) != nullptr;
    });
  });
}

}  // namespace palpate::analysis
