// Required parts of every report: names for all of them, and no empty text.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "analysis/figures/figures.h"
#include "analysis/input/trials.h"
#include "analysis/report/report.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"
#include "data/base/random.h"
#include "tests/analysis/figures/figure_form.h"
#include "tests/shared/prose.h"

namespace palpate::analysis {
namespace {
namespace documents {

using Json = nlohmann::ordered_json;

/// Eight participants, four shapes; with `limit` above 0 some trials end there (s).
Analysis study_with(const std::vector<std::string>& renderers, double limit = 0) {
  TrialTableBuilder builder;
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  for (int p = 0; p < 8; ++p) {
    const std::string participant = "P" + std::to_string(p);
    int trial = 0;
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      for (const char* const shape : {"sphere", "cone", "cylinder", "cube"}) {
        for (int i = 0; i < 6; ++i) {
          StudyTrial raw;
          raw.participant = participant;
          raw.renderer = renderers[(r + static_cast<std::size_t>(p)) % renderers.size()];
          raw.shape = shape;
          raw.trial = ++trial;
          raw.response_time = 6 * std::exp(0.3 * random.normal());
          raw.timed_out = limit > 0 && raw.response_time > limit;
          if (raw.timed_out) raw.response_time = limit;
          raw.correct = !raw.timed_out && random.unit() < 0.9;
          if (!raw.timed_out) raw.response = *raw.correct ? shape : "sphere";
          if (raw.response == raw.shape) raw.correct = true;
          builder.add(raw);
        }
      }
    }
  }
  TrialTable table = builder.finish({});
  table.provenance.source = "made up";
  return analyze(std::move(table), {}, "1.2.3");
}

const std::vector<Analysis>& studies() {
  static const std::vector<Analysis> all{study_with({"point", "ray"}),
                                         study_with({"point", "ray"}, 8),
                                         study_with({"point", "ray", "plane"}, 9)};
  return all;
}

void expect_named(const Json& value, const std::string& path) {
  if (value.is_object()) {
    for (const auto& [name, member] : value.items()) {
      EXPECT_NE(name, "") << "in " << path;
      expect_named(member, path + "/" + name);
    }
    // An undefined quantity says why, a defined one does not.
    if (value.contains("status") && value["status"] != "ok") {
      EXPECT_TRUE(value.contains("reason")) << path;
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i)
      expect_named(value[i], path + "/" + std::to_string(i));
  } else if (value.is_string()) {
    EXPECT_NE(value.get<std::string>(), "") << path;
  }
}

TEST(Documents, JsonNumbersHaveNamesAndTextsHaveWords) {
  for (const Analysis& analysis : studies()) expect_named(Json::parse(report_json(analysis)), "");
}

TEST(Documents, TablesHaveCaptionsNamedColumnsNoEmptyNotes) {
  for (const Analysis& analysis : studies()) {
    for (const Table& table : all_tables(analysis)) {
      EXPECT_NE(table.caption, "");
      EXPECT_LE(table.n_names, table.header.size()) << table.caption;
      for (const std::string& name : table.header) EXPECT_NE(name, "") << table.caption;
      for (const std::string& note : table.notes) EXPECT_NE(note, "") << table.caption;
      for (const auto& row : table.rows) {
        ASSERT_EQ(row.size(), table.header.size()) << table.caption;
        EXPECT_NE(row[0], "") << table.caption;
      }
    }
  }
}

TEST(Documents, TablesPutNamesBeforeNumbers) {
  const auto number = [](const std::string& cell) {
    return cell.find_first_of("0123456789") != std::string::npos;
  };
  for (const Analysis& analysis : studies()) {
    std::vector<Table> tables = all_tables(analysis);
    std::erase_if(tables, [](const Table& table) {
      return table.caption.find("data") != std::string::npos ||  // of provenance: texts
             table.header.size() == 2;
    });
    EXPECT_GT(tables.size(), 8U);
    for (const Table& table : tables) {
      for (std::size_t c = 0; c < table.header.size() && !table.rows.empty(); ++c) {
        const bool any =
            std::ranges::any_of(table.rows, [&](const auto& row) { return number(row[c]); });
        if (c < table.n_names) {
          EXPECT_FALSE(any) << table.caption << ": " << table.header[c];
        }
      }
    }
  }
}

TEST(Documents, AxesOfNumbersSayWhatTheyShow) {
  for (const Analysis& analysis : studies()) {
    const std::vector<Figure> figures = figures_of(analysis, {});
    EXPECT_GE(figures.size(), 7U);
    for (const Figure& figure : figures) {
      EXPECT_NE(figure.title, "");
      EXPECT_NE(figure.subtitle, "") << figure.id;
      EXPECT_NE(figure.description, "") << figure.id;
      for (const std::string& note : figure.notes) EXPECT_NE(note, "") << figure.id;
      for (const LegendEntry& entry : figure.legend) EXPECT_NE(entry.label, "") << figure.id;
      for (const Panel& panel : figure.panels) {
        for (const FigureAxis* const axis : {&panel.x, &panel.y}) {
          ASSERT_FALSE(axis->ticks.empty()) << figure.id;
          EXPECT_LT(axis->low, axis->high) << figure.id;
          // Which way the answers of a confusion matrix run must be said, too.
          const bool shapes =
              axis->names && axis->ticks.front().label == analysis.table.shapes.front();
          if (shapes && figure.id != "confusion") {
            EXPECT_EQ(axis->title, "") << figure.id;
          } else if (!axis->names) {
            EXPECT_NE(axis->title, "") << figure.id;
          }
        }
      }
    }
  }
}

/// Servo periods of two decades for every renderer.
StudyRecord record_with_servo(const Analysis& analysis) {
  StudyRecord record;
  for (const std::string& renderer : analysis.table.renderers) {
    ServoQuality& servo = record.servo.emplace_back();
    servo.renderer = renderer;
    servo.ticks = 5000;
    servo.longest_period = 0.01;
    for (const std::size_t bin : {10U, 20U, 30U}) {
      servo.longest_periods[bin] += 2;
      servo.n_trials += 2;
    }
  }
  return record;
}

TEST(Documents, FiguresHaveTheirFormAndTheirOrder) {
  for (const Analysis& analysis : studies()) {
    std::vector<std::string> ids;
    for (const Figure& figure : figures_of(analysis, record_with_servo(analysis))) {
      ids.push_back(figure.id);
      testing::expect_form(figure);
      for (const Panel& panel : figure.panels) {
        for (const Mark& mark : panel.marks) {
          if (mark.kind != Mark::Kind::rect && mark.kind != Mark::Kind::symbol) continue;
          EXPECT_EQ(palpate::testing::flaw_of(mark.text), "")
              << figure.id << ": what the pointer is told there: " << mark.text;
        }
      }
    }
    EXPECT_EQ(ids, (std::vector<std::string>{"figure15", "speedup", "times", "confusion",
                                             "speed-accuracy", "learning", "order", "servo",
                                             "exclusions"}));
  }
}

void expect_whole(const Json& value, const std::string& path) {
  if (value.is_string()) {
    EXPECT_EQ(palpate::testing::flaw_of(value.get<std::string>()), "") << path << ": " << value;
  }
  if (!value.is_structured()) return;
  for (const auto& [name, member] : value.items()) expect_whole(member, path + "/" + name);
}

TEST(Documents, TextsAreWhole) {
  for (const Analysis& analysis : studies()) {
    expect_whole(Json::parse(report_json(analysis)), "");
    for (const Table& table : all_tables(analysis)) {
      EXPECT_EQ(palpate::testing::flaw_of(table.caption), "") << table.caption;
      for (const std::string& note : table.notes)
        EXPECT_EQ(palpate::testing::flaw_of(note), "") << note;
      for (const std::string& name : table.header)
        EXPECT_EQ(palpate::testing::flaw_of(name), "") << table.caption << ": " << name;
      for (const auto& row : table.rows) {
        for (const std::string& cell : row)
          if (!cell.empty()) {
            EXPECT_EQ(palpate::testing::flaw_of(cell), "") << table.caption << ": " << cell;
          }
      }
    }
  }
}

/// Numbers in a text, in its order; "-" and the true minus sign before them count.
std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> out;
  const std::string digits = "0123456789";
  for (std::size_t at = text.find_first_of(digits); at < text.size();
       at = text.find_first_of(digits, at)) {
    std::size_t length = 0;
    const double value = std::stod(text.substr(at), &length);
    const bool minus = at > 0 && (text[at - 1] == '-' || text.substr(0, at).ends_with("\u2212"));
    out.push_back(minus ? -value : value);
    at += length;
  }
  return out;
}

/// The numbers of a card from a word on, rounded to one digit: 0.05 is half a unit of the last.
void expect_card_numbers(const std::string& card, const std::string& from,
                         const std::vector<double>& expected) {
  const std::size_t at = card.find(from);
  ASSERT_NE(at, std::string::npos) << from << ": " << card;
  const std::vector<double> found = numbers_in(card.substr(at + from.size()));
  ASSERT_GE(found.size(), expected.size()) << card;
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(found[i], expected[i], 0.0501) << from << " " << i << ": " << card;
}

TEST(Documents, CardsHaveTheNumbersOfTheStatistics) {
  int with_time_outs = 0;
  for (const Analysis& analysis : studies()) {
    std::string all;
    put_reduction_cards(all, analysis);
    std::vector<std::string> cards;
    for (std::size_t at = all.find("<li"); at != std::string::npos; at = all.find("<li", at + 1))
      cards.push_back(all.substr(at, all.find("</li>", at) - at));
    std::size_t next = 0;
    for (const Comparison& comparison : analysis.comparisons) {
      for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
        ASSERT_LT(next, cards.size());
        const std::string& card = cards[next++];
        const PairedShape& shape = comparison.shapes[s];
        expect_card_numbers(card, "class=\"value\">",
                            {std::fabs(*shape.percent_reduction_geometric)});
        // A card that says by how much slower has all its signs turned.
        const double turn = *shape.mean_log_ratio > 0 ? -1 : 1;
        const auto turned = [&](const Interval& reduction) {
          return turn < 0 ? std::vector{-reduction.high, -reduction.low}
                          : std::vector{reduction.low, reduction.high};
        };
        expect_card_numbers(card, "95\u00a0% interval",
                            turned(percent_reduction(*shape.t_test.log_ratio_ci95)));
        if (comparison.censored.empty() || comparison.censored[s].n_censored == 0) continue;
        const CensoredEstimate& censored = comparison.censored[s];
        if (!censored.log_ratio || !censored.log_ratio_ci95) continue;
        ++with_time_outs;
        const Interval wide = percent_reduction(*censored.log_ratio_ci95);
        expect_card_numbers(card, "with its",
                            {static_cast<double>(censored.n_censored),
                             turn * percent_reduction(*censored.log_ratio)});
        expect_card_numbers(card.substr(card.find("as censored times")), "(", turned(wide));
      }
    }
    EXPECT_EQ(next, cards.size());
  }
  EXPECT_GT(with_time_outs, 4);
}

