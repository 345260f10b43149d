#include "runner/registration/crate.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

namespace palpate::runner::registration {
namespace {

using Json = nlohmann::ordered_json;

/// A path as a URI reference: reserved characters escaped, letters of every script kept.
std::string uri_of(std::string_view path) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string out;
  for (const char c : path) {
    if (kPlain.find(c) != std::string_view::npos || static_cast<unsigned char>(c) >= 0x80) {
      out += c;
    } else {
      constexpr std::string_view kHex = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(c);
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::string format_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 14> kFormats = {{
      {".csv", "text/csv"},
      {".tsv", "text/tab-separated-values"},
      {".json", "application/json"},
      {".html", "text/html"},
      {".svg", "image/svg+xml"},
      {".md", "text/markdown"},
      {".sh", "application/x-sh"},
      {".gz", "application/gzip"},
      {".obj", "model/obj"},
      {".stl", "model/stl"},
      {".glb", "model/gltf-binary"},
      {".gltf", "model/gltf+json"},
      {".3mf", "model/3mf"},
      {".png", "image/png"},
  }};
  for (const auto& [end, format] : kFormats) {
    if (name.ends_with(end)) return format;
  }
  const std::string_view last = name.substr(name.rfind('/') + 1);
  return last.find('.') == std::string_view::npos ? "text/plain" : "application/octet-stream";
}

Json reference(const std::string& id) { return {{"@id", id}}; }

class Crate {
 public:
  explicit Crate(const CrateFacts& facts) : facts_(facts) {}

  std::string text() {
    put_descriptor();
    Json root = {{"@id", "./"},
                 {"@type", "Dataset"},
                 {"name", facts_.name},
                 {"description", facts_.description},
                 {"datePublished", facts_.date},
                 {"license", reference(license())}};
    put_people(root);
    put_files(root);
    put_actions(root);
    graph_.insert(graph_.begin() + 1, std::move(root));
    const Json document = {{"@context", "https://w3id.org/ro/crate/1.2/context"},
                           {"@graph", graph_}};
    return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  }

 private:
  void put_descriptor() {
    graph_.push_back({{"@id", "ro-crate-metadata.json"},
                      {"@type", "CreativeWork"},
                      {"about", reference("./")},
                      {"conformsTo", reference("https://w3id.org/ro/crate/1.2")}});
  }

  /// \return its id
  std::string license() {
    std::string url = data::license_url(facts_.about);
    graph_.push_back(
        {{"@id", url},
         {"@type", "CreativeWork"},
         {"name", facts_.about.license},
         {"description", "License of the data in this bundle: " + facts_.about.license}});
    return url;
  }

  std::string organization(const std::string& name) {
    auto& id = organizations_[name];
    if (!id.empty()) return id;
    id = "#organization-" + std::to_string(organizations_.size());
    graph_.push_back({{"@id", id}, {"@type", "Organization"}, {"name", name}});
    return id;
  }

  void put_people(Json& root) {
    const data::StudyAbout& about = facts_.about;
    Json authors = Json::array(), funders = Json::array(), works = Json::array();
    for (const data::StudyAuthor& author : about.authors) {
      const std::string id = author.orcid.empty() ? "#author-" + std::to_string(authors.size() + 1)
                                                  : "https://orcid.org/" + author.orcid;
      if (std::ranges::find(authors, reference(id)) != authors.end()) continue;
      Json person = {{"@id", id}, {"@type", "Person"}, {"name", author.name}};
      if (!author.affiliation.empty())
        person["affiliation"] = reference(organization(author.affiliation));
      graph_.push_back(std::move(person));
      authors.push_back(reference(id));
    }
    for (const data::StudyFunding& one : about.funding) {
      const Json funder = reference(organization(one.funder));
      if (std::ranges::find(funders, funder) == funders.end()) funders.push_back(funder);
    }
    for (const std::string& one : about.references) {
      const std::string id = "#reference-" + std::to_string(works.size() + 1);
      graph_.push_back({{"@id", id}, {"@type", "CreativeWork"}, {"name", one}});
      works.push_back(reference(id));
    }
    if (!authors.empty()) root["author"] = authors;
    if (!funders.empty()) root["funder"] = funders;
    if (!works.empty()) root["citation"] = works;
    if (!about.how_to_acknowledge.empty()) root["creditText"] = about.how_to_acknowledge;
    if (about.doi.empty()) return;
    graph_.push_back({{"@id", data::doi_url(about)},
                      {"@type", "PropertyValue"},
                      {"propertyID", "https://registry.identifiers.org/registry/doi"},
                      {"value", "doi:" + about.doi},
                      {"url", data::doi_url(about)}});
    root["identifier"] = reference(data::doi_url(about));
  }

  /// The entity of a folder, created with its parents. \param folder "data/psych-ds"; "": the root
  Json& parts_of(const std::string& folder) {
    const auto found = folders_.find(folder);
    if (found != folders_.end()) return found->second;
    if (!folder.empty()) {
      const std::size_t slash = folder.rfind('/');
      parts_of(slash == std::string::npos ? "" : folder.substr(0, slash))
          .push_back(reference(uri_of(folder) + "/"));
    }
    return folders_.emplace(folder, Json::array()).first->second;
  }

  void put_files(Json& root) {
    for (const CrateFile& file : facts_.files) {
      const std::size_t slash = file.name.rfind('/');
      parts_of(slash == std::string::npos ? "" : file.name.substr(0, slash))
          .push_back(reference(uri_of(file.name)));
      Json entity = {{"@id", uri_of(file.name)},
                     {"@type", "File"},
                     {"name", file.name},
                     {"encodingFormat", format_of(file.name)}};
      if (!file.sha256.empty()) {
        entity["contentSize"] = std::to_string(file.bytes);
        entity["sha256"] = file.sha256;
      }
      if (!file.description.empty()) entity["description"] = file.description;
      graph_.push_back(std::move(entity));
    }
    for (const auto& [folder, parts] : folders_) {
      if (folder.empty()) {
        root["hasPart"] = parts;
      } else {
        graph_.push_back({{"@id", uri_of(folder) + "/"},
                          {"@type", "Dataset"},
                          {"name", folder},
                          {"hasPart", parts}});
      }
    }
  }

  void put_actions(Json& root) {
    graph_.push_back({{"@id", "#palpate"},
                      {"@type", "SoftwareApplication"},
                      {"name", "palpate"},
                      {"description", "A psychophysics experiment runner for touch."},
                      {"softwareVersion", facts_.program_version}});
    for (const CrateFacts::Action& action : facts_.actions) {
      Json sources = Json::array(), results = Json::array();
      for (const std::string& name : action.sources) sources.push_back(reference(uri_of(name)));
      for (const std::string& name : action.results) results.push_back(reference(uri_of(name)));
      graph_.push_back({{"@id", action.id},
                        {"@type", "CreateAction"},
                        {"name", action.name},
                        {"instrument", reference("#palpate")},
                        {"object", sources},
                        {"result", results}});
      root["mentions"].push_back(reference(action.id));
    }
  }

  const CrateFacts& facts_;
  Json graph_ = Json::array();
  std::map<std::string, std::string> organizations_;  ///< name -> id
  std::map<std::string, Json> folders_;               ///< name -> its parts
};

}  // namespace

std::string ro_crate_json(const CrateFacts& facts) { return Crate(facts).text(); }

}  // namespace palpate::runner::registration
