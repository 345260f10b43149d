#include "protocols/protocol.h"

#include <array>
#include <cstddef>

namespace palpate::protocols {

const char* to_string(TaskKind kind) {
  constexpr std::array kNames = {"identify", "compare", "detect", "rate", "adjust", "external"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* to_string(RendererKind kind) { return kind == RendererKind::point ? "point" : "ray"; }
const char* to_string(NoiseKind kind) { return kind == NoiseKind::white ? "white" : "pink"; }

const std::string& answer_label(const Protocol& protocol, const std::string& stimulus) {
  const auto label = protocol.response.labels.find(stimulus);
  return label != protocol.response.labels.end() ? label->second : stimulus;
}

}  // namespace palpate::protocols
