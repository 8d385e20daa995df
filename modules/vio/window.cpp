#include "modules/vio/window.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace km {

std::size_t frame_index(const Window& window, std::uint64_t id) {
  const auto it = std::lower_bound(window.frames.begin(), window.frames.end(), id,
                                   [](const WindowFrame& f, std::uint64_t v) { return f.id < v; });
  const auto index = static_cast<std::size_t>(it - window.frames.begin());
  return it != window.frames.end() && it->id == id ? index : window.frames.size();
}

std::vector<FirstEstimate> first_estimates(const Window& window) {
  std::vector<FirstEstimate> result(window.frames.size());
  for (std::size_t k = 0; k < window.prior.frames.size(); ++k) {
    FirstEstimate& estimate = result[frame_index(window, window.prior.frames[k])];
    estimate.pose = window.prior.linearization[k].T_odom_body;
    if (k == 0) estimate.motion = window.prior.linearization[k];
  }
  return result;
}

void observe(Window& window, const TrackedFrame& tracked) {
  std::vector<WindowLandmark> added;
  auto at = window.landmarks.begin();
  for (const TrackedFeature& feature : tracked.features) {  // both lists ascend: one pass
    const WindowObservation observation{window.frames.size() - 1, {feature.left, feature.right}};
    while (at != window.landmarks.end() && at->id < feature.id) ++at;
    if (at != window.landmarks.end() && at->id == feature.id)
      at->observations.push_back(observation);
    else
      added.push_back({feature.id, Eigen::Vector3d::Zero(), false, {observation}});
  }
  const auto middle = static_cast<std::ptrdiff_t>(window.landmarks.size());
  std::move(added.begin(), added.end(), std::back_inserter(window.landmarks));
  std::inplace_merge(window.landmarks.begin(), window.landmarks.begin() + middle,
                     window.landmarks.end(),
                     [](const auto& a, const auto& b) { return a.id < b.id; });
}

bool tracked_now(const Window& window, const WindowLandmark& landmark) {
  return !landmark.observations.empty() &&
         landmark.observations.back().frame + 1 == window.frames.size();
}

}  // namespace km
