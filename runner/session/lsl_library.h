#pragma once
// liblsl, loaded at run time: Debian has no package for it, and its wire protocol is not specified.

#include <dlfcn.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace palpate::runner::session {

/// Stays loaded until the program ends: it has threads of its own.
class LslLibrary {
 public:
  /// \param user  named in messages, such as "markers to lsl". \throws std::runtime_error if liblsl
  /// is not installed
  explicit LslLibrary(std::string user) : user_(std::move(user)) {
    for (const char* library : {"liblsl.so.2", "liblsl.so", "liblsl.so.1"}) {
      handle_ = dlopen(library, RTLD_NOW | RTLD_LOCAL);
      if (handle_ != nullptr) return;
    }
    fail("liblsl is not installed (liblsl.so was not found)");
  }

  /// \throws std::runtime_error if the library lacks the function
  template <class Function>
  void find(Function*& function, const char* name) const {
    function = reinterpret_cast<Function*>(dlsym(handle_, name));
    if (function == nullptr) fail(std::string("liblsl has no ") + name);
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(user_ + ": " + why);
  }

 private:
  const std::string user_;
  void* handle_ = nullptr;
};

}  // namespace palpate::runner::session
