#include "runner/python/arrays.h"

#include <algorithm>
#include <string>

#include "protocols/parse.h"

namespace palpate::runner {
namespace {

namespace py = pybind11;

py::object array_of(const std::vector<double>& cells) {
  return py::array_t<double>(static_cast<py::ssize_t>(cells.size()), cells.data());
}

py::object array_of(const std::vector<std::int64_t>& cells) {
  return py::array_t<std::int64_t>(static_cast<py::ssize_t>(cells.size()), cells.data());
}

py::object array_of(const std::vector<std::uint8_t>& cells) {
  py::array_t<bool> out(static_cast<py::ssize_t>(cells.size()));
  std::transform(cells.begin(), cells.end(), out.mutable_data(),
                 [](std::uint8_t cell) { return cell != 0; });
  return out;
}

py::object array_of(const std::vector<std::string>& cells) {
  return py::module_::import("numpy").attr("array")(py::cast(cells), py::arg("dtype") = "U");
}

}  // namespace

py::dict arrays_of(const data::ColumnTable& table) {
  py::dict out;
  for (const data::ColumnTable::Column& column : table.columns()) {
    out[py::str(column.name)] =
        std::visit([](const auto& cells) { return array_of(cells); }, column.cells);
  }
  return out;
}

std::vector<commands::TimedPose> poses_of(const std::vector<Coordinates>& columns) {
  constexpr std::size_t kFaultsShown = 20;
  std::vector<protocols::Fault> faults;
  const py::ssize_t rows = columns.at(0).size();
  for (const Coordinates& column : columns) {
    if (column.ndim() != 1 || column.size() != rows)
      throw protocols::InputError(
          {{"trajectory", "(columns)", "expected one-dimensional arrays of one length"}});
  }
  if (rows == 0)
    throw protocols::InputError({{"trajectory", "(columns)", "expected at least one row"}});
  std::vector<commands::TimedPose> poses;
  for (py::ssize_t i = 0; i < rows && faults.size() < kFaultsShown; ++i) {
    const auto at = [&](std::size_t column) { return columns[column].data()[i]; };
    commands::TimedPose pose{at(0), {{at(1), at(2), at(3)}, {at(4), at(5), at(6)}}};
    if (columns.size() > 7) pose.side = {at(7), at(8), at(9)};
    pose.line = static_cast<std::size_t>(i);
    if (const std::string fault = commands::fault_of(pose, poses); !fault.empty()) {
      faults.push_back({"trajectory", "row " + std::to_string(i), fault});
      if (poses.size() == commands::kMostPoses) break;
    } else {
      poses.push_back(pose);
    }
  }
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  return poses;
}

}  // namespace palpate::runner
