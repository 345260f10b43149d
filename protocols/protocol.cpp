#include "protocols/protocol.h"

namespace palpate {

const char* to_string(RendererKind kind) { return kind == RendererKind::point ? "point" : "ray"; }

}  // namespace palpate
