#pragma once
// Internal to data/store: a trial's task as the database keeps it, one line of JSON. Keys that have
// no value are left out.

#include <string>

#include "data/record.h"

namespace palpate::data {

std::string task_text(const TaskRecord& task);
/// The inverse. \throws std::invalid_argument: damaged
TaskRecord parse_task_text(const std::string& text);

}  // namespace palpate::data
