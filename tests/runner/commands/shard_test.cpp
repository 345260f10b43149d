// Shards: every item is in exactly one of them, whatever the counts; invalid shards are refused.

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <tuple>

#include "runner/commands/shared/command.h"
#include "runner/commands/shared/study_options.h"

namespace palpate::runner::commands {
namespace {
namespace shards {

TEST(Shards, AreConsecutiveAndDifferByAtMostOneItem) {
  for (const std::int64_t items : {0, 1, 7, 8, 100, 1000003}) {
    for (const std::int64_t count : {1, 2, 3, 8, 1000}) {
      std::int64_t next = 0;
      for (std::int64_t k = 1; k <= count; ++k) {
        const Shard shard{k, count};
        EXPECT_EQ(shard.first(items), next);
        next = shard.last(items);
        const std::int64_t own = next - shard.first(items);
        EXPECT_GE(own, items / count);
        EXPECT_LE(own, (items + count - 1) / count);
      }
      EXPECT_EQ(next, items);
    }
  }
  constexpr std::int64_t kMany = std::numeric_limits<std::int64_t>::max() / 2;
  EXPECT_EQ((Shard{1'000'000, 1'000'000}.last(kMany)), kMany);  // without overflow
  EXPECT_EQ(Shard{}.first(5), 0);
  EXPECT_EQ(Shard{}.last(5), 5);
}

Shard parsed(const std::string& text, const std::map<std::string, std::string>& variables = {}) {
  return parse_shard(text, [&](const char* name) -> const char* {
    const auto at = variables.find(name);
    return at == variables.end() ? nullptr : at->second.c_str();
  });
}

std::string refusal(const std::string& text,
                    const std::map<std::string, std::string>& variables = {}) {
  try {
    parsed(text, variables);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "taken";
}

TEST(Shards, AreGivenAsPartOfACount) {
  for (const auto& [text, number, count] :
       {std::tuple{"1/1", 1, 1}, {"3/8", 3, 8}, {"8/8", 8, 8}, {"1/1000000", 1, 1000000}}) {
    EXPECT_EQ(parsed(text).number, number);
    EXPECT_EQ(parsed(text).count, count);
  }
  for (const char* bad : {"", "3", "3/", "/3", "0/3", "4/3", "-1/3", "1/0", "1/1000001", "1/3x",
                          "1 /3", "a/b", "1/2/3", "Auto"})
    EXPECT_EQ(refusal(bad),
              "--shard: expected K/N with 1 <= K <= N <= 1000000, such as 3/8, or auto; found '" +
                  std::string(bad) + "'");
}

TEST(Shards, CountFromFirstTaskOfSlurmArray) {
  const auto task = [](const char* id, const char* least, const char* count) {
    return std::map<std::string, std::string>{{"SLURM_ARRAY_TASK_ID", id},
                                              {"SLURM_ARRAY_TASK_MIN", least},
                                              {"SLURM_ARRAY_TASK_COUNT", count}};
  };
  for (const auto& [id, least, number] :
       {std::tuple{"1", "1", 1}, {"4", "1", 4}, {"0", "0", 1}, {"13", "10", 4}}) {
    EXPECT_EQ(parsed("auto", task(id, least, "4")).number, number);
    EXPECT_EQ(parsed("auto", task(id, least, "4")).count, 4);
  }
  EXPECT_EQ(
      refusal("auto", task("9", "1", "4")),
      "--shard auto: task 9 of 4 is not a shard; the array's task numbers must be consecutive "
      "(--array=1-N)");
  EXPECT_EQ(refusal("auto", task("0", "1", "4")).substr(0, 26), "--shard auto: task 0 of 4 ");
  EXPECT_EQ(refusal("auto", task("1", "1", "1000001")).substr(0, 32),
            "--shard auto: task 1 of 1000001 ");
  EXPECT_EQ(refusal("auto", task("1", "1", "four")),
            "--shard auto: expected a number in SLURM_ARRAY_TASK_COUNT, found 'four'");
  EXPECT_EQ(refusal("auto", task("-1", "1", "4")),
            "--shard auto: expected a number in SLURM_ARRAY_TASK_ID, found '-1'");
  for (const char* missing :
       {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT"}) {
    auto variables = task("1", "1", "4");
    variables.erase(missing);
    EXPECT_EQ(refusal("auto", variables),
              "--shard auto: expected a task of a Slurm array (sbatch --array), but " +
                  std::string(missing) + " is not set; elsewhere give --shard K/N");
  }
}

}  // namespace shards
}  // namespace
}  // namespace palpate::runner::commands
