#include "data/store/sweep_file.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <thread>

#include "tests/data/store/sweep_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

class Sweeps : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  const std::string path_ = folder_ / "a.sweep";
};

void expect_refused(const std::function<void()>& what, const std::string& said) {
  try {
    what();
    ADD_FAILURE() << "is not refused: " << said;
  } catch (const StoreRefused& error) {
    EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
  }
}

TEST_F(Sweeps, ReadBackAsTheyWereRecorded) {
  {
    SweepFile file = SweepFile::open(path_, a_sweep_plan());
    file.record({a_sweep_row(7), a_failed_row(3)});
    file.record({a_sweep_row(20)});
  }
  SweepFile file = SweepFile::open(path_);
  EXPECT_TRUE(is_sweep_file(path_));
  EXPECT_TRUE(differences(file.plan(), a_sweep_plan()).empty());
  EXPECT_EQ(file.plan().seed, a_sweep_plan().seed);
  EXPECT_EQ(file.count(), 3);
  EXPECT_EQ(file.failed(), 1);
  const std::vector<bool> recorded = file.recorded();
  ASSERT_EQ(recorded.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(recorded[i], i == 2 || i == 6 || i == 19) << i;
  const std::vector<SweepRow> rows = rows_of(file);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_TRUE(same(rows[0], a_failed_row(3)));
  EXPECT_TRUE(same(rows[1], a_sweep_row(7)));
  EXPECT_TRUE(same(rows[2], a_sweep_row(20)));
}

TEST_F(Sweeps, AFileOfTwoNamesIsReadOnly) {
  make_sweep(path_, {7});
  const std::string second = folder_ / "b.sweep";
  fs::create_hard_link(path_, second);
  const std::string before = contents_of(path_);
  for (const std::string& name : {path_, second}) {
    expect_refused([&] { SweepFile::open(name, a_sweep_plan()); }, "has 2 names");
    EXPECT_EQ(SweepFile::open(name).count(), 1);
  }
  write_file(second + "-journal", "");
  fs::permissions(second + "-journal", fs::perms::owner_read | fs::perms::owner_write);
  expect_refused([&] { SweepFile::open(second); }, "has 2 names");
  EXPECT_EQ(contents_of(path_), before);
}

TEST_F(Sweeps, RefusesANewNameOfAnOpenFile) {
  const std::string second = folder_ / "b.sweep";
  SweepFile file = SweepFile::open(path_, a_sweep_plan());
  file.record({a_sweep_row(7)});
  fs::create_hard_link(path_, second);
  expect_refused([&] { SweepFile::open(second, a_sweep_plan()); }, "under another name");
  fs::remove(second);
  file.finish();
  fs::create_hard_link(path_, second);
  expect_refused([&] { SweepFile::open(second, a_sweep_plan()); }, "under another name");
}

TEST_F(Sweeps, VisitsEveryPointOnceInOrder) {
  for (const std::int64_t points : {1, 999, 1000, 1001, 2000, 2500}) {
    const std::string path = folder_ / (std::to_string(points) + ".sweep");
    std::vector<SweepRow> rows;
    for (std::int64_t point = points; point >= 1; --point) rows.push_back(a_sweep_row(point));
    SweepFile file = SweepFile::open(path, a_sweep_plan(points));
    EXPECT_TRUE(rows_of(file).empty());
    file.record(rows);
    const std::vector<SweepRow> found = rows_of(file);
    ASSERT_EQ(found.size(), rows.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      ASSERT_EQ(found[i].point, static_cast<std::int64_t>(i) + 1);
  }
}

TEST_F(Sweeps, BytesDependOnPlanAndResultsAlone) {
  make_sweep(path_, {1, 2, 3, 4, 5}, true);
  make_sweep(folder_ / "b.sweep", {5, 3}, false);
  make_sweep(folder_ / "b.sweep", {1, 4, 2}, true);
  EXPECT_EQ(contents_of(path_), contents_of(folder_ / "b.sweep"));
  EXPECT_FALSE(fs::exists(path_ + "-journal"));
}

/// Plan and rows as readers get them; empty: the file is refused.
std::string readable(const std::string& path) {
  try {
    SweepFile file = SweepFile::open(path);
    std::string all = file.plan().protocol + file.plan().program_version;
    for (const bool recorded : file.recorded()) all += recorded ? '1' : '0';
    all += std::to_string(file.count()) + " " + std::to_string(file.failed());
    file.for_each([&](const SweepRow& row) {
      all += "\n" + std::to_string(row.point) + row.reason + std::to_string(row.seed);
      for (const SweepValue& value : row.values) {
        const auto* const number = std::get_if<double>(&value);
        all += number ? std::to_string(std::bit_cast<std::uint64_t>(*number))
                      : std::get<std::string>(value);
      }
      for (const std::optional<double>& figure : row.figures)
        all += figure ? std::to_string(std::bit_cast<std::uint64_t>(*figure)) : " -";
    });
    return all;
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    return "";
  }
}

TEST_F(Sweeps, RefusesFlippedBitsNamingTheRow) {
  for (const auto& [sql, said] :
       {std::pair("UPDATE points SET time_ray_hat = time_ray_hat + 1e-9 WHERE point = 3",
                  "point 3 does not match its checksum"),
        {"UPDATE points SET gain_ball = NULL WHERE point = 2", "point 2 does not match"},
        {"UPDATE points SET \"order\" = 'word 7' WHERE point = 1", "point 1 does not match"},
        {"UPDATE points SET point = 9 WHERE point = 4", "point 9 does not match"},
        {"UPDATE points SET status = 'failed', reason = 'x' WHERE point = 4", "point 4 does"},
        {"UPDATE points SET seal = zeroblob(32) WHERE point = 4", "point 4 does not match"},
        {"UPDATE sweep SET participants = 4", "the plan does not match its checksum"},
        {"UPDATE sweep SET seal = zeroblob(32)", "the plan does not match its checksum"}}) {
    make_sweep(path_, {1, 2, 3, 4});
    SQLite::Database(path_, SQLite::OPEN_READWRITE).exec(sql);
    expect_refused([&] { SweepFile::open(path_); }, said);
    expect_refused([&] { SweepFile::open(path_, a_sweep_plan()); }, said);
    fs::remove(path_);
  }
}

TEST_F(Sweeps, NoFlippedBitGivesOtherValues) {
  make_sweep(path_, {1, 2, 3, 4, 5}, true);
  const std::string bytes = contents_of(path_), right = readable(path_);
  ASSERT_NE(right, "");
  const std::string flipped = folder_ / "flipped.sweep";
  int refused = 0, flips = 0;
  for (std::size_t at = 0; at < bytes.size(); at += 37) {  // prime: all kinds of bytes
    std::string changed = bytes;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (flips++ % 8)));
    write_file(flipped, changed);
    const std::string found = readable(flipped);
    refused += found.empty() ? 1 : 0;
    EXPECT_TRUE(found.empty() || found == right) << "byte " << at;
  }
  EXPECT_GT(refused, 20) << "of " << flips << ": many bytes are of no row";
}

