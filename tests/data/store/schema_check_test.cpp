// Tables of palpate: white space and comments of their SQL may differ, nothing else.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <gtest/gtest.h>

#include <string>

#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

class SchemaCheck : public ::testing::Test {
 protected:
  SchemaCheck() { Store::open(path_, Store::Mode::write_or_create).enrol(a_protocol(), "A"); }
  /// Rewrites the SQL of every table and index. \param sql  an expression of the column `sql`
  void rewrite(const std::string& sql) {
    SQLite::Database db(path_, SQLite::OPEN_READWRITE);
    db.exec("PRAGMA writable_schema = ON");
    EXPECT_GT(db.exec("UPDATE sqlite_schema SET sql = " + sql + " WHERE sql IS NOT NULL"), 0);
    db.exec("PRAGMA writable_schema = RESET");
  }
  std::string refusal() {
    return error_of([&] { Store::open(path_, Store::Mode::write_or_create); });
  }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(SchemaCheck, TakesOtherWhiteSpaceAndComments) {
  rewrite("replace(sql, ' (', '  -- a comment, it''s one' || char(13, 10, 9) || '(')");
  EXPECT_EQ(Store::open(path_, Store::Mode::read_only).participants(a_protocol().sha256).size(),
            1U);
  EXPECT_EQ(Store::open(path_, Store::Mode::write_or_create).counts().completed, 0);
}

TEST_F(SchemaCheck, RefusesSpacesWithinQuotes) {
  rewrite("replace(sql, '''cut_off''', '''cut_off  ''')");
  EXPECT_TRUE(contains(refusal(), "'attempts' is not defined as palpate defines it")) << refusal();
}

TEST_F(SchemaCheck, RefusesAnotherLimit) {
  rewrite("replace(sql, '>= 0', '>= 1')");
  EXPECT_TRUE(contains(refusal(), "is not defined as palpate defines it")) << refusal();
}

}  // namespace
}  // namespace palpate::data
