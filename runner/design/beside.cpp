#include "runner/design/beside.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <limits>
#include <string_view>
#include <system_error>
#include <vector>

#include "data/base/text.h"
#include "protocols/parse.h"
#include "protocols/tasks/texts.h"
#include "runner/scene_builder.h"
#include "runner/station/protocol_check.h"
#include "runner/touch/scene_notes.h"
#include "runner/usage_error.h"
#include "stimuli/mesh_file.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::runner::design {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

bool is_letter_or_digit(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// A file name without folders and without characters that mean something to a shell.
std::string plain_name(const std::string& name) {
  const std::size_t slash = name.find_last_of("/\\");
  std::string out;
  for (const char c : name.substr(slash == std::string::npos ? 0 : slash + 1))
    out += is_letter_or_digit(c) || c == '-' || c == '_' || c == '.' ? c : '-';
  out.erase(0, out.find_first_not_of(".-"));
  constexpr std::size_t kLongest = 100;
  if (out.size() > kLongest) out.erase(0, out.size() - kLongest);
  return out;
}

/// "de", "pt-BR", "zh-Hant"
bool is_language(const std::string& code) {
  const std::size_t head = std::min(code.find('-'), code.size());
  return head >= 2 && head <= 3 && code.size() <= 20 && code.back() != '-' &&
         std::ranges::all_of(code, [](char c) { return is_letter_or_digit(c) || c == '-'; });
}

Vec3 solid_size(const stimuli::ObjectSpec& object) {
  const stimuli::SolidMesh solid = stimuli::solid_of_file(object);
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const Vec3& node : solid.nodes) {
    low = glm::min(low, node);
    high = glm::max(high, node);
  }
  return high - low;
}

/// Multiplies coordinates of this largest extent so that a hand can hold the object: 1 for metres,
/// 0.001 for millimetres, 0.0254 for inches. \param largest  in the file's unit
double proposed_scale(double largest) {
  constexpr double kLeast = 0.005, kMost = 0.3;  // m, in a hand's reach
  for (const double scale : {1.0, 0.001, 0.0254, 0.01}) {
    if (largest * scale >= kLeast && largest * scale <= kMost) return scale;
  }
  constexpr double kHandy = 0.06;  // m
  if (!(largest > 0) || !std::isfinite(largest)) return 1;
  return std::pow(10, std::floor(std::log10(kHandy / largest)));
}

}  // namespace

Json add_mesh(const ProtocolFile& file, const std::string& folder, const std::string& name,
              const std::string& bytes) {
  const std::string plain = plain_name(name);
  const bool is_solid = stimuli::is_gmsh_file_name(plain);
  if (!stimuli::is_mesh_file_name(plain) && !is_solid)
    throw UsageError(printable(name) + ": expected a mesh, " + stimuli::kMeshExtensions +
                     ", or a solid, .msh");
  const std::string draft = folder + "/" + plain;
  std::ofstream(draft, std::ios::binary) << bytes;
  const protocols::SceneSpec scene = protocols::parse_scene(draft);
  stimuli::ObjectSpec object = scene.objects.front();
  const Vec3 size = is_solid ? solid_size(object) : SceneBuilder().mesh(object).size;
  const double largest = std::max({size.x, size.y, size.z});
  const double scale = stimuli::has_unit(plain) ? 1 : proposed_scale(largest);
  object.scale = scale;
  SceneBuilder scaled;
  const std::vector<std::string> notes = touch::mesh_notes(object, scaled);
  std::error_code ignored;
  fs::remove(draft, ignored);
  const std::string kept = save_beside(file.folder() + "/" + plain, bytes);
  Json out{{"file", kept},
           {"scale", scale},
           {"size_m", {scale * size.x, scale * size.y, scale * size.z}},
           {"notes", notes}};
  if (is_solid) out["soft"] = {{"young_pa", object.soft->young}};
  return out;
}

std::vector<std::string> languages_of(const ProtocolFile& file) {
  const std::string begin = fs::path(file.path()).stem().string() + ".texts.", end = ".json";
  std::vector<std::string> languages;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(file.folder(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= begin.size() + end.size() || !name.starts_with(begin) ||
        !name.ends_with(end))
      continue;
    const std::string language = name.substr(begin.size(), name.size() - begin.size() - end.size());
    if (is_language(language)) languages.push_back(language);
  }
  std::ranges::sort(languages);
  return languages;
}

Json texts_answer(const std::string& text, const ProtocolFile& file) {
  Json out{{"texts", Json::array()}, {"languages", languages_of(file)}};
  for (const auto& [key, original] :
       protocols::texts_of(protocols::parse_protocol_text(text, file.path())))
    out["texts"].push_back({key, original});
  return out;
}

std::string translation_path(const ProtocolFile& file, const std::string& language) {
  if (!is_language(language))
    throw UsageError("expected a language such as de or pt-BR, found '" + printable(language) +
                     "'");
  return file.folder() + "/" + fs::path(file.path()).stem().string() + ".texts." + language +
         ".json";
}

Json check_translation(const std::string& text, const ProtocolFile& file,
                       const std::string& language, const std::string& translation) {
  const std::string path = translation_path(file, language);
  protocols::Protocol protocol = protocols::parse_protocol_text(text, file.path());
  try {
    protocols::translate(protocol, language, translation, path);
  } catch (const protocols::InputError& error) {
    return station::faults_json(path, error.faults());
  }
  return station::faults_json(path, {});
}

}  // namespace palpate::runner::design
