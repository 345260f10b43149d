#include "protocols/protocol.h"

namespace palpate {

const char* to_string(RendererKind kind) { return kind == RendererKind::point ? "point" : "ray"; }
const char* to_string(NoiseKind kind) { return kind == NoiseKind::white ? "white" : "pink"; }

}  // namespace palpate
