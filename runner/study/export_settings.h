#pragma once
// Facts for exports that data/ does not know: protocols, meanings of fault bits, the version.

#include "data/export/settings.h"

namespace palpate::runner::study {

/// Settings with these facts; the rest are defaults.
data::ExportSettings export_settings();

}  // namespace palpate::runner::study
