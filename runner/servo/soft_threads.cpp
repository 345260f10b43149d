#include "runner/servo/soft_threads.h"

#include <algorithm>
#include <utility>

#include "rendering/bodies/soft/soft_scene.h"

namespace palpate::runner::servo {
namespace {

constexpr int kBelowTheServo = 10;  // difference in priority

RealtimeSettings of_body(RealtimeSettings servo) {
  if (servo.priority > 0) servo.priority = std::max(1, servo.priority - kBelowTheServo);
  servo.lock_memory = false;  // the servo has requested it for the whole program
  servo.core = -1;            // leave the servo's processor to the servo
  servo.awake = false;
  return servo;
}

}  // namespace

SoftThread::SoftThread(std::shared_ptr<const rendering::SoftObject> object,
                       const RealtimeSettings& realtime)
    : object_(std::move(object)),
      realtime_(of_body(realtime)),
      view_(rendering::initial_state(*object_).view),
      body_(object_->body->rest()) {
  forces_.reserve(2 * object_->body->surface_nodes().size());
  snapshot_.now = view_.x;
  drawn_.fill(snapshot_);
  drawn_.write(snapshot_);
  sem_init(&asked_, 0, 0);
  thread_ = std::jthread([this] {
    request_realtime(realtime_);
    run();
  });
}

SoftThread::~SoftThread() {
  quit_.store(true);
  sem_post(&asked_);
  thread_.join();
  sem_destroy(&asked_);
}

void SoftThread::ask(std::span<const rendering::NodeForce> forces) noexcept {
  forces_.assign(forces.begin(), forces.end());  // capacity suffices for the largest number
  phase_.store(Phase::asked, std::memory_order_release);
  sem_post(&asked_);
}

bool SoftThread::take(rendering::SoftView& view) noexcept {
  std::swap(view, view_);
  const bool good = good_;
  phase_.store(Phase::idle, std::memory_order_relaxed);  // the servo's turn
  return good;
}

void SoftThread::run() noexcept {
  while (!quit_.load()) {
    while (sem_wait(&asked_) != 0) {  // interrupted by a signal
    }
    while (stalled_.load() && !quit_.load())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (phase_.load(std::memory_order_acquire) != Phase::asked) continue;
    good_ = step_and_look(*object_, body_, forces_, view_);
    snapshot_.now.assign(view_.x.begin(), view_.x.end());
    snapshot_.steps = body_.steps;
    phase_.store(Phase::made, std::memory_order_release);
    drawn_.write(snapshot_);
  }
}

SoftThreads::SoftThreads(const rendering::Scene& scene, const RealtimeSettings& realtime) {
  for (const auto& object : rendering::soft_objects(scene))
    threads_.push_back(std::make_unique<SoftThread>(object, realtime));
}

void SoftThreads::attach(rendering::RenderState& state) {
  std::vector<rendering::SoftStepper*> steppers;
  steppers.reserve(threads_.size());
  for (const auto& thread : threads_) steppers.push_back(thread.get());
  rendering::step_elsewhere(state, steppers);
}

}  // namespace palpate::runner::servo
