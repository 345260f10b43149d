#include "runner/commands/render/trajectory_csv.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "analysis/input/csv_reader.h"
#include "protocols/parse.h"

namespace palpate::runner {
namespace {

constexpr std::size_t kFaultsShown = 20;
constexpr const char* kForceHeader =
    "t,force_x,force_y,force_z,torque_x,torque_y,torque_z,ideal_tip_x,ideal_tip_y,ideal_tip_z,"
    "ideal_tail_x,ideal_tail_y,ideal_tail_z,contact_x,contact_y,contact_z,device1_x,device1_y,"
    "device1_z,"
    "device2_x,device2_y,device2_z,depth,contacts,contact_type,object,";
constexpr const char* kToolHeader = "segment,ideal_side_x,ideal_side_y,ideal_side_z,";

analysis::CsvReader open(const std::string& path) {
  try {
    return analysis::CsvReader(path);
  } catch (const std::runtime_error& error) {
    throw protocols::InputError(
        {{path, "(file)", std::string("expected a readable file: ") + error.what()}});
  }
}

std::string joined(const std::vector<std::string_view>& fields) {
  std::string line;
  for (const std::string_view field : fields) {
    if (!line.empty()) line += ',';
    line += field;
  }
  return line;
}

constexpr std::size_t kPoseColumns = 7, kSideColumns = 3;

/// The numbers of a row, zero beyond the first `count`. Empty where it holds anything else.
std::optional<std::array<double, kPoseColumns + kSideColumns>> numbers_of(
    const std::vector<std::string_view>& fields, std::size_t count) {
  std::array<double, kPoseColumns + kSideColumns> out{};
  if (fields.size() != count) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    const char* const end = fields[i].data() + fields[i].size();
    const auto [stop, error] = std::from_chars(fields[i].data(), end, out[i]);
    if (error != std::errc{} || stop != end) return std::nullopt;
  }
  return out;
}

void append(std::string& out, double value) {
  char text[40];
  out.append(text, static_cast<std::size_t>(std::snprintf(text, sizeof text, "%.17g", value)));
}

void append(std::string& out, const Vec3& v) {
  for (int k = 0; k < 3; ++k) {
    out += ',';
    append(out, v[k]);
  }
}

/// "non-finite+started-inside".
std::string names_of(std::uint32_t faults) {
  std::string names;
  for (const rendering::FaultBit& fault : rendering::kRenderFaults) {
    if ((faults & fault.bit) != 0) (names += names.empty() ? "" : "+") += fault.name;
  }
  return names;
}

}  // namespace

std::vector<TimedPose> read_trajectory(const std::string& path) {
  analysis::CsvReader reader = open(path);
  std::vector<TimedPose> poses;
  std::vector<protocols::Fault> faults;
  std::size_t columns = 0;  // known from the header on
  while (faults.size() < kFaultsShown && reader.next()) {
    const std::string place = "line " + std::to_string(reader.line());
    if (!reader.fault().empty()) {
      faults.push_back({path, place, reader.fault()});
      continue;
    }
    if (columns == 0) {
      const std::string header = joined(reader.fields());
      const bool sides = header == std::string(kTrajectoryHeader) + kSideHeader;
      if (header != kTrajectoryHeader && !sides) {
        throw protocols::InputError(
            {{path, place,
              std::string("expected the header ") + kTrajectoryHeader +
                  (header.find("side") == std::string::npos
                       ? ""
                       : std::string(", with or without ") + kSideHeader + " after it")}});
      }
      columns = kPoseColumns + (sides ? kSideColumns : 0);
      continue;
    }
    const auto values = numbers_of(reader.fields(), columns);
    if (!values) {
      faults.push_back(
          {path, place,
           columns == kPoseColumns ? "expected seven numbers" : "expected ten numbers"});
      continue;
    }
    const auto& v = *values;
    if (!std::isfinite(v[0])) {
      faults.push_back({path, place, "expected a finite time"});
    } else if (!poses.empty() && v[0] <= poses.back().t) {
      faults.push_back({path, place, "expected a time later than that of the line before"});
    } else if (poses.size() == kMostPoses) {
      faults.push_back({path, place,
                        "expected at most " + std::to_string(kMostPoses) +
                            " rows; split the path into several files"});
      break;
    } else {
      poses.push_back(
          {v[0], {{v[1], v[2], v[3]}, {v[4], v[5], v[6]}}, {v[7], v[8], v[9]}, reader.line()});
    }
  }
  if (faults.size() == kFaultsShown) {
    faults.push_back({path, "further lines", "possibly more faults; only the first are shown"});
  } else if (!reader.fault().empty()) {
    faults.push_back({path, "line " + std::to_string(reader.line()), reader.fault()});
  }
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  if (poses.empty()) throw protocols::InputError({{path, "(file)", "expected at least one row"}});
  return poses;
}

ForceTable::ForceTable(bool tool)
    : tool_(tool),
      text_(std::string(kForceHeader) + (tool ? kToolHeader : "") + "faults\n"),
      seen_(rendering::kRenderFaults.size()) {}

void ForceTable::add(const TimedPose& pose, const rendering::Rendering& r) {
  ++rows_;
  append(text_, pose.t);
  for (const Vec3& v :
       {r.force, r.torque, r.ideal.tip, r.ideal.tail, r.deepest.point, r.device1, r.device2}) {
    append(text_, v);
  }
  text_ += ',';
  append(text_, r.deepest.depth);
  text_ += ',' + std::to_string(r.contacts) + ',' + rendering::to_string(r.deepest.type) + ',' +
           std::to_string(r.object);
  if (tool_) {
    text_ += ',' + std::to_string(r.segment);
    append(text_, r.ideal_side);
  }
  text_ += ',' + names_of(r.faults) + '\n';
  for (std::size_t i = 0; i < rendering::kRenderFaults.size(); ++i) {
    if ((r.faults & rendering::kRenderFaults[i].bit) == 0) continue;
    if (seen_[i].ticks++ == 0) seen_[i].first_line = pose.line;
  }
}

std::string ForceTable::warnings(const std::string& path) const {
  std::string out;
  for (std::size_t i = 0; i < rendering::kRenderFaults.size(); ++i) {
    if (seen_[i].ticks == 0) continue;
    out += path + ": warning: " + rendering::kRenderFaults[i].name + " in " +
           std::to_string(seen_[i].ticks) + " of " + std::to_string(rows_) +
           " rows, first on line " + std::to_string(seen_[i].first_line) + " (" +
           rendering::kRenderFaults[i].meaning + "); see the column 'faults'\n";
  }
  return out;
}

}  // namespace palpate::runner
