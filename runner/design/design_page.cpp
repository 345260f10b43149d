#include "runner/design/design_page.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <string_view>
#include <utility>

#include "data/base/base64.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "protocols/parse.h"
#include "runner/design/beside.h"
#include "runner/design/page_assets.h"
#include "runner/design/pictures.h"
#include "runner/design/study_data.h"
#include "runner/serve/loopback.h"
#include "runner/usage_error.h"

namespace palpate::runner::design {
namespace {

using Json = nlohmann::ordered_json;
using serve::PageAnswer;

constexpr int kMostParticipants = 40, kMostNumber = 1'000'000, kMostRecovered = 10'000;

PageAnswer plain(unsigned status, const std::string& text) {
  return {status, "text/plain; charset=utf-8", text + "\n"};
}

PageAnswer as_answer(const Json& json, unsigned status = 200) {
  return {status, "application/json", json.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

std::string text_in(const nlohmann::json& values, const char* key) {
  const auto found = values.find(key);
  if (found == values.end() || !found->is_string())
    throw UsageError(std::string(key) + ": expected a text");
  return *found;
}

/// \throws UsageError
std::string bytes_in(const nlohmann::json& values) {
  std::optional<std::string> bytes = base64_decoded(text_in(values, "bytes"));
  if (!bytes) throw UsageError("bytes: expected base64");
  return std::move(*bytes);
}

int number_in(const nlohmann::json& values, const char* key, int usual, int most) {
  const auto found = values.find(key);
  if (found == values.end()) return usual;
  if (!found->is_number_integer() || *found < 1 || *found > most)
    throw UsageError(std::string(key) + ": expected a whole number from 1 to " +
                     std::to_string(most));
  return *found;
}

Json templates() {
  Json out = Json::array();
  for (const Asset& asset : template_assets()) {
    const Json protocol = read_ordered_json(asset.text);
    out.push_back({{"name", protocol.value("name", "")},
                   {"title", protocol.value("title", "")},
                   {"description", protocol.value("description", "")},
                   {"text", asset.text}});
  }
  return out;
}

Json opened(const ProtocolFile& file) {
  Json out{{"name", file.name()}, {"path", printable(file.path())}, {"program", PALPATE_VERSION}};
  const std::optional<FileState> found = file.read();
  out["exists"] = found.has_value();
  out["text"] = found ? found->text : "";
  out["sha256"] = found ? found->sha256 : "";
  if (!found) out["templates"] = templates();
  return out;
}

Json translation_of(const ProtocolFile& file, const std::string& language) {
  const std::optional<FileState> found = read_state(translation_path(file, language));
  return {{"text", found ? found->text : ""}, {"sha256", found ? found->sha256 : ""}};
}

}  // namespace

std::string_view text_of_asset(std::span<const Asset> assets, std::string_view name) {
  for (const Asset& asset : assets) {
    if (asset.name == name) return asset.text;
  }
  return "";
}

DesignPage::DesignPage(const ProtocolFile& file, const TemporaryFolder& folder,
                       std::vector<std::string> databases)
    : file_(file),
      folder_(folder),
      databases_(std::move(databases)),
      rehearsal_(folder),
      uploads_(folder.path()) {}

bool DesignPage::is_slow(const std::string& target) {
  return target == "/check" || target == "/picture" || target == "/schedule" || target == "/data" ||
         target == "/recover";
}

PageAnswer DesignPage::get(const std::string& target) {
  constexpr std::string_view kReport = "/report/";
  if (target == "/") return page();
  if (target.starts_with(kReport)) return report(target.substr(kReport.size()));
  const std::string_view text = text_of_asset(page_assets(), target.substr(1));
  if (text.empty()) return plain(404, "there is no such page");
  const char* const type = target.ends_with(".js")    ? "text/javascript; charset=utf-8"
                           : target.ends_with(".css") ? "text/css; charset=utf-8"
                                                      : "application/json";
  return {200, type, std::string(text), {{"Cross-Origin-Resource-Policy", "same-origin"}}};
}

PageAnswer DesignPage::page() const {
  serve::GuardedPage page =
      serve::guarded_page(std::string(text_of_asset(page_assets(), "design.html")), "'self'");
  return {200, "text/html; charset=utf-8", std::move(page.html), std::move(page.headers)};
}

PageAnswer DesignPage::report(const std::string& key) {
  std::optional<std::string> html = rehearsal_.report(key);
  if (!html) return plain(404, "this report is no longer kept; rehearse again");
  // It has a policy of its own; in a sandbox it is of no origin, so that it reaches no server.
  return {200,
          "text/html; charset=utf-8",
          std::move(*html),
          {{"Content-Security-Policy", "sandbox allow-scripts allow-downloads"},
           {"Referrer-Policy", "no-referrer"}}};
}

PageAnswer DesignPage::post(const std::string& target, const std::string& body) {
  const nlohmann::json values = json_or_discarded(body);
  if (!values.is_object()) return as_answer({{"error", "expected a JSON object"}}, 400);
  try {
    Json out = answer(target.substr(1), values);
    return out.is_null() ? plain(404, "there is no such message") : as_answer(out);
  } catch (const NotSaved& error) {
    Json out{{"error", error.what()}};
    if (error.found())
      out["found"] = {{"text", error.found()->text}, {"sha256", error.found()->sha256}};
    return as_answer(out, 409);
  } catch (const std::exception& error) {  // UsageError, InputError, MeshError
    return as_answer({{"error", error.what()}}, 409);
  }
}

Json DesignPage::answer(const std::string& message, const nlohmann::json& values) {
  if (message == "open") return opened(file_);
  if (message == "progress") return rehearsal_.progress();
  if (message == "upload") return {{"upload", uploads_.begin()}};
  if (message == "part")
    return {{"bytes", uploads_.add(text_in(values, "upload"), bytes_in(values))}};
  if (message == "mesh")
    return add_mesh(
        file_, folder_.path(), text_in(values, "name"),
        values.contains("upload") ? uploads_.take(text_in(values, "upload")) : bytes_in(values));
  if (message == "languages") return {{"languages", languages_of(file_)}};
  if (message == "translation") return translation_of(file_, text_in(values, "language"));
  if (message == "stop") {
    rehearsal_.stop();
    return rehearsal_.progress();
  }
  const std::string text = text_in(values, "text"), &path = file_.path();
  if (message == "check") return check_answer(text, path, shapes_);
  if (message == "data") return {{"data", study_data(text, file_, databases_)}};
  if (message == "recover")
    return recover_answer(text, path, text_in(values, "block"),
                          number_in(values, "participants", 200, kMostRecovered));
  if (message == "picture") return picture_answer(text, path);
  if (message == "schedule")
    return schedule_answer(text, path, number_in(values, "participant", 1, kMostNumber));
  if (message == "rehearse") {
    rehearsal_.start(
        text, path,
        {.participants = number_in(values, "participants", 2, kMostParticipants),
         .seed = static_cast<std::uint64_t>(number_in(values, "seed", 1, kMostNumber))});
    return rehearsal_.progress();
  }
  if (message == "texts") return texts_answer(text, file_);
  if (message == "check_translation")
    return check_translation(text, file_, text_in(values, "language"),
                             text_in(values, "translation"));
  if (message == "save_translation")
    return {{"sha256", save_state(translation_path(file_, text_in(values, "language")), text,
                                  text_in(values, "sha256"))}};
  if (message == "save") return {{"sha256", file_.save(text, text_in(values, "sha256"))}};
  if (message == "copy") return {{"name", file_.save_copy(text)}};
  return nullptr;
}

}  // namespace palpate::runner::design
