// The part of the Python module `palpate` that is compiled: what the commands simulate, render and
// schedule do, in memory. palpate/__init__.py is what users see.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "data/base/text.h"
#include "data/column_table.h"
#include "data/export/trial_table.h"
#include "data/store/store.h"
#include "protocols/parse.h"
#include "runner/session/simulated_study.h"
#include "runner/study/schedule_text.h"
#include "runner/study/simulation_limits.h"
#include "runner/touch/forces.h"
#include "runner/usage_error.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner {
namespace {

namespace py = pybind11;

// Between tables of the program and arrays of numpy.

using Coordinates = py::array_t<double, py::array::c_style | py::array::forcecast>;

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

/// A dict of column name -> one-dimensional array: float64, int64, bool or text.
py::dict arrays_of(const data::ColumnTable& table) {
  py::dict out;
  for (const data::ColumnTable::Column& column : table.columns()) {
    out[py::str(column.name)] =
        std::visit([](const auto& cells) { return array_of(cells); }, column.cells);
  }
  return out;
}

/// \param columns  t (s), tip and tail (m) and, with ten, the tool's +x, each of one length.
/// \throws protocols::InputError naming what is wrong, as read_trajectory does of a file
std::vector<touch::TimedPose> poses_of(const std::vector<Coordinates>& columns) {
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
  std::vector<touch::TimedPose> poses;
  for (py::ssize_t i = 0; i < rows && faults.size() < kFaultsShown; ++i) {
    const auto at = [&](std::size_t column) { return columns[column].data()[i]; };
    touch::TimedPose pose{at(0), {{at(1), at(2), at(3)}, {at(4), at(5), at(6)}}};
    if (columns.size() > 7) pose.side = {at(7), at(8), at(9)};
    pose.line = static_cast<std::size_t>(i);
    if (const std::string fault = touch::fault_of(pose, poses); !fault.empty()) {
      faults.push_back({"trajectory", "row " + std::to_string(i), fault});
      if (poses.size() == touch::kMostPoses) break;
    } else {
      poses.push_back(pose);
    }
  }
  if (!faults.empty()) throw protocols::InputError(std::move(faults));
  return poses;
}

/// A JSON document: its text, and the file that faults name and that files are beside.
struct Document {
  std::string text, file;
};

/// Ctrl-C while the interpreter's lock is released: asks the interpreter every tenth of a second.
class Interruption {
 public:
  /// \throws py::error_already_set: KeyboardInterrupt
  void check() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    const py::gil_scoped_acquire lock;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

protocols::Protocol parse(const Document& protocol) {
  return protocols::parse_protocol_text(protocol.text, protocol.file);
}

/// \return columns, sentences about materials that were limited
py::tuple simulate(const Document& given, const std::string& settings_text, int participants,
                   std::uint64_t seed) {
  data::TrialTable trials;
  std::vector<std::string> limited;
  {
    const py::gil_scoped_release unlocked;
    study::check_simulated_participants(participants);
    protocols::Protocol protocol = parse(given);
    const participants::SimulatedSettings settings =
        participants::read_simulated_settings(settings_text);
    limited = study::fit_to_simulation(protocol, settings).texts;
    Interruption interruption;
    const std::atomic<bool> stop{false};  // an exception ends it
    session::simulate_in_memory(
        protocol, settings, session::first_numbers(participants), seed, stop,
        [&](int number, const data::TrialRecord& record, std::uint64_t) {
          data::StoredTrial trial;
          trial.participant.code = session::simulated_code(number);
          trial.participant.number = number;
          trial.participant.enrolled_number = number;
          trial.participant.simulated = true;
          trial.participant.seed = seed;
          trial.protocol_name = protocol.name;
          trial.protocol_sha256 = protocol.sha256;
          trial.run = session::simulated_run(protocol, settings, number, record.session);
          trial.record = record;
          trials.add(trial);
          interruption.check();
        });
  }
  return py::make_tuple(arrays_of(trials.table()), limited);
}

py::dict render(const Document& given, const std::vector<touch::TimedPose>& poses,
                const std::string& renderer_name) {
  std::unique_ptr<data::ColumnTable> table;
  {
    const py::gil_scoped_release unlocked;
    const rendering::Renderer& renderer = touch::renderer_named(renderer_name);
    const protocols::SceneSpec spec = protocols::parse_scene_text(given.text, given.file);
    SceneBuilder builder;
    const rendering::Scene scene = touch::build_scene(builder, given.file, spec, renderer);
    const bool tool = scene.tool() != nullptr;
    table = std::make_unique<data::ColumnTable>(touch::force_columns(tool));
    Interruption interruption;
    touch::render_along(scene, spec, renderer, poses,
                        [&](const touch::TimedPose& pose, const rendering::Rendering& rendering,
                            const rendering::RenderState&) {
                          touch::put_forces(*table, pose.t, rendering, tool);
                          interruption.check();
                        });
  }
  return arrays_of(*table);
}

py::dict schedule(const Document& given, int participant) {
  study::check_participant_number(participant);
  const protocols::Protocol protocol = parse(given);
  data::ColumnTable table(study::schedule_columns());
  for (const protocols::Trial& trial : protocols::schedule(protocol, participant))
    study::put_scheduled(table, protocol, trial, participant);
  return arrays_of(table);
}

/// The program prints these with status 2; \return false: another kind
bool is_bad_input(const std::exception& error) {
  return dynamic_cast<const UsageError*>(&error) != nullptr ||
         dynamic_cast<const protocols::InputError*>(&error) != nullptr ||
         dynamic_cast<const stimuli::MeshError*>(&error) != nullptr ||
         dynamic_cast<const data::StoreRefused*>(&error) != nullptr;
}

}  // namespace

PYBIND11_MODULE(_palpate, module) {
  module.attr("__version__") = PALPATE_VERSION;
  module.attr("DEFAULT_VERSION") = participants::kDefaultParticipantVersion;
  static const py::exception<UsageError> input_error(module, "InputError", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const std::exception& error) {
      if (!is_bad_input(error)) throw;  // pybind11 knows what becomes of it
      PyErr_SetString(input_error.ptr(), printable_lines(error.what()).c_str());
    }
  });
  py::class_<Document>(module, "Document")
      .def(py::init<std::string, std::string>(), py::arg("text"), py::arg("file"));
  // Names and order are those of _palpate.pyi.
  module.def("simulate", &simulate, py::arg("protocol"), py::arg("settings"),
             py::arg("participants"), py::arg("seed"));
  module.def(
      "render",
      [](const Document& scene, const std::vector<Coordinates>& trajectory,
         const std::string& renderer) { return render(scene, poses_of(trajectory), renderer); },
      py::arg("scene"), py::arg("trajectory"), py::arg("renderer"));
  module.def(
      "render_file",
      [](const Document& scene, const std::string& trajectory, const std::string& renderer) {
        return render(scene, touch::read_trajectory(trajectory), renderer);
      },
      py::arg("scene"), py::arg("trajectory"), py::arg("renderer"));
  module.def("schedule", &schedule, py::arg("protocol"), py::arg("participant"));
  module.def(
      "settings", [](int version) { return participants::simulated_settings_text("", version); },
      py::arg("version"));
  module.def("read", &protocols::read_scene_text, py::arg("path"));
}

}  // namespace palpate::runner
