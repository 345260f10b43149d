// A fake liblsl: writes its input to the file named by PALPATE_FAKE_LSL; a stream of numbers to the
// file beside it that ends in .samples.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

namespace {

FILE* opened(bool numbers) {
  const char* path = std::getenv("PALPATE_FAKE_LSL");
  const std::string name = std::string(path != nullptr ? path : "") + (numbers ? ".samples" : "");
  FILE* const file = path != nullptr ? std::fopen(name.c_str(), "w") : nullptr;
  if (file == nullptr) std::abort();
  setvbuf(file, nullptr, _IOLBF, 0);
  return file;
}

}  // namespace

extern "C" {

void* lsl_create_streaminfo(const char* name, const char* type, std::int32_t channels, double rate,
                            int format, const char* source) {
  constexpr int kDouble = 2;
  FILE* const file = opened(format == kDouble);
  std::fprintf(file, "stream %s %s %d %g %d %s\n", name, type, channels, rate, format, source);
  return file;
}
// The description: the appended elements, in order.
void* lsl_get_desc(void* info) { return info; }
void* lsl_append_child(void* element, const char* name) {
  std::fprintf(static_cast<FILE*>(element), "<%s>\n", name);
  return element;
}
void* lsl_append_child_value(void* element, const char* name, const char* value) {
  std::fprintf(static_cast<FILE*>(element), "%s=%s\n", name, value);
  return element;
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
std::int32_t lsl_push_chunk_dtn(void* outlet, const double* values, unsigned long count,
                                const double* times) {
  constexpr unsigned long kChannels = 20;
  FILE* const file = static_cast<FILE*>(outlet);
  if (count == 0 || count % kChannels != 0) std::abort();
  if (std::getenv("PALPATE_FAKE_LSL_REFUSES") != nullptr) return -1;
  std::fprintf(file, "chunk %lu\n", count / kChannels);
  for (unsigned long row = 0; row < count / kChannels; ++row) {
    std::fprintf(file, "%.9f", times[row]);
    for (unsigned long i = 0; i < kChannels; ++i)
      std::fprintf(file, " %.17g", values[row * kChannels + i]);
    std::fprintf(file, "\n");
  }
  return 0;
}
void lsl_destroy_outlet(void* outlet) { std::fprintf(static_cast<FILE*>(outlet), "outlet gone\n"); }
void lsl_destroy_streaminfo(void* info) { std::fprintf(static_cast<FILE*>(info), "info gone\n"); }

}  // extern "C"
