#include "runner/display/explore_clip.h"

#include <algorithm>
#include <iterator>

namespace palpate::runner {

ExploreClip::ExploreClip(const Timeline& timeline, const Camera& camera)
    : renderer_(SceneRenderer::live_quality()), animation_(kWide, kHigh), camera_(camera) {
  camera_.resize(kWide, kHigh);
  const double from = std::max(timeline.first(), timeline.now() - kSpan);
  const double to =
      timeline.now() > timeline.first() ? timeline.now() : std::min(timeline.last(), from + kSpan);
  const auto& all = timeline.moments();
  for (int i = 0; from + i * kEvery <= to; ++i) {
    const auto after = std::ranges::upper_bound(all, from + i * kEvery, {}, time_of);
    moments_.push_back(after != all.begin() ? *std::prev(after) : all.front());
  }
}

bool ExploreClip::go_on(const Draw& draw, const Theme& theme) {
  if (drawn_ < moments_.size()) {
    renderer_.draw(draw(moments_[drawn_]), camera_, theme, kWide, kHigh);
    animation_.add(renderer_.pixels(), static_cast<double>(drawn_) * kEvery);
    ++drawn_;
  }
  return drawn_ == moments_.size();
}

double ExploreClip::done() const {
  return moments_.empty() ? 1 : static_cast<double>(drawn_) / static_cast<double>(moments_.size());
}

std::string ExploreClip::finish() {
  return drawn_ > 0 ? animation_.finish(static_cast<double>(drawn_) * kEvery) : std::string();
}

}  // namespace palpate::runner