TEST(Documents, AnovaTablePrintsEachCorrectionUnderItsName) {
  for (const Analysis& analysis : studies()) {
    const Table table = anova_table(analysis);
    ASSERT_EQ(table.rows.size(), analysis.rm_anova.effects.size());
    int corrected = 0;
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      const AnovaEffect& effect = analysis.rm_anova.effects[i];
      const Sphericity& sphericity = effect.sphericity;
      const auto cell = [&](const std::string& name) {
        const auto at = std::ranges::find(table.header, name);
        return at == table.header.end()
                   ? std::string("no such column")
                   : table.rows[i][static_cast<std::size_t>(at - table.header.begin())];
      };
      EXPECT_EQ(cell("effect"), effect.name);
      if (!sphericity.gg_epsilon) continue;
      ++corrected;
      // Three digits: half a unit of the last is 0.0005.
      EXPECT_NEAR(std::stod(cell("W")), *sphericity.mauchly_w, 0.00051);
      EXPECT_NEAR(std::stod(cell("ε GG")), *sphericity.gg_epsilon, 0.00051);
      EXPECT_NEAR(std::stod(cell("ε HF")), *sphericity.hf_epsilon_used, 0.00051);
      EXPECT_EQ(cell("ε GG").size(), 5U);
      EXPECT_EQ(cell("ε HF").size(), 5U);
      EXPECT_EQ(cell("W").size(), 5U);
    }
    EXPECT_GE(corrected, 2);
  }
}

}  // namespace documents
}  // namespace
}  // namespace palpate::analysis
