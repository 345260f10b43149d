#include "runner/registration/form.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "data/base/json_text.h"
#include "data/base/text.h"
#include "protocols/json_document.h"

namespace palpate::runner::registration {
namespace {

using Json = nlohmann::ordered_json;
using protocols::child_pointer;
using protocols::FaultList;

constexpr char kBegin = '\x02', kEnd = '\x03';
constexpr std::size_t kMostText = 4'000'000, kMostPieces = 1'000, kMostAnswers = 100, kMostId = 40;

Json json_of(const FormText& text) {
  Json out = Json::array();
  for (const FormPiece& piece : text)
    out.push_back(piece.field ? Json{{"fill_in", piece.text}} : Json(piece.text));
  return out;
}

FormText read_pieces(const nlohmann::json& value, const std::string& place, FaultList& faults) {
  FormText out;
  if (!value.is_array() || value.size() > kMostPieces) {
    faults.add(place, "expected a list of at most " + std::to_string(kMostPieces) +
                          " texts and fields" + protocols::found_text(value));
    return out;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string pointer = child_pointer(place, i);
    FormPiece piece;
    piece.field = value[i].is_object();
    if (piece.field) {
      protocols::ObjectReader reader(value[i], pointer, faults);
      reader.text("fill_in", piece.text, kMostText);
      reader.refuse_unknown_keys();
    } else {
      protocols::read_text(value[i], pointer, piece.text, kMostText, faults);
    }
    out.push_back(std::move(piece));
  }
  return out;
}

FormAnswer read_answer(const nlohmann::json& value, const std::string& place, FaultList& faults) {
  protocols::ObjectReader reader(value, place, faults);
  FormAnswer out;
  reader.text("id", out.id, kMostId);
  if (const nlohmann::json* const text = reader.member("text"))
    out.text = read_pieces(*text, reader.pointer("text"), faults);
  const nlohmann::json* const chosen = reader.array("chosen", 1, kMostAnswers);
  for (std::size_t i = 0; chosen != nullptr && i < chosen->size(); ++i)
    protocols::read_text((*chosen)[i], child_pointer(reader.pointer("chosen"), i),
                         out.chosen.emplace_back(), kMostText, faults);
  if (reader.has("text") == reader.has("chosen"))
    faults.add(place, "expected either text or chosen" + protocols::found_text(value));
  reader.refuse_unknown_keys();
  return out;
}

std::string with_digest(std::string text, const std::string& digest) {
  for (std::size_t at = text.find(kDigestMark); at != text.npos;
       at = text.find(kDigestMark, at + kDigestMark.size()))
    text.replace(at, kDigestMark.size(), digest);
  return text;
}

std::string as_made(const FormText& text, const std::string& digest) {
  std::string out;
  for (const FormPiece& piece : text)
    out += piece.field ? piece.text : with_digest(piece.text, digest);
  return out;
}

/// Without the space before ends of lines, which editors change by themselves.
std::string plain_lines(std::string_view text) {
  std::string out;
  std::size_t space = 0;
  for (const char c : text) {
    if (c == '\n') out.erase(out.size() - space);
    out += c;
    space = c == ' ' || c == '\t' || c == '\r' ? space + 1 : 0;
  }
  return out;
}

void cut_end(std::string& text) { text.erase(text.find_last_not_of(" \t\r\n") + 1); }

/// Fixed text between two fields, without the empty lines beside them.
struct FixedPart {
  std::string text;
  bool after_field = false;
};

/// One more than there are fields.
std::vector<FixedPart> fixed_parts(const FormText& form, const std::string& digest) {
  std::vector<FixedPart> out(1);
  for (const FormPiece& piece : form) {
    if (piece.field) {
      cut_end(out.back().text);
      out.push_back({"", true});
    } else {
      out.back().text += plain_lines(with_digest(piece.text, digest));
    }
  }
  for (FixedPart& part : out) {
    if (part.after_field)
      part.text.erase(0, std::min(part.text.find_first_not_of('\n'), part.text.size()));
  }
  cut_end(out.back().text);
  return out;
}

/// Where the part follows, at the beginning of a line; npos: nowhere.
std::size_t place_of(const FixedPart& part, bool last, const std::string& text, std::size_t from) {
  if (!part.after_field) return text.starts_with(part.text) ? 0 : text.npos;
  if (last && part.text.empty()) return text.size();
  const auto begins_line = [&](std::size_t at) { return at == 0 || text[at - 1] == '\n'; };
  if (last) {
    const bool ends = text.size() >= from + part.text.size() && text.ends_with(part.text);
    return ends && begins_line(text.size() - part.text.size()) ? text.size() - part.text.size()
                                                               : text.npos;
  }
  std::size_t at = text.find(part.text, from);
  while (at != text.npos && !part.text.empty() && !begins_line(at))
    at = text.find(part.text, at + 1);
  return at;
}

/// The first line of a part that does not follow at or behind `from`.
std::string first_missing_line(const std::string& text, std::size_t from,
                               const std::string& piece) {
  std::size_t begin = 0;
  while (begin < piece.size()) {
    const std::size_t end = std::min(piece.find('\n', begin), piece.size() - 1) + 1;
    if (text.find(piece.substr(0, end), from) == text.npos) {
      std::string line = piece.substr(begin, end - begin);
      if (line.ends_with('\n')) line.pop_back();
      return line;
    }
    begin = end;
  }
  return piece;
}

/// Why a filled-in text would change how the rest is shown; "": it does not.
std::string hidden_by(const std::string& text) {
  for (std::size_t at = text.find('<'); at != text.npos; at = text.find('<', at + 1)) {
    const char next = at + 1 < text.size() ? text[at + 1] : ' ';
    const bool letter = (next >= 'a' && next <= 'z') || (next >= 'A' && next <= 'Z');
    if (letter || next == '!' || next == '/' || next == '?') return "HTML";
  }
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = std::string_view(text).substr(begin, end - begin);
    line.remove_prefix(std::min(line.find_first_not_of(" \t>"), line.size()));
    if (line.starts_with("```") || line.starts_with("~~~")) return "a fence of code";
    if (line.starts_with("#")) return "a heading";
    begin = end + 1;
  }
  return "";
}

std::vector<std::string> changes_of(const FormText& form, const std::string& digest,
                                    const std::string& given, const std::string& place,
                                    bool is_markdown) {
  std::string text = plain_lines(given);
  cut_end(text);
  const std::vector<FixedPart> parts = fixed_parts(form, digest);
  std::size_t at = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool last = i + 1 == parts.size();
    const std::size_t found = place_of(parts[i], last, text, at);
    if (found == text.npos)
      return {place + ": expected the line '" +
              printable(first_missing_line(text, at, parts[i].text), 300) + "'"};
    const std::string filled = text.substr(at, found - at);
    if (i > 0 && !parts[i - 1].text.empty() && !filled.empty() && filled.front() != '\n')
      return {place + ": expected an answer on a line of its own, found '" +
              printable(filled, 100) + "'"};
    if (const std::string what = is_markdown ? hidden_by(filled) : ""; !what.empty())
      return {place + ": expected plain text in a field, found " + what + " in '" +
              printable(filled, 100) + "'"};
    at = found + parts[i].text.size();
  }
  if (at != text.size())
    return {place + ": expected nothing behind the fixed text, found '" +
            printable(text.substr(at), 100) + "'"};
  return {};
}

}  // namespace

