#include <pwd.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string_view>
#include <thread>

#include "runner/commands/devices/devices.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::commands {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kShown = 2;  // letters of a serial number
constexpr std::string_view kCut = "...";

std::string shortened(const std::string& serial) {
  return std::string(kCut) +
         (serial.size() > 2 * kShown ? serial.substr(serial.size() - kShown) : std::string());
}

void replace_all(std::string& text, const std::string& what, const std::string& by) {
  if (what.empty()) return;
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
}

bool ends_path(char letter) {
  return std::isspace(static_cast<unsigned char>(letter)) != 0 ||
         std::string_view("'\",;:()").find(letter) != std::string_view::npos;
}

/// /home/anna/lib/libdrd.so becomes .../libdrd.so.
std::string with_short_paths(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const bool begins = text[at] == '/' && (at == 0 || ends_path(text[at - 1]));
    std::size_t end = at + 1;
    if (!begins) {
      out += text[at];
    } else {
      while (end < text.size() && !ends_path(text[end])) ++end;
      const std::string path = text.substr(at, end - at);
      const std::size_t name = path.rfind('/');
      out += name == 0 ? path : std::string(kCut) + path.substr(name);
    }
    at = end;
  }
  return out;
}

void collect_serials(const Json& value, std::vector<std::string>& out) {
  if (value.is_object()) {
    const auto serial = value.find("serial");
    if (serial != value.end() && serial->is_string()) {
      std::string rest = serial->get<std::string>();  // of two: "A, B"
      for (std::size_t comma = rest.find(", "); comma != std::string::npos;
           comma = rest.find(", ")) {
        out.push_back(rest.substr(0, comma));
        rest.erase(0, comma + 2);
      }
      out.push_back(rest);
    }
  }
  if (value.is_structured())
    for (const Json& member : value) collect_serials(member, out);
}

std::vector<std::string> private_names() {
  std::vector<std::string> out;
  utsname kernel{};
  if (uname(&kernel) == 0) out.emplace_back(kernel.nodename);
  if (const passwd* const user = getpwuid(getuid())) {
    if (user->pw_dir != nullptr && std::string_view(user->pw_dir) != "/")
      out.emplace_back(user->pw_dir);
    if (user->pw_name != nullptr) out.emplace_back(user->pw_name);
  }
  return out;
}

void clean(Json& value, const std::vector<std::string>& serials,
           const std::vector<std::string>& names) {
  if (value.is_structured()) {
    for (Json& member : value) clean(member, serials, names);
  } else if (value.is_string()) {
    std::string text = value.get<std::string>();
    for (const std::string& serial : serials) replace_all(text, serial, shortened(serial));
    text = with_short_paths(text);
    // A short name such as root is part of ordinary words.
    constexpr std::size_t kLongEnough = 5;
    for (const std::string& name : names)
      if (name.size() >= kLongEnough) replace_all(text, name, std::string(kCut));
    value = text;
  }
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "";
}

}  // namespace

Json machine_facts() {
  utsname kernel{};
  uname(&kernel);
  servo::RealtimeRights rights;
  // In a thread of its own, which alone gets the priority.
  std::thread([&rights] { rights = servo::request_realtime({}); }).join();
  return {{"system", kernel.sysname},
          {"kernel", kernel.release},
          {"architecture", kernel.machine},
          {"processor", processor()},
          {"processors", std::thread::hardware_concurrency()},
          {"rights",
           {{"fifo", rights.fifo},
            {"locked_memory", rights.locked_memory},
            {"awake", rights.awake},
            {"missing", rights.missing}}}};
}

Json without_personal_data(Json findings, std::vector<std::string> serials) {
  collect_serials(findings, serials);
  std::erase_if(serials, [](const std::string& one) { return one.empty(); });
  // Longer ones first: one may be a part of another.
  std::ranges::sort(serials, [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() > b.size() : a < b;
  });
  serials.erase(std::unique(serials.begin(), serials.end()), serials.end());
  clean(findings, serials, private_names());
  return findings;
}

}  // namespace palpate::runner::commands
