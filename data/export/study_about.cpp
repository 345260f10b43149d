#include "data/export/study_about.h"

#include <algorithm>

#include "data/base/markdown.h"

namespace palpate::data {
namespace {

using Json = nlohmann::ordered_json;

std::string with_grant(const StudyFunding& one) {
  return one.funder + (one.grant.empty() ? "" : ", " + one.grant);
}

Json person(const StudyAuthor& author) {
  Json json{{"@type", "Person"}};
  if (!author.orcid.empty()) json["@id"] = "https://orcid.org/" + author.orcid;
  json["name"] = author.name;
  if (!author.affiliation.empty())
    json["affiliation"] = {{"@type", "Organization"}, {"name", author.affiliation}};
  return json;
}

void put(Json& json, const char* key, const std::string& text) {
  if (!text.empty()) json[key] = text;
}

void put(Json& json, const char* key, const std::vector<std::string>& texts) {
  if (!texts.empty()) json[key] = texts;
}

void put(Json& json, const char* key, const Json& list) {
  if (!list.empty()) json[key] = list;
}

template <class Each, class Text>
std::string paragraph(const char* title, const Each& all, const char* between, Text text_of) {
  std::string text;
  for (const auto& one : all) text += (text.empty() ? "" : between) + as_markdown(text_of(one));
  return text.empty() ? "" : std::string(title) + ": " + text + "\n\n";
}

std::string paragraph(const char* title, const std::string& text) {
  return text.empty() ? "" : std::string(title) + ": " + as_markdown(text) + "\n\n";
}

}  // namespace

std::string license_url(const StudyAbout& about) {
  const bool is_address = about.license.find("://") != std::string::npos;
  if (about.license.empty() || is_address) return about.license;
  return "https://spdx.org/licenses/" + about.license + ".html";
}

std::string doi_url(const StudyAbout& about) {
  return about.doi.empty() ? "" : "https://doi.org/" + about.doi;
}

Json bids_fields(const StudyAbout& about) {
  Json json = Json::object(), authors = Json::array(), funding = Json::array();
  for (const StudyAuthor& author : about.authors) authors.push_back(author.name);
  for (const StudyFunding& one : about.funding) funding.push_back(with_grant(one));
  put(json, "License", about.license);
  put(json, "Authors", authors);
  put(json, "Acknowledgements", about.acknowledgements);
  put(json, "HowToAcknowledge", about.how_to_acknowledge);
  put(json, "Funding", funding);
  put(json, "EthicsApprovals", about.ethics_approvals);
  put(json, "ReferencesAndLinks", about.references);
  if (!about.doi.empty()) json["DatasetDOI"] = "doi:" + about.doi;
  return json;
}

Json schema_org_terms(const StudyAbout& about) {
  Json json = Json::object(), authors = Json::array(), funders = Json::array(),
       grants = Json::array();
  for (const StudyAuthor& author : about.authors) authors.push_back(person(author));
  for (const StudyFunding& one : about.funding) {
    const Json funder{{"@type", "Organization"}, {"name", one.funder}};
    if (std::find(funders.begin(), funders.end(), funder) == funders.end())
      funders.push_back(funder);
    if (!one.grant.empty())
      grants.push_back({{"@type", "Grant"}, {"identifier", one.grant}, {"funder", funder}});
  }
  put(json, "author", authors);
  put(json, "license", license_url(about));
  put(json, "funder", funders);
  put(json, "funding", grants);
  put(json, "citation", about.references);
  put(json, "identifier", doi_url(about));
  put(json, "creditText", about.how_to_acknowledge);
  return json;
}

std::string about_text(const StudyAbout& about) {
  const auto itself = [](const std::string& text) { return text; };
  return paragraph("Authors", about.authors, "; ",
                   [](const StudyAuthor& author) {
                     return author.name +
                            (author.affiliation.empty() ? "" : " (" + author.affiliation + ")");
                   }) +
         paragraph("License", about.license) +
         paragraph("Funding", about.funding, "; ", with_grant) +
         paragraph("Ethics approvals", about.ethics_approvals, "; ", itself) +
         paragraph("References", about.references, "; ", itself) +
         paragraph("DOI", doi_url(about)) + paragraph("Acknowledgements", about.acknowledgements) +
         paragraph("How to acknowledge", about.how_to_acknowledge);
}

}  // namespace palpate::data
