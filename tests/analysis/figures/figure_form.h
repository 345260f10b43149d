#pragma once
// Required parts of every figure.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "analysis/figures/figures.h"
#include "tests/shared/prose.h"

namespace palpate::analysis::testing {

/// Texts that are whole, axes that say what they show, marks within them.
inline void expect_form(const Figure& figure) {
  using palpate::testing::flaw_of;
  SCOPED_TRACE("figure " + figure.id);
  EXPECT_NE(figure.id, "");
  EXPECT_EQ(figure.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"), std::string::npos)
      << "a file name and an anchor";
  EXPECT_EQ(flaw_of(figure.title), "") << figure.title;
  EXPECT_EQ(flaw_of(figure.subtitle), "") << figure.subtitle;
  std::string description = figure.description;
  while (description.ends_with(' ') || description.ends_with('\n')) description.pop_back();
  EXPECT_EQ(flaw_of(description), "") << description;
  for (const std::string& note : figure.notes) EXPECT_EQ(flaw_of(note), "") << note;
  for (const LegendEntry& entry : figure.legend) EXPECT_EQ(flaw_of(entry.label), "") << entry.label;
  EXPECT_FALSE(figure.panels.empty());
  bool anything = false;
  for (const Panel& panel : figure.panels) {
    EXPECT_GT(panel.width, 0);
    EXPECT_GT(panel.height, 0);
    for (const FigureAxis* const axis : {&panel.x, &panel.y}) {
      EXPECT_LT(axis->low, axis->high);
      ASSERT_FALSE(axis->ticks.empty());
      if (!axis->names) {
        EXPECT_EQ(flaw_of(axis->title), "") << axis->title;
      }
      std::set<std::string> labels;
      for (const Tick& tick : axis->ticks) {
        if (!tick.label.empty()) {
          EXPECT_TRUE(labels.insert(tick.label).second || axis->names) << tick.label << " twice";
        }
        EXPECT_GE(tick.at, axis->low - 1e-9);
        EXPECT_LE(tick.at, axis->high + 1e-9);
      }
      EXPECT_GE(labels.size(), axis->names ? 1U : 2U) << "an axis has a scale: " << axis->title;
    }
    for (const Mark& mark : panel.marks) {
      anything = true;
      ASSERT_FALSE(mark.x.empty() && mark.y.empty());
      if (mark.kind == Mark::Kind::text || mark.kind == Mark::Kind::label) {
        EXPECT_NE(mark.text, "") << "a text at " << mark.x.front();
      }
      EXPECT_GT(mark.opacity, 0);
      EXPECT_LE(mark.opacity, 1);
    }
  }
  EXPECT_TRUE(anything);
}

}  // namespace palpate::analysis::testing
