// Files of a protocol are stored with the data and verified.

#include <SQLiteCpp/Database.h>
#include <gtest/gtest.h>

#include "data/merge/merge.h"
#include "data/store/store.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;

ProtocolInfo with_files(const std::string& wedge) {
  ProtocolInfo protocol = a_protocol();
  protocol.files = {{"meshes/wedge.obj", wedge}, {"plate.stl", std::string("solid\0\xff", 7)}};
  return protocol;
}

class ProtocolFiles : public ::testing::Test {
 protected:
  Store open() const { return Store::open(path_, Store::Mode::write_or_create); }
  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "study.db";
};

TEST_F(ProtocolFiles, AreKeptByteForByte) {
  open().enrol(with_files("v 0 0 0\r\n"), "P1");
  Store store = Store::open(path_, Store::Mode::read_only);
  const auto files = store.files(a_protocol().sha256);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].name, "meshes/wedge.obj");
  EXPECT_EQ(files[0].bytes, "v 0 0 0\r\n");
  EXPECT_EQ(files[1].bytes, std::string("solid\0\xff", 7));
  EXPECT_TRUE(store.files(a_protocol('b').sha256).empty());
}

TEST_F(ProtocolFiles, RefusesAChangedOneAndStoresNothing) {
  Store store = open();
  store.enrol(with_files("v 0 0 0"), "P1");
  const std::string message = error_of([&] { store.enrol(with_files("v 1.4 0 0"), "P2"); });
  EXPECT_TRUE(contains(message, path_) && contains(message, "meshes/wedge.obj")) << message;
  EXPECT_EQ(store.counts().participants, 1);
  store.enrol(with_files("v 0 0 0"), "P2");
}

TEST_F(ProtocolFiles, AMissingFileIsAdded) {
  Store store = open();
  store.enrol(a_protocol(), "P1");  // as older versions did
  const palpate::data::Run first = store.begin_run(store.enrol(a_protocol(), "P1"), a_run());
  store.end_run(first, RunEnd::paused, 1);
  store.end_run(store.begin_run(store.enrol(with_files("v"), "P1"), a_run()), RunEnd::done, 2);
  const auto runs = store.runs();
  EXPECT_EQ(runs.at(0).info.files_sha256, "");
  EXPECT_EQ(runs.at(1).info.files_sha256.size(), 64u);
}

TEST_F(ProtocolFiles, EveryReaderFindsAChangeInTheDatabase) {
  open().enrol(with_files("v 0 0 0"), "P1");
  const std::string original = contents_of(path_);
  for (const char* edit : {"UPDATE files SET bytes = x'00' WHERE id = 1",
                           "UPDATE protocols SET text = replace(text, '1', '2')"}) {
    write_file(path_, original);
    SQLite::Database(path_, SQLite::OPEN_READWRITE).exec(edit);
    for (const Store::Mode mode : {Store::Mode::read_only, Store::Mode::write_or_create}) {
      const std::string message = error_of([&] { Store::open(path_, mode); });
      EXPECT_TRUE(contains(message, path_) && contains(message, "SHA-256")) << edit << message;
    }
    EXPECT_TRUE(contains(error_of([&] { merge(folder_ / "all.db", {path_}); }), "SHA-256")) << edit;
  }
}

TEST_F(ProtocolFiles, EveryReaderRefusesTextsNestedTooDeep) {
  ProtocolInfo deep = a_protocol();
  deep.text =
      R"({"version": 1, "deep": )" + std::string(200'000, '[') + std::string(200'000, ']') + "}";
  deep.sha256 = checksum_hex(deep.text);
  open().enrol(deep, "P1");
  for (const Store::Mode mode : {Store::Mode::read_only, Store::Mode::write_or_create}) {
    const std::string message = error_of([&] { Store::open(path_, mode); });
    EXPECT_TRUE(contains(message, path_) && contains(message, "at most 64 deep")) << message;
  }
  EXPECT_TRUE(contains(error_of([&] { merge(folder_ / "all.db", {path_}); }), "64 deep"));
}

TEST_F(ProtocolFiles, AreMergedAndCompared) {
  const std::string other = folder_ / "other.db";
  open().enrol(with_files("v 0 0 0"), "P1");
  {
    Store store = Store::open(other, Store::Mode::write_or_create);
    store.end_run(store.begin_run(store.enrol(with_files("v 0 0 0"), "P2", 2), a_run()),
                  RunEnd::done, 2);
  }
  merge(folder_ / "all.db", {path_, other});
  Store all = Store::open(folder_ / "all.db", Store::Mode::read_only);
  EXPECT_EQ(all.files(a_protocol().sha256).at(0).bytes, "v 0 0 0");
  EXPECT_EQ(all.runs().at(0).info.files_sha256.size(), 64u);
  std::filesystem::remove(other);
  Store::open(other, Store::Mode::write_or_create).enrol(with_files("v 1.4 0 0"), "P2", 2);
  EXPECT_TRUE(contains(error_of([&] {
                         merge(folder_ / "no.db", {path_, other});
                       }),
                       other + ": meshes/wedge.obj of protocol ho2000 differs"));
}

TEST_F(ProtocolFiles, ARunMayBeShownWithOtherTexts) {
  {
    Store store = open();
    const Participant person = store.enrol(with_files("v"), "P1");
    ProtocolInfo texts = a_protocol('b');
    texts.files = with_files("v").files;
    store.end_run(store.begin_run(person, a_run()), RunEnd::paused, 1);
    store.end_run(store.begin_run(person, a_run(), &texts), RunEnd::done, 2);
  }
  merge(folder_ / "all.db", {path_});
  for (const std::string& path : {path_, folder_ / "all.db"}) {
    Store store = Store::open(path, Store::Mode::read_only);
    EXPECT_EQ(store.runs().at(0).info.protocol_sha256, "");
    EXPECT_EQ(store.runs().at(1).info.protocol_sha256, a_protocol('b').sha256);
    EXPECT_EQ(store.runs().at(1).info.files_sha256, store.runs().at(0).info.files_sha256);
  }
}

}  // namespace
}  // namespace palpate::data
