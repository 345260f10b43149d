#include "runner/display/explore_clip.h"

#include <algorithm>
#include <iterator>

namespace palpate::runner {

ExploreClip::ExploreClip(const Timeline& timeline, const Camera& camera)
    : renderer_(SceneRenderer::live_quality()),
      animation_(kWide, kHigh),
      camera_(camera),
      from_(std::max(timeline.first(), timeline.now() - kSpan)),
      to_(timeline.now() > timeline.first() ? timeline.now()
                                            : std::min(timeline.last(), from_ + kSpan)),
      next_(from_) {
  camera_.resize(kWide, kHigh);
}

std::optional<std::string> ExploreClip::go_on(const Timeline& timeline, const Draw& draw,
                                              const Theme& theme) {
  const auto& moments = timeline.moments();
  const auto after = std::ranges::upper_bound(moments, next_, {}, time_of);
  if (after != moments.begin()) {
    renderer_.draw(draw(*std::prev(after)), camera_, theme, kWide, kHigh);
    animation_.add(renderer_.pixels(), next_ - from_);
    next_ += kEvery;
  } else {
    next_ = moments.empty() ? to_ + kEvery : time_of(moments.front());  // dropped meanwhile
  }
  if (next_ <= to_) return std::nullopt;
  return animation_.finish(std::max(next_ - from_, kEvery));
}

double ExploreClip::done() const {
  return to_ > from_ ? std::clamp((next_ - from_) / (to_ - from_), 0.0, 1.0) : 1;
}

}  // namespace palpate::runner
