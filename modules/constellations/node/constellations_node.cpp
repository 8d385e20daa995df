#include "modules/constellations/node/constellations_node.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kInputs = 4096;
constexpr double kMatchTick_s = 0.02;

// Pause after a match, as a multiple of the time that it takes.
constexpr double kMatchPauses = 10.0;

std::string text_of(const ConstellationSearch::Counts& counts) {
  std::string text;
  for (const auto& [status, count] : counts)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + to_string(status);
  return text;
}

}  // namespace

ConstellationsNode::ConstellationsNode(RobotId self, const ConstellationsTopics& topics)
    : WorkerNode({.name = "constellations",
                  .queue = kInputs,
                  .tick_s = kMatchTick_s,
                  .in_background = true}),
      found_(topics.found),
      outcomes_(topics.outcomes),
      search_(self) {
  const auto queue = [this](const auto& message) { count_and_post(message); };
  topics.own_objects.subscribe(queue);
  topics.peer_objects.subscribe(queue);
  topics.closures.subscribe(queue);
  topics.restarts.subscribe(queue);
}

void ConstellationsNode::count_and_post(Input input) {
  ++posted_;
  post(std::move(input));
}

void ConstellationsNode::step(const Input& input, double now_s) {
  if (std::holds_alternative<Tick>(input)) return search(now_s);
  if (const auto* objects = std::get_if<Topic<RobotObjects>::Message>(&input))
    search_.add(**objects, now_s);
  else if (const auto* closure = std::get_if<Topic<Closure>::Message>(&input))
    search_.add(**closure);
  else if (const auto& event = std::get<Topic<PeerEvent>::Message>(input);
           event->kind == PeerEventKind::kRestarted)
    search_.forget(event->identity.robot);
  search_done_ = search_.is_done();
  ++handled_;
}

void ConstellationsNode::search(double now_s) {
  if (now_s < next_s_ || search_.is_done()) return;
  const double start_s = steady_now_s();
  std::optional<Closure> closure = search_.step(now_s);
  next_s_ = now_s + kMatchPauses * (steady_now_s() - start_s);
  if (closure) {
    const double sigma_m = std::sqrt(closure->covariance.bottomRightCorner<3, 3>().trace() / 3.0);
    log::info(name()) << to_string(closure->from.id) << " and " << to_string(closure->to.id)
                      << " see " << closure->inliers << " equal objects, standard deviation "
                      << std::lround(100.0 * sigma_m)
                      << " cm; searches so far: " << text_of(search_.counts());
    outcomes_.publish(ClosureOutcome{.id = closure->id(),
                                     .similarity = 0.0,
                                     .stage = ClosureStage::kVerified,
                                     .reason = {},
                                     .matches = closure->inliers,
                                     .inliers = closure->inliers});
    closure->inliers = 0;  // not stated: its test is stricter than one of a place that looks alike
    found_.publish(*closure);
  }
  search_done_ = search_.is_done();
}

}  // namespace km
