#pragma once
// Authors and terms of use of a study, which neither protocol nor database holds.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace palpate::data {

struct StudyAuthor {
  std::string name;
  std::string orcid = {};        ///< "0000-0002-1825-0097"; "" for none
  std::string affiliation = {};  ///< "" for none
};

struct StudyFunding {
  std::string funder;
  std::string grant = {};  ///< its number; "" for none
};

/// The content of the file of `--about` (protocols/study.schema.json). Empty: not given.
struct StudyAbout {
  std::vector<StudyAuthor> authors = {};
  std::string license = {};  ///< SPDX identifier such as CC-BY-4.0, or an address
  std::vector<StudyFunding> funding = {};
  std::vector<std::string> ethics_approvals = {};
  std::vector<std::string> references = {};  ///< papers, preregistration, code
  std::string doi = {};                      ///< of the dataset, "10.5281/zenodo.1234"
  std::string acknowledgements = {}, how_to_acknowledge = {};
};

/// Address of the license's text.
std::string license_url(const StudyAbout& about);
/// "https://doi.org/10.5281/zenodo.1234"
std::string doi_url(const StudyAbout& about);

/// The given ones, as fields of BIDS's dataset_description.json.
nlohmann::ordered_json bids_fields(const StudyAbout& about);
/// The terms of https://schema.org/Dataset. It has none for ethics and acknowledgements.
nlohmann::ordered_json schema_org_terms(const StudyAbout& about);
/// Paragraphs for a README, each with a blank line after it; "" if nothing is given.
std::string about_text(const StudyAbout& about);

}  // namespace palpate::data
