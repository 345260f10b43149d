#include "runner/output/outputs.h"

#include <fcntl.h>
#include <unistd.h>

#include <boost/any.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "data/files/atomic_file.h"
#include "data/files/file_permissions.h"
#include "runner/usage_error.h"

namespace palpate::runner::output {
namespace {

namespace fs = std::filesystem;
namespace po = boost::program_options;

/// The paths of an option, if it was given.
std::vector<std::string> paths_of(const po::variables_map& values, const char* option) {
  if (values.count(option) == 0) return {};
  const auto& value = values[option].value();
  if (const auto* all = boost::any_cast<std::vector<std::string>>(&value)) return *all;
  return {values[option].as<std::string>()};
}

bool given(const po::variables_map& values, const char* option) {
  if (values.count(option) == 0) return false;
  const auto* flag = boost::any_cast<bool>(&values[option].value());  // value of a bool_switch
  return flag == nullptr || *flag;
}

void require_folder(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  if (::access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) == 0) return;
  throw std::runtime_error(path + ": cannot be written: " + std::generic_category().message(errno) +
                           "; check the folder and its permissions");
}

bool is_stream(const std::string& path) {
  std::error_code error;
  return path == "-" || data::descriptor_of_path(path) ||
         (fs::exists(path, error) && !fs::is_regular_file(path, error));
}

/// Makes writing to a closed pipe an error instead of ending the program.
class NoPipeSignal {
 public:
  NoPipeSignal() : before_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~NoPipeSignal() { std::signal(SIGPIPE, before_); }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  void (*before_)(int);
};

/// \param standard_output  where "-" goes
void stream_out(const std::string& path, int standard_output, std::string_view text) {
  std::cout.flush();  // keeps the order of the output
  const NoPipeSignal quiet;
  const auto named = path == "-" ? standard_output : data::descriptor_of_path(path);
  const int out = named ? *named : ::open(path.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
  int error = out < 0 ? errno : 0;
  while (error == 0 && !text.empty()) {
    const ssize_t written = ::write(out, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      error = errno;
    }
  }
  if (!named && out >= 0) ::close(out);
  if (error == 0) return;
  throw std::runtime_error(path + ": cannot be written: " + data::write_fault(error));
}

}  // namespace

void write_whole(const std::string& path, const std::string& text) {
  data::AtomicFile draft(path);
  draft.write(text);
  draft.sync();
  draft.commit(true);
}

Outputs::Outputs(const po::variables_map& values, std::initializer_list<const char*> options,
                 std::initializer_list<const char*> inputs, const char* folder)
    : values_(values), force_(given(values, "force")) {
  for (const char* input : inputs) {
    for (const std::string& path : paths_of(values, input)) {
      inputs_.add(path, std::string("--") + input + " reads it, so it must not be overwritten");
    }
  }
  for (const char* option : options) {
    for (const std::string& path : paths_of(values, option)) {
      outputs_.push_back({option, path, ""});
      if (path == "-") take_standard_output();
    }
  }
  if (folder != nullptr && wanted(folder)) {
    folder_option_ = std::string("--") + folder;
    folder_ = values[folder].as<std::string>();
    if (folder_.empty() || folder_ == "-") throw UsageError(folder_option_ + ": expected a folder");
    const std::string fault = data::resolve_trusted_links(folder_).fault;
    if (!fault.empty()) throw UsageError(folder_option_ + " " + folder_ + ": " + fault);
    if (fs::exists(folder_) && !fs::is_directory(folder_)) {
      throw UsageError(folder_option_ + " " + folder_ + ": expected a folder; this is a file");
    }
  }
  check();
}

void Outputs::take_standard_output() {
  if (standard_output_ >= 0) throw UsageError("-: two outputs cannot go to standard output");
  std::cout.flush();
  std::fflush(stdout);
  standard_output_ = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (standard_output_ < 0) throw std::runtime_error("-: standard output is closed");
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
}

Outputs::~Outputs() {
  if (standard_output_ < 0) return;
  std::cout.flush();
  std::fflush(stdout);
  ::dup2(standard_output_, STDOUT_FILENO);
  ::close(standard_output_);
}

void Outputs::protect_files(const stimuli::ObjectSpec& object) {
  inputs_.add(object.file, "it is a mesh that is read, so it must not be overwritten");
  for (const std::string& file : object.files_read)
    inputs_.add(file, object.file_name + " takes its data from it, so it must not be overwritten");
  if (object.texture && !object.texture->file.empty())
    inputs_.add(object.texture->file,
                "it is a texture that is read, so it must not be overwritten");
  for (const stimuli::ObjectSpec& part : object.parts) protect_files(part);
}

void Outputs::protect(const stimuli::ObjectSpec& object) {
  protect_files(object);
  check();
}

void Outputs::check() const {
  std::string faults;
  data::ProtectedFiles others;
  for (const Output& output : outputs_) {
    const std::string named = "--" + output.option + " " + output.path;
    if (output.path == "-") continue;
    std::string why = data::write_refusal(output.path, force_, inputs_);
    if (why.empty()) why = others.reason(output.path);
    if (!why.empty()) faults += (faults.empty() ? "" : "\n") + named + ": " + why;
    others.add(output.path, "--" + output.option + " writes the same file");
  }
  if (!faults.empty()) throw UsageError(faults);
  for (const Output& output : outputs_) {
    if (!is_stream(output.path)) require_folder(output.path);
  }
}

void Outputs::put(const std::string& option, std::string text) {
  for (Output& output : outputs_) {
    if (output.option != option) continue;
    output.text = std::move(text);
    return;
  }
}

void Outputs::put_into_folder(const std::string& name, std::string text) {
  if (folder_.empty()) return;
  outputs_.push_back(
      {folder_option_.substr(2), (fs::path(folder_) / name).string(), std::move(text)});
}

void Outputs::write() {
  std::error_code error;
  const bool made = !folder_.empty() && fs::create_directories(folder_, error);
  if (error)
    throw std::runtime_error(folder_ + ": cannot be made (" + error.message() +
                             "); check the permissions of the folder above");
  try {
    check();  // files may have changed in the meantime
    std::deque<data::AtomicFile> drafts;
    for (const Output& output : outputs_) {
      if (is_stream(output.path)) continue;
      data::AtomicFile& draft = drafts.emplace_back(output.path);
      draft.write(output.text);
      draft.sync();
    }
    for (const Output& output : outputs_) {
      if (is_stream(output.path)) stream_out(output.path, standard_output_, output.text);
    }
    data::commit_all(drafts, force_);
  } catch (...) {
    if (made) fs::remove(folder_, error);
    throw;
  }
}

}  // namespace palpate::runner::output
