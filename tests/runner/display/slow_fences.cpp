// Preloaded into a program that draws with Mesa's software driver: delays each drawing thread's
// signal that it has finished, as if another program had taken its processor. Memory freed too
// early is then still in use (runner/display/scene/scene_renderer.h, finish_target).

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <cstring>

extern "C" __attribute__((visibility("default"))) int pthread_cond_broadcast(
    pthread_cond_t* condition) noexcept {
  using Broadcast = int (*)(pthread_cond_t*);
  static const auto real = reinterpret_cast<Broadcast>(dlsym(RTLD_NEXT, "pthread_cond_broadcast"));
  char name[16] = "";
  pthread_getname_np(pthread_self(), name, sizeof name);
  if (std::strncmp(name, "llvmpipe-", 9) == 0) usleep(1000);
  return real(condition);
}