/// A file of version 1, without seals.
void make_version_1(const std::string& path, const std::string& from) {
  SQLite::Database old(path, SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  old.exec("ATTACH '" + from + "' AS new");
  const std::string seal = ", seal BLOB NOT NULL CHECK (length(seal) = 32)";
  for (const char* const table : {"sweep", "points"}) {
    const std::string name = table;
    std::string sql =
        old.execAndGet("SELECT sql FROM new.sqlite_schema WHERE name = '" + name + "'").getString();
    const std::size_t at = sql.find(seal);
    ASSERT_NE(at, std::string::npos);
    old.exec(sql.erase(at, seal.size()));
    std::string columns;
    SQLite::Statement find(old, "SELECT name FROM pragma_table_info('" + name + "')");
    while (find.executeStep())
      columns += (columns.empty() ? "\"" : ", \"") + find.getColumn(0).getString() + "\"";
    old.exec("INSERT INTO " + name + " SELECT " + columns + " FROM new." + name);
  }
  old.exec("PRAGMA application_id = " + std::to_string(kSweepApplicationId));
  old.exec("PRAGMA user_version = 1");
}

TEST_F(Sweeps, ReadsFilesFromBeforeCellsHadColumns) {
  SweepPlan plan = a_sweep_plan();
  plan.shapes.clear();
  plan.protocol = R"({"version": 2, "renderers": ["ray"], "factors": [
      {"name": "size", "levels": [{"name": "s", "set": {}}, {"name": "l", "set": {}}]}],
      "blocks": [{"name": "b", "task": "rate", "stimuli": ["ball"], "factors": ["size"]}]})";
  plan.has_cells = false;
  EXPECT_EQ(figure_columns(plan).size(), 2U);
  SweepFile::open(path_, plan).finish();
  EXPECT_FALSE(SweepFile::open(path_).plan().has_cells);
  plan.has_cells = true;
  EXPECT_EQ(figure_columns(plan).size(), 4U);
  try {
    SweepFile::open(path_, plan);
    FAIL() << "rows of other columns";
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("columns for the cells of factors"),
              std::string::npos);
  }
  SweepFile::open(folder_ / "b.sweep", plan).finish();
  EXPECT_TRUE(SweepFile::open(folder_ / "b.sweep").plan().has_cells);
}

