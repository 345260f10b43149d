#include "stimuli/mesh_names.h"

#include <algorithm>
#include <cstdio>

#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {

MeshNames MeshNames::subset(const std::vector<std::uint32_t>& some_vertices,
                            const std::vector<std::uint32_t>& some_faces) const {
  MeshNames some{{}, {}, place_kind, places};
  if (!vertices.empty()) {
    for (const std::uint32_t v : some_vertices) some.vertices.push_back(vertices[v]);
  }
  if (!faces.empty()) {
    for (const std::uint32_t f : some_faces) some.faces.push_back(faces[f]);
  }
  return some;
}

std::string MeshNaming::place_of(const MeshNames::Name& name) const {
  if (names_->places.empty() && names_->place_kind.empty()) return "";
  if (!names_->places.empty()) return " of " + names_->places[name.place];
  return " at " + names_->place_kind + " " + std::to_string(name.place);
}

std::string MeshNaming::label(std::uint32_t vertex, const Vec3& place) const {
  if (!names_) return std::to_string(vertex);
  if (vertex < names_->vertices.size()) return std::to_string(names_->vertices[vertex].number);
  char text[80];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g)", place.x, place.y, place.z);
  return text;
}

std::string MeshNaming::vertex(std::uint32_t vertex, const Vec3& place) const {
  const bool placed = names_ && vertex < names_->vertices.size();
  return "vertex " + label(vertex, place) + (placed ? place_of(names_->vertices[vertex]) : "");
}

std::string MeshNaming::face(std::uint32_t face,
                             const std::vector<std::string>& corner_labels) const {
  constexpr std::size_t kShown = 8;
  std::string text = "face";
  if (!names_) {
    text += " " + std::to_string(face);
  } else if (face < names_->faces.size()) {
    const MeshNames::Name& name = names_->faces[face];
    text += " " + std::to_string(name.number) + place_of(name);
  }
  text += " (vertices";
  for (std::size_t i = 0; i < std::min(corner_labels.size(), kShown); ++i)
    text += " " + corner_labels[i];
  return text + (corner_labels.size() > kShown ? " ...)" : ")");
}

namespace {

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    if (!text.empty()) text += '\n';
    text += line;
  }
  return text;
}

}  // namespace

MeshError::MeshError(std::vector<std::string> faults)
    : std::runtime_error(joined(faults)), faults_(std::move(faults)) {}

MeshFaults::Kind& MeshFaults::entry_of(const char* kind) {
  for (Kind& entry : kinds_) {
    if (entry.name == kind) return entry;
  }
  kinds_.push_back({kind, 0, {}});
  return kinds_.back();
}

std::vector<std::string> MeshFaults::messages() const {
  std::vector<std::string> all;
  for (const Kind& kind : kinds_) {
    all.insert(all.end(), kind.messages.begin(), kind.messages.end());
    if (kind.count > kShown) {
      all.push_back(kind.name + ": " + std::to_string(kind.count - kShown) + " more");
    }
  }
  return all;
}

void MeshFaults::throw_if_any() const {
  if (!empty()) throw MeshError(messages());
}

}  // namespace palpate::stimuli
