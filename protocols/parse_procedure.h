#pragma once

#include <optional>

#include "protocols/object_reader.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// Reads {"kind": "staircase", ...}; the keys stand in README.md. nullopt where something is at
/// fault. Unknown keys become faults.
std::optional<ProcedureSpec> read_procedure(ObjectReader& reader);

}  // namespace palpate::protocols
