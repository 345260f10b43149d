#include "protocols/tasks/task_block.h"

#include <array>
#include <cstddef>

namespace palpate::protocols {

const char* to_string(TaskKind kind) {
  constexpr std::array kNames = {"identify", "compare", "detect", "rate", "adjust", "external"};
  return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace palpate::protocols
