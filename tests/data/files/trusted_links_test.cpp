// Resolution of the links of a path, compared with the C library's realpath.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "data/files/file_permissions.h"
#include "tests/data/store/store_fixture.h"

namespace palpate::data {
namespace {

using namespace palpate::data::testing;
namespace fs = std::filesystem;

std::string real_path(const std::string& path) {
  const std::unique_ptr<char, void (*)(void*)> found(::realpath(path.c_str(), nullptr), std::free);
  return found ? found.get() : "";
}

class TrustedLinks : public ::testing::Test {
 protected:
  TrustedLinks() {
    fs::create_directories(folder_ / "a/b");
    write_file(folder_ / "a/b/file", "x");
    fs::create_symlink("a/b", folder_ / "relative");
    fs::create_symlink(folder_ / "a", folder_ / "absolute");
    fs::create_symlink("../../relative/file", folder_ / "a/b/round");
    fs::create_symlink(".", folder_ / "here");
  }
  const TemporaryFolder folder_;
};

TEST_F(TrustedLinks, LeadWhereTheSystemFindsTheFile) {
  for (const char* const name :
       {"a/b/file", "./a/./b/./file", "a//b///file", "a/../a/b/../../a/b/file", "relative/file",
        "absolute/b/file", "absolute/../a/b/file", "a/b/round", "here/here/./relative/round",
        "a/b/", "a/b/.", "relative/.."}) {
    const ResolvedPath found = resolve_trusted_links(folder_ / name);
    EXPECT_EQ(found.fault, "") << name;
    EXPECT_EQ(found.path, real_path(folder_ / name)) << name;
  }
  for (const char* const path : {"/", "/..", "/../tmp/.", "."})
    EXPECT_EQ(resolve_trusted_links(path).path, real_path(path)) << path;
}

TEST_F(TrustedLinks, NeedNoFileAtTheirEnd) {
  for (const char* const name : {"relative/new", "./relative/./new", "absolute/b/../b/new"}) {
    EXPECT_EQ(resolve_trusted_links(folder_ / name).path, real_path(folder_ / "a/b") + "/new")
        << name;
  }
  fs::create_symlink("a/later", folder_ / "dangling");
  EXPECT_EQ(resolve_trusted_links(folder_ / "dangling").path, real_path(folder_ / "a") + "/later");
}

TEST_F(TrustedLinks, FollowsChainsOfFortyButNoCircles) {
  fs::create_symlink("a/b/file", folder_ / "link1");
  for (int k = 2; k <= 41; ++k)
    fs::create_symlink("link" + std::to_string(k - 1), folder_ / ("link" + std::to_string(k)));
  EXPECT_EQ(resolve_trusted_links(folder_ / "link40").path, real_path(folder_ / "a/b/file"));
  EXPECT_NE(resolve_trusted_links(folder_ / "link41").fault, "");
  fs::create_symlink("circle", folder_ / "circle");
  EXPECT_EQ(resolve_trusted_links(folder_ / "circle").path, "");
  EXPECT_NE(resolve_trusted_links(folder_ / "circle").fault, "");
  EXPECT_NE(resolve_trusted_links("").fault, "");
}

TEST_F(TrustedLinks, OtherUsersLinksAreNotFollowed) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can lay a link of another user";
  ASSERT_EQ(::lchown((folder_ / "relative").c_str(), 12345, 12345), 0);
  const ResolvedPath found = resolve_trusted_links(folder_ / "here/relative/file");
  EXPECT_EQ(found.path, "");
  EXPECT_TRUE(
      contains(found.fault, real_path(folder_.path()) + "/relative, a link of another user"))
      << found.fault;
  EXPECT_EQ(resolve_trusted_links(folder_ / "absolute/b/file").fault, "");
}

}  // namespace
}  // namespace palpate::data
