// Prints schedules of some designs, for comparison between compilers. Needs no JSON.

#include <cstdio>

#include "protocols/schedule.h"
#include "protocols/session_plan.h"

using namespace palpate;
using namespace palpate::protocols;

namespace {

/// Schedules are drawn without one.
class NoRule final : public OrderRule {
 public:
  SessionSequences sequences(const Protocol&, int, int) const override { return {}; }
  const char* conditions_in_words() const override { return ""; }
  std::vector<std::string> conditions(const Protocol&, int) const override { return {}; }
  std::string condition_of(const std::string&, const std::string&) const override { return {}; }
};

}  // namespace

/// Instead of session_plan.cpp, which needs JSON.
const OrderRule& palpate::protocols::order_of_blocks() {
  static const NoRule rule;
  return rule;
}

int main() {
  Protocol protocol;
  protocol.renderers = {RendererKind::point, RendererKind::ray};
  for (const char* name : {"sphere", "cone", "cylinder", "cube"}) {
    protocol.stimuli.push_back({name, {}});
  }
  protocol.repetitions = 38;
  protocol.blocks_per_renderer = 2;
  protocol.seed = 2000;
  protocol.sessions = {3, std::nullopt, 5};
  protocol.practice.repetitions = 2;
  for (const RendererOrder order : {RendererOrder::counterbalanced, RendererOrder::interleaved}) {
    for (const int max_run : {1, 3}) {  // constructed; drawn
      protocol.renderer_order = order;
      protocol.order.max_run = max_run;
      for (int participant = 1; participant <= 3; ++participant) {
        for (const Trial& t : schedule(protocol, participant)) {
          const Quat& q = t.orientation;
          std::printf("%d %d %d %s %d %.17g %.17g %.17g %.17g\n", t.session, t.block, t.trial,
                      to_string(t.renderer), t.stimulus, q.w, q.x, q.y, q.z);
        }
      }
    }
  }
}