TEST_F(Sweeps, ReadsVersion1AndSealsItWhenResumed) {
  make_sweep(folder_ / "b.sweep", {1, 2, 4}, true);
  make_version_1(path_, folder_ / "b.sweep");
  EXPECT_EQ(readable(path_), readable(folder_ / "b.sweep"));
  {
    SweepFile file = SweepFile::open(path_, a_sweep_plan());
    EXPECT_EQ(file.count(), 3);
    file.record({a_sweep_row(3)});
    file.finish();
  }
  make_sweep(folder_ / "c.sweep", {1, 2, 3, 4}, true);
  EXPECT_EQ(contents_of(path_), contents_of(folder_ / "c.sweep"));
}

TEST_F(Sweeps, ValuesAreSealedAsSQLiteStoresThem) {
  SweepRow row = a_sweep_row(1);
  row.values[0] = -0.0;
  row.figures[0] = -0.0;
  row.figures[1] = std::nan("");
  SweepFile::open(path_, a_sweep_plan()).record({row});
  SweepFile file = SweepFile::open(path_);
  EXPECT_EQ(rows_of(file)[0].figures[1], std::nullopt);
}

TEST_F(Sweeps, RefusesRowsThatDoNotFitThePlan) {
  SweepFile file = SweepFile::open(path_, a_sweep_plan());
  file.record({a_sweep_row(1)});
  EXPECT_THROW(file.record({a_sweep_row(2), a_sweep_row(1)}), StoreError);
  expect_refused([&] { file.record({a_sweep_row(2), a_sweep_row(21)}); }, "point 21");
  SweepRow short_row = a_sweep_row(3);
  short_row.figures.pop_back();
  expect_refused([&] { file.record({a_sweep_row(2), short_row}); }, "point 3");
  EXPECT_EQ(file.count(), 1);
  SweepFile reader = SweepFile::open(path_);
  expect_refused([&] { reader.record({a_sweep_row(2)}); }, "for reading only");
}

TEST_F(Sweeps, AnotherPlanIsRefusedWithEveryDifference) {
  make_sweep(path_, {1});
  SweepPlan other = a_sweep_plan(21);
  other.protocol = R"({"name": "two", "stimuli": [{"radius_m": 0.03}]})";
  other.settings = R"({"motor": {"reaction_delay_s": 0.1, "new": [1]}})";
  other.shapes = {"ball", "cap"};
  expect_refused([&] { SweepFile::open(path_, other); }, "points: 20 and 21");
  expect_refused([&] { SweepFile::open(path_, other); },
                 R"(protocol: /stimuli/1 {"radius_m":0.02} and (nothing))");
  expect_refused([&] { SweepFile::open(path_, other); },
                 "settings of the participant: /motor/new (nothing) and [1]");
  expect_refused([&] { SweepFile::open(path_, other); },
                 R"(shapes: ["ball","hat"] and ["ball","cap"])");
}

TEST_F(Sweeps, NamesAppendedElementsWithPlaceAndValue) {
  SweepPlan one = a_sweep_plan(), two = one;
  one.space = R"({"parameters": [{"name": "a"}], "-": 1})";
  two.space = R"({"parameters": [{"name": "b"}, {"name": "c"}, 5], "-": 2})";
  const std::vector<std::string> found = differences(one, two);
  ASSERT_EQ(found.size(), 1u);
  for (const char* const text :
       {"/- 1 and 2", R"(/parameters/0/name "a" and "b")",
        R"(/parameters/1 (nothing) and {"name":"c"})", "/parameters/2 (nothing) and 5"}) {
    EXPECT_NE(found[0].find(text), std::string::npos) << found[0];
  }
  two.space = one.space;
  one.space = R"([])";
  two.space = R"({})";
  EXPECT_EQ(differences(one, two)[0], "space:  [] and {}");
  one.space = "[1,2,3,4,5,6,7,8]";
  two.space = "[]";
  EXPECT_NE(differences(one, two)[0].find("and 3 more"), std::string::npos);
  two.space = "[1, 2, 3, 4, 5, 6, 7, 8]";
  EXPECT_EQ(differences(one, two)[0], "space: their layout alone");
}

