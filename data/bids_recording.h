#pragma once
// Internal to data/: servo samples as a BIDS recording.

#include <nlohmann/json.hpp>
#include <vector>

#include "data/store.h"
#include "data/text_sink.h"

namespace palpate {

/// The sidecar of a trial's recording. \param servo_rate Hz. \throws StoreRefused: ticks that do
/// not increase, or that leave out more than any trial could: the samples are damaged.
nlohmann::ordered_json describe_recording(const StoredTrial& trial, double servo_rate);

/// Gzipped rows without a header, one a tick from the first to the last: BIDS recordings have no
/// gaps, so ticks that were not recorded are rows of n/a. For samples that describe_recording took.
void write_recording(const std::vector<SampleRecord>& samples, TextSink& out);

}  // namespace palpate
