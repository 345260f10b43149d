#include "runner/registration/about_file.h"

#include <algorithm>
#include <array>
#include <optional>
#include <regex>

#include "data/base/text.h"
#include "protocols/json_document.h"

namespace palpate::runner::registration {
namespace {

using nlohmann::json;
using protocols::child_pointer;
using protocols::FaultList;
using protocols::found_text;
using protocols::ObjectReader;
using protocols::Presence;

constexpr std::size_t kMostEntries = 1000;
constexpr std::size_t kLongest = 2000;  // characters of a text

// Licenses suitable for data, by their names in the SPDX list.
constexpr std::array kLicenses = {
    "CC0-1.0",      "CC-BY-4.0",       "CC-BY-SA-4.0", "CC-BY-NC-4.0", "CC-BY-NC-SA-4.0",
    "CC-BY-ND-4.0", "CC-BY-NC-ND-4.0", "PDDL-1.0",     "ODC-By-1.0",   "ODbL-1.0"};

/// Reads a line that is not empty.
std::optional<std::string> read_about_line(const json& value, const std::string& place,
                                           FaultList& faults) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    const bool controls =
        std::any_of(text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7F; });
    if (!controls && text.find_first_not_of(' ') != std::string::npos &&
        count_characters(text) <= kLongest) {
      return text;
    }
  }
  faults.add(place, "expected a text of 1 to " + std::to_string(kLongest) +
                        " characters in one line" + found_text(value));
  return std::nullopt;
}

void read_about_line(ObjectReader& reader, const char* key, std::string& out,
                     Presence presence = Presence::optional) {
  const json* const value = reader.member(key, presence);
  if (value == nullptr) return;
  if (const auto text = read_about_line(*value, reader.pointer(key), reader.faults())) out = *text;
}

std::vector<std::string> read_lines(ObjectReader& reader, const char* key) {
  std::vector<std::string> out;
  if (const json* const list = reader.array(key, 1, kMostEntries)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      const std::string place = child_pointer(reader.pointer(key), i);
      if (const auto text = read_about_line((*list)[i], place, reader.faults()))
        out.push_back(*text);
    }
  }
  return out;
}

/// Reads a text that matches the pattern; `out` gets its last group.
void read_pattern(ObjectReader& reader, const char* key, const std::regex& pattern,
                  const char* expected, std::string& out) {
  const json* const value = reader.member(key);
  if (value == nullptr) return;
  std::smatch match;
  // std::regex recurses for each letter, so limit the length.
  constexpr std::size_t kLongestPattern = 200;
  if (value->is_string() && value->get_ref<const std::string&>().size() <= kLongestPattern &&
      std::regex_match(value->get_ref<const std::string&>(), match, pattern)) {
    out = match[match.size() - 1];
  } else {
    reader.faults().add(reader.pointer(key), expected + found_text(*value));
  }
}

/// ISO 7064, mod 11-2: detects every wrong digit and every swap of two.
bool has_right_check_digit(const std::string& orcid) {
  int sum = 0;
  for (const char c : orcid.substr(0, orcid.size() - 1)) {
    if (c != '-') sum = (sum + (c - '0')) * 2 % 11;
  }
  const int digit = (12 - sum) % 11;
  return orcid.back() == (digit == 10 ? 'X' : static_cast<char>('0' + digit));
}

void read_orcid(ObjectReader& reader, std::string& out) {
  static const std::regex pattern(R"((https://orcid\.org/)?(\d{4}-\d{4}-\d{4}-\d{3}[\dX]))");
  read_pattern(reader, "orcid", pattern, "expected an ORCID such as 0000-0002-1825-0097", out);
  if (!out.empty() && !has_right_check_digit(out)) {
    reader.faults().add(
        reader.pointer("orcid"),
        "expected an ORCID; a digit of this one is wrong, according to its check digit" +
            found_text(*reader.member("orcid")));
  }
}

/// BIDS takes a name with two commas for several authors.
void check_commas(const std::string& name, const std::string& place, FaultList& faults) {
  if (std::count(name.begin(), name.end(), ',') > 1)
    faults.add(place, "expected one author, with one comma at most" + found_text(name));
}

/// Entries are texts, or objects with more members. \param main  key of the text in an object
template <class Entry>
std::vector<Entry> read_entries(ObjectReader& reader, const char* key, Presence presence,
                                const char* main, std::string Entry::*text,
                                void (*read_more)(ObjectReader&, Entry&)) {
  std::vector<Entry> out;
  const json* const list = reader.array(key, 1, kMostEntries, presence);
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string place = child_pointer(reader.pointer(key), i);
    Entry& entry = out.emplace_back();
    if (value.is_object()) {
      ObjectReader inner(value, place, reader.faults());
      read_about_line(inner, main, entry.*text, Presence::required);
      read_more(inner, entry);
      inner.refuse_unknown_keys();
    } else if (const auto line = read_about_line(value, place, reader.faults())) {
      entry.*text = *line;
    }
  }
  return out;
}

void read_authors(ObjectReader& reader, data::StudyAbout& about) {
  about.authors = read_entries<data::StudyAuthor>(
      reader, "authors", Presence::required, "name", &data::StudyAuthor::name,
      [](ObjectReader& inner, data::StudyAuthor& author) {
        read_orcid(inner, author.orcid);
        read_about_line(inner, "affiliation", author.affiliation);
      });
  for (std::size_t i = 0; i < about.authors.size(); ++i)
    check_commas(about.authors[i].name, child_pointer("/authors", i), reader.faults());
}

void read_license(ObjectReader& reader, std::string& out) {
  const json* const value = reader.member("license");
  if (value == nullptr) return;
  std::string names;
  for (const char* const name : kLicenses) {
    if (value->is_string() && value->get_ref<const std::string&>() == name) out = name;
    names += std::string(names.empty() ? "" : ", ") + name;
  }
  if (!out.empty()) return;
  static const std::regex address(R"((https?://[^\s]+))");
  read_pattern(reader, "license", address,
               ("expected one of " + names + ", or the address of another (https://...)").c_str(),
               out);
}

}  // namespace

data::StudyAbout read_about_file(const std::string& path) {
  return read_about_text(protocols::read_text_file(path), path);
}

data::StudyAbout read_about_text(const std::string& text, const std::string& file_name) {
  FaultList faults(file_name);
  const json root = protocols::read_json(text, faults);
  data::StudyAbout about;
  ObjectReader reader(root, "", faults);
  int version = 1;
  reader.member("$schema");
  reader.integer("version", version, {1, 1}, Presence::required);
  read_authors(reader, about);
  read_license(reader, about.license);
  about.funding = read_entries<data::StudyFunding>(
      reader, "funding", Presence::optional, "funder", &data::StudyFunding::funder,
      [](ObjectReader& inner, data::StudyFunding& one) {
        read_about_line(inner, "grant", one.grant);
      });
  about.ethics_approvals = read_lines(reader, "ethics_approvals");
  about.references = read_lines(reader, "references");
  static const std::regex doi(R"((doi:|https?://(?:dx\.)?doi\.org/)?(10\.\d{4,9}/[^\s]+))");
  read_pattern(reader, "doi", doi, "expected a DOI such as 10.5281/zenodo.1234", about.doi);
  read_about_line(reader, "acknowledgements", about.acknowledgements);
  read_about_line(reader, "how_to_acknowledge", about.how_to_acknowledge);
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return about;
}

}  // namespace palpate::runner::registration
