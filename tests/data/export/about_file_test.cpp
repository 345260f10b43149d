// The file of --about: accepted content, and faults named with their place.

#include "runner/registration/about_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "protocols/parse.h"

namespace palpate::runner {
namespace {

namespace fs = std::filesystem;

const std::string kStudies = PALPATE_SOURCE_DIR "/tests/protocols/studies/";

std::vector<fs::path> studies(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kStudies + folder)) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  return files;
}

TEST(AboutFile, IsReadAsItIsWritten) {
  EXPECT_GE(studies("good").size(), 3U);
  for (const fs::path& file : studies("good"))
    EXPECT_NO_THROW(registration::read_about_file(file)) << file;
  const data::StudyAbout about = registration::read_about_file(kStudies + "good/everything.json");
  ASSERT_EQ(about.authors.size(), 3U);
  EXPECT_EQ(about.authors[0].name, "Example, Ada");
  EXPECT_EQ(about.authors[0].affiliation, "Universität Beispielstadt");
  EXPECT_EQ(about.authors[1].orcid, "0000-0002-9079-593X") << "without its address";
  EXPECT_EQ(about.authors[2].name, "Cy Example");
  EXPECT_EQ(about.funding[1].grant, "BCS-0000001");
  EXPECT_EQ(about.doi, "10.5281/zenodo.1234");
  EXPECT_EQ(data::license_url(about), "https://spdx.org/licenses/CC-BY-4.0.html");
  const data::StudyAbout other =
      registration::read_about_file(kStudies + "good/license-by-address.json");
  EXPECT_EQ(data::license_url(other), "https://example.org/license");
  EXPECT_EQ(data::doi_url(other), "");
}

TEST(AboutFile, NamesEveryFaultOfBadFiles) {
  EXPECT_GE(studies("bad").size(), 19U);
  for (const fs::path& file : studies("bad")) {
    std::vector<std::string> expected, found;
    std::ifstream lines(fs::path(file).replace_extension(".faults"));
    for (std::string line; std::getline(lines, line);) expected.push_back(line);
    try {
      registration::read_about_file(file);
      ADD_FAILURE() << file << " is accepted";
    } catch (const protocols::InputError& error) {
      for (const protocols::Fault& fault : error.faults()) found.push_back(fault.location);
    }
    std::sort(expected.begin(), expected.end());
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected) << file;
  }
}

TEST(AboutFile, EveryWrongDigitOfAnOrcidIsFound) {
  const std::string good = "0000-0002-9079-593X";
  for (std::size_t i = 0; i + 1 < good.size(); ++i) {
    for (char digit = '0'; digit <= '9'; ++digit) {
      std::string changed = good;
      if (changed[i] == '-') continue;
      changed[i] = digit;
      const std::string text =
          R"({"version": 1, "authors": [{"name": "A", "orcid": ")" + changed + R"("}]})";
      if (changed == good) {
        EXPECT_NO_THROW(registration::read_about_text(text, "study.json"));
      } else {
        EXPECT_THROW(registration::read_about_text(text, "study.json"), protocols::InputError)
            << changed;
      }
    }
  }
}

}  // namespace
}  // namespace palpate::runner