TEST_F(Sweeps, TellsNamesOfParametersColumnsAndShapesApart) {
  SweepPlan plan = a_sweep_plan();
  EXPECT_FALSE(columns_alike(plan));
  for (const char* const taken :
       {"Hat", "ball", "gain_ball", "TIME_ray_hat", "seed", "point", "order"}) {
    plan.parameters = {taken, "order"};
    EXPECT_TRUE(columns_alike(plan)) << taken;
  }
  plan.parameters = {"hats", "ray"};
  EXPECT_FALSE(columns_alike(plan));
}

TEST_F(Sweeps, OneWriterAnyNumberOfReaders) {
  SweepFile writer = SweepFile::open(path_, a_sweep_plan());
  expect_refused([&] { SweepFile::open(path_, a_sweep_plan()); }, "process");
  expect_refused([&] { SweepFile::open(path_, SweepFile::Writers::none); }, "process");
  SweepFile reader = SweepFile::open(path_);
  writer.record({a_sweep_row(2)});
  EXPECT_EQ(reader.count(), 1);
}

// Readers may be slow: an export to a slow disk, an analysis.
TEST_F(Sweeps, PointsAreRecordedWhileAReaderVisitsThem) {
  SweepFile writer = SweepFile::open(path_, a_sweep_plan(3000));
  std::vector<SweepRow> rows;
  for (std::int64_t point = 1; point <= 1500; ++point) rows.push_back(a_sweep_row(point));
  writer.record(rows);
  SweepFile reader = SweepFile::open(path_);
  std::int64_t visited = 0;
  reader.for_each([&](const SweepRow& row) {
    EXPECT_EQ(row.point, ++visited);
    if (row.point == 1 || row.point == 1400) writer.record({a_sweep_row(row.point + 1500)});
  });
  EXPECT_GE(visited, 1500);
  EXPECT_EQ(writer.count(), 1502);
}

// Longer than five seconds, a common timeout of SQLite's users.
TEST_F(Sweeps, WriterSurvivesSlowReadersOfOtherPrograms) {
  SweepFile writer = SweepFile::open(path_, a_sweep_plan());
  writer.record({a_sweep_row(1), a_sweep_row(2)});
  SQLite::Database other(path_, SQLite::OPEN_READONLY);
  SQLite::Statement held(other, "SELECT * FROM points");
  ASSERT_TRUE(held.executeStep());
  std::jthread reader([&] {
    std::this_thread::sleep_for(std::chrono::seconds(7));
    held.reset();
  });
  EXPECT_NO_THROW(writer.record({a_sweep_row(3)}));
  EXPECT_EQ(writer.count(), 3);
}

TEST_F(Sweeps, OtherFilesAreRefused) {
  std::ofstream(path_) << "text";
  EXPECT_FALSE(is_sweep_file(path_));
  EXPECT_FALSE(is_sweep_file(folder_ / "none"));
  expect_refused([&] { SweepFile::open(path_); }, "is not a sweep's file");
  expect_refused([&] { SweepFile::open(folder_ / "none"); }, "no such file");
  expect_refused([&] { SweepFile::open(folder_.path()); }, "is not a file");
  make_sweep(folder_ / "b.sweep", {1, 2});
  SQLite::Database(folder_ / "b.sweep", SQLite::OPEN_READWRITE).exec("CREATE TABLE more (x)");
  expect_refused([&] { SweepFile::open(folder_ / "b.sweep"); }, "other tables");
  make_sweep(folder_ / "d.sweep", {1, 2});
  SQLite::Database(folder_ / "d.sweep", SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  expect_refused([&] { SweepFile::open(folder_ / "d.sweep"); }, "a sweep's file of version 99");
  make_sweep(folder_ / "c.sweep", {1, 2});
  fs::resize_file(folder_ / "c.sweep", 5000);
  expect_refused([&] { SweepFile::open(folder_ / "c.sweep"); }, "damaged");
}

}  // namespace
}  // namespace palpate::data
