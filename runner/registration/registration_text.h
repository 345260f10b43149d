#pragma once
// The text of a registration: the questions of OSF Preregistration, version 3, that the protocol,
// the plan and the hypotheses answer. Questions that only the lab can answer stay open.

#include "runner/registration/form.h"
#include "runner/registration/registration.h"

namespace palpate::runner::registration {

/// registration.md and osf.json (the answers by question id) with their fields.
Form registration_form(const Registration& registration);

}  // namespace palpate::runner::registration