std::string as_field(const std::string& text) { return kBegin + text + kEnd; }

FormText form_text(std::string_view marked) {
  FormText out;
  while (!marked.empty()) {
    const bool field = marked.front() == kBegin;
    const std::size_t end = marked.find(field ? kEnd : kBegin);
    const std::size_t begin = field ? 1 : 0;
    out.push_back({std::string(marked.substr(begin, end - begin)), field});
    marked.remove_prefix(std::min(end == marked.npos ? end : end + begin, marked.size()));
  }
  return out;
}

std::string form_json(const Form& form) {
  Json out = {{"version", 1}, {"registration.md", json_of(form.markdown)}};
  for (const FormAnswer& answer : form.osf) {
    Json& one = out["osf.json"].emplace_back();
    one["id"] = answer.id;
    if (answer.chosen.empty()) {
      one["text"] = json_of(answer.text);
    } else {
      one["chosen"] = answer.chosen;
    }
  }
  return out.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Form read_form(const std::string& text, const std::string& file) {
  FaultList faults(file);
  const nlohmann::json json = protocols::read_json(text, faults);
  protocols::ObjectReader reader(json, "", faults);
  int version = 1;
  reader.integer("version", version, {1, 1}, protocols::Presence::required);
  Form out;
  if (const auto* markdown = reader.member("registration.md", protocols::Presence::required))
    out.markdown = read_pieces(*markdown, reader.pointer("registration.md"), faults);
  if (const auto* osf = reader.array("osf.json", 1, kMostAnswers, protocols::Presence::required)) {
    for (std::size_t i = 0; i < osf->size(); ++i)
      out.osf.push_back(read_answer((*osf)[i], child_pointer("/osf.json", i), faults));
  }
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return out;
}

std::string markdown_as_made(const Form& form, const std::string& digest) {
  return as_made(form.markdown, digest);
}

std::string osf_as_made(const Form& form, const std::string& digest) {
  Json out;
  for (const FormAnswer& answer : form.osf)
    out[answer.id] =
        answer.chosen.empty() ? Json(as_made(answer.text, digest)) : Json(answer.chosen);
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<std::string> markdown_changes(const Form& form, const std::string& digest,
                                          const std::string& text) {
  return changes_of(form.markdown, digest, text, "registration.md", true);
}

std::vector<std::string> osf_changes(const Form& form, const std::string& digest,
                                     const std::string& text) {
  std::vector<std::string> out;
  FaultList faults("osf.json");
  nlohmann::json found;
  try {
    found = protocols::read_json(text, faults);
    faults.throw_if_any();
  } catch (const protocols::InputError& error) {
    return {error.what()};
  }
  if (!found.is_object())
    return {"osf.json: expected an object with the answers" + protocols::found_text(found)};
  std::set<std::string> known;
  for (const FormAnswer& answer : form.osf) {
    const std::string place = "osf.json: /" + answer.id;
    known.insert(answer.id);
    const auto at = found.find(answer.id);
    if (at == found.end()) {
      out.push_back(place + ": missing");
    } else if (!answer.chosen.empty()) {
      if (*at != nlohmann::json(answer.chosen))
        out.push_back(place + ": expected " + json_excerpt(nlohmann::json(answer.chosen)) +
                      protocols::found_text(*at));
    } else if (!at->is_string()) {
      out.push_back(place + ": expected a text" + protocols::found_text(*at));
    } else {
      for (std::string& line :
           changes_of(answer.text, digest, at->get<std::string>(), place, false))
        out.push_back(std::move(line));
    }
  }
  for (const auto& [id, value] : found.items()) {
    if (!known.contains(id)) out.push_back("osf.json: /" + printable(id, 60) + ": not in the form");
  }
  return out;
}

}  // namespace palpate::runner::registration
