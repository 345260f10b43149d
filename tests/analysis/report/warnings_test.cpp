// Warnings of an analysis, as whole sentences.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"

namespace palpate::analysis {
namespace {
namespace warnings {

/// Six participants with five trials of each renderer, in the order that `order` gives.
template <class Order, class Time>
Analysis analysis_in(const Order& order, const Time& time) {
  TrialTableBuilder builder;
  for (int p = 0; p < 6; ++p) {
    const std::string name = "P" + std::to_string(p);
    int number = 0;
    for (const std::string& renderer : order(p)) {
      const bool first = number == 0;
      for (int i = 0; i < 5; ++i) {
        StudyTrial raw;
        raw.participant = name;
        raw.renderer = renderer;
        raw.shape = raw.response = "cone";
        raw.correct = true;
        raw.trial = ++number;
        raw.response_time = time(renderer, first, p) * (1 + 0.01 * ((i * 7 + p * 3) % 5));
        builder.add(raw);
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

using Names = std::vector<std::string>;

double five_seconds(const std::string&, bool, int) { return 5; }

bool has(const Analysis& analysis, const std::string& warning) {
  return std::ranges::count(analysis.warnings, warning) == 1;
}

TEST(Warnings, NameTwoRenderersInOneOrderForAll) {
  EXPECT_TRUE(has(analysis_in(
                      [](int) {
                        return Names{"point", "ray"};
                      },
                      five_seconds),
                  "All participants had the point first: effects of practice and renderer "
                  "are confounded."));
  EXPECT_TRUE(has(analysis_in(
                      [](int) {
                        return Names{"ray", "point"};
                      },
                      five_seconds),
                  "All participants had the ray first: effects of practice and renderer "
                  "are confounded."));
  const auto both = analysis_in(
      [](int p) {
        return p == 3 ? Names{"ray", "point"} : Names{"point", "ray"};
      },
      five_seconds);
  EXPECT_TRUE(std::ranges::none_of(both.warnings, [](const std::string& one) {
    return one.find("confounded") != std::string::npos;
  })) << "one participant with the other order";
}

TEST(Warnings, NameBothRenderersWhereThereAreThree) {
  const Analysis analysis = analysis_in(
      [](int p) {
        return p % 2 == 0 ? Names{"point", "ray", "other"} : Names{"other", "point", "ray"};
      },
      five_seconds);
  EXPECT_TRUE(
      has(analysis,
          "All participants had the point before the ray: effects of practice and renderer are "
          "confounded."));
}

TEST(Warnings, NameGainsThatDependOnWhichCameFirst) {
  // Whoever comes second is twice as fast; the gain itself is nothing.
  const auto half = [](int p) {
    return p % 2 == 0 ? Names{"point", "ray"} : Names{"ray", "point"};
  };
  const auto differs = [](const std::string& renderer, int p) {
    return 1 + 0.02 * ((p * 5 + static_cast<int>(renderer.size()) * 3) % 7);
  };
  const Analysis analysis = analysis_in(half, [&](const std::string& renderer, bool first, int p) {
    return (first ? 10 : 5) * differs(renderer, p);
  });
  EXPECT_TRUE(has(analysis,
                  "The gain depends on which renderer came first (adjusted p <0.001): see practice "
                  "for the gain with the two orders balanced."));
  const Analysis none = analysis_in(
      half, [](const std::string& renderer, bool, int) { return renderer == "ray" ? 5.0 : 10.0; });
  EXPECT_TRUE(std::ranges::none_of(none.warnings, [](const std::string& one) {
    return one.find("came first") != std::string::npos;
  }));
}

TEST(Warnings, NameTimesThatAreHardlySeconds) {
  const std::string wanted =
      "A mean response time is longer than 10 minutes: are the times in seconds?";
  const auto order = [](int p) {
    return p % 2 == 0 ? Names{"point", "ray"} : Names{"ray", "point"};
  };
  const auto with = [&](double seconds) {
    return analysis_in(order, [=](const std::string&, bool, int) { return seconds; });
  };
  EXPECT_TRUE(has(with(600), wanted)) << "once, however many cells";
  EXPECT_FALSE(has(with(570), wanted));
}

}  // namespace warnings
}  // namespace
}  // namespace palpate::analysis
