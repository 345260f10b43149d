#pragma once
// What exports need that data/ does not know: protocols, meanings of fault bits, the version.

#include "data/export/settings.h"

namespace palpate::runner {

/// With all of that; the rest as by default.
data::ExportSettings export_settings();

}  // namespace palpate::runner
