// Stands for liblsl: writes what it is told to the file that PALPATE_FAKE_LSL names.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>

namespace {

FILE* opened() {
  const char* path = std::getenv("PALPATE_FAKE_LSL");
  FILE* const file = path != nullptr ? std::fopen(path, "w") : nullptr;
  if (file == nullptr) std::abort();
  setvbuf(file, nullptr, _IOLBF, 0);
  return file;
}

}  // namespace

extern "C" {

void* lsl_create_streaminfo(const char* name, const char* type, std::int32_t channels, double rate,
                            int format, const char* source) {
  FILE* const file = opened();
  std::fprintf(file, "stream %s %s %d %g %d %s\n", name, type, channels, rate, format, source);
  return file;
}
void* lsl_create_outlet(void* info, std::int32_t, std::int32_t) { return info; }
double lsl_local_clock() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
std::int32_t lsl_push_sample_strt(void* outlet, const char** sample, double time) {
  std::fprintf(static_cast<FILE*>(outlet), "%.9f %s\n", time, sample[0]);
  return 0;
}
void lsl_destroy_outlet(void* outlet) { std::fprintf(static_cast<FILE*>(outlet), "outlet gone\n"); }
void lsl_destroy_streaminfo(void* info) { std::fprintf(static_cast<FILE*>(info), "info gone\n"); }

}  // extern "C"
