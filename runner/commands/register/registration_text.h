#pragma once
// The text of a registration: the questions of OSF Preregistration, version 3, that the protocol,
// the plan and the hypotheses answer. Questions that only the lab can answer stay open.

#include "runner/commands/register/form.h"
#include "runner/commands/register/registration.h"

namespace palpate::runner::commands {

/// registration.md and osf.json (the answers by question id) with their fields.
Form registration_form(const Registration& registration);

}  // namespace palpate::runner::commands
