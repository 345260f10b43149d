#include "analysis/analysis.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "analysis/text.h"

namespace palpate {

namespace {

constexpr double kMuchExcluded = 0.10;       // of a renderer's trials
constexpr double kUnequallyExcluded = 0.05;  // difference of the renderers' shares
constexpr double kAlpha = 0.05;
constexpr double kLongTime = 600;  // s; a mean above it looks like milliseconds

Exclusions count_exclusions(const Description& description, std::size_t renderer) {
  Exclusions out;
  for (std::size_t s = 0; s < description.accuracy[renderer].size(); ++s) {
    const AccuracyCell& cell = description.accuracy[renderer][s];
    out.n_trials += cell.n_trials;
    out.n_timeouts += cell.n_timeouts;
    out.n_wrong += cell.n_trials - cell.n_correct - cell.n_timeouts;
    out.n_too_fast += cell.n_correct_too_fast;
    out.n_used += description.times[renderer][s].n_trials;
  }
  return out;
}

void warn_of_exclusions(Analysis& analysis) {
  const auto& renderers = analysis.table.renderers;
  for (std::size_t r = 0; r < renderers.size(); ++r) {
    const double share = analysis.exclusions[r].share_excluded();
    if (share > kMuchExcluded) {
      analysis.warnings.push_back(fixed(100 * share, 1) + " % of the trials with " + renderers[r] +
                                  " are not in the times (wrong, no response or too fast).");
    }
  }
  if (renderers.size() == 2) {
    const double first = analysis.exclusions[0].share_excluded(),
                 second = analysis.exclusions[1].share_excluded();
    if (std::fabs(first - second) > kUnequallyExcluded) {
      analysis.warnings.push_back(
          "Exclusions differ between renderers (" + fixed(100 * first, 1) + " % with point, " +
          fixed(100 * second, 1) +
          " % with ray): the times compare different selections of trials.");
    }
  }
}

/// "P3 (point: cone; ray: every shape)" for each participant without a pair somewhere.
void warn_of_dropped(Analysis& analysis) {
  const TrialTable& table = analysis.table;
  if (table.renderers.size() < 2) return;
  std::map<std::size_t, std::map<std::string, std::vector<std::string>>> shapes_of;
  for (std::size_t s = 0; s < analysis.shapes.size(); ++s) {
    for (const Dropped& dropped : analysis.shapes[s].dropped) {
      for (const std::string& renderer : dropped.renderers) {
        shapes_of[dropped.participant][renderer].push_back(table.shapes[s]);
      }
    }
  }
  std::vector<std::string> people;
  for (const auto& [participant, renderers] : shapes_of) {
    std::string text;
    for (const auto& [renderer, shapes] : renderers) {
      text += (text.empty() ? "" : "; ") + renderer + ": " +
              (shapes.size() == table.shapes.size() ? "every shape" : joined(shapes));
    }
    people.push_back(table.participants[participant] + " (" + text + ")");
  }
  if (people.empty()) return;
  analysis.warnings.push_back(
      "Left out of paired comparisons where there is no time: " + joined(people) + ".");
}

void warn_of_times(Analysis& analysis) {
  for (const auto& renderer : analysis.description.times) {
    for (const TimesCell& cell : renderer) {
      if (cell.mean_of_participant_means.value_or(0) > kLongTime) {
        analysis.warnings.push_back(
            "A mean response time is longer than 10 minutes: are the times in seconds?");
        return;
      }
    }
  }
}

/// A gain that practice may have made.
void warn_of_practice(Analysis& analysis) {
  const OrderEffect& order = analysis.practice.all_shapes;
  const std::size_t point_first = order.point_first.n_participants,
                    ray_first = order.ray_first.n_participants;
  if (point_first + ray_first > 0 && (point_first == 0 || ray_first == 0)) {
    analysis.warnings.push_back(
        std::string("All participants had the ") + (ray_first == 0 ? "point" : "ray") +
        " first: what practice does and what the renderer does cannot be told apart.");
  } else if (order.test.p.value_or(1) < kAlpha) {
    analysis.warnings.push_back(
        "The gain depends on which renderer came first (p " + p_text(*order.test.p) +
        "): see practice; the gain with the two orders balanced stands there.");
  }
}

std::string with_reduction(const std::string& name, const PairedShape& shape) {
  return name + " (" + fixed(std::fabs(*shape.percent_reduction_geometric), 0) + " %)";
}

}  // namespace

double Exclusions::share_excluded() const {
  if (n_trials == 0) return 0;
  return static_cast<double>(n_trials - n_used) / static_cast<double>(n_trials);
}

Analysis analyze(TrialTable table, const AnalysisSettings& settings,
                 const std::string& program_version) {
  Analysis out;
  out.settings = settings;
  out.program_version = program_version;
  out.description = describe(table, settings.too_fast);
  out.shapes = compare_by_shape(table, out.description, settings.seed);
  out.rm_anova = rm_anova(out.description.people);
  out.mixed_model = mixed_model(out.description.people, table.renderers, table.shapes);
  out.speed_accuracy = speed_accuracy(table, out.description, out.shapes);
  out.practice = practice_effects(table, out.description, settings.too_fast);
  for (std::size_t r = 0; r < table.renderers.size(); ++r) {
    out.exclusions.push_back(count_exclusions(out.description, r));
  }
  out.warnings = table.warnings;
  out.table = std::move(table);
  if (out.table.simulated == Simulated::mixed) {
    out.warnings.push_back(
        "People and simulated participants are pooled: no conclusion about people.");
  }
  if (out.table.provenance.protocol_sha256.size() > 1) {
    out.warnings.push_back("Trials of " +
                           std::to_string(out.table.provenance.protocol_sha256.size()) +
                           " different protocols are pooled.");
  }
  warn_of_times(out);
  warn_of_exclusions(out);
  warn_of_dropped(out);
  warn_of_practice(out);
  return out;
}

std::string simulated_label(Simulated simulated) {
  switch (simulated) {
    case Simulated::yes:
      return "SIMULATED PARTICIPANTS";
    case Simulated::mixed:
      return "PARTLY SIMULATED PARTICIPANTS";
    case Simulated::no:
      break;
  }
  return {};
}

std::string answer(const Analysis& analysis) {
  std::vector<std::string> faster, slower, neither, unknown;
  for (std::size_t s = 0; s < analysis.shapes.size(); ++s) {
    const PairedShape& shape = analysis.shapes[s];
    const std::string& name = analysis.table.shapes[s];
    if (!shape.t_test.p_holm) {
      unknown.push_back(name);
    } else if (*shape.t_test.p_holm >= kAlpha) {
      neither.push_back(name);
    } else {
      (*shape.mean_log_ratio < 0 ? faster : slower).push_back(with_reduction(name, shape));
    }
  }
  if (unknown.size() == analysis.shapes.size()) {
    return "These data cannot say whether ray or point is faster: " +
           analysis.shapes.front().t_test.undefined + ".";
  }
  constexpr std::size_t kNamed = 6;  // beyond it a sentence of names answers nothing
  const auto list = [&](const std::vector<std::string>& names) {
    if (names.size() <= kNamed) return joined(names);
    return std::to_string(names.size()) + " of " + std::to_string(analysis.shapes.size()) +
           " shapes";
  };
  std::vector<std::string> parts;
  if (!faster.empty()) parts.push_back("The ray is faster than the point for " + list(faster));
  if (!slower.empty()) {
    parts.push_back((parts.empty() ? "The ray is slower than the point for " : "slower for ") +
                    list(slower));
  }
  if (!neither.empty()) {
    parts.push_back((parts.empty() ? "No clear difference between ray and point for "
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

std::string paper_reduction(const std::string& shape) {
  if (shape == "cone") return "22 %";
  if (shape == "cube") return "11 %";
  if (shape == "sphere" || shape == "cylinder") return "n.s.";
  return {};
}

}  // namespace palpate
