#include "modules/vio/window_sliding.hpp"

#include <algorithm>
#include <vector>

#include "modules/vio/window_equations.hpp"

namespace km {

namespace {

bool seen_by_oldest(const WindowLandmark& landmark) {
  return landmark.located && landmark.observations.front().frame == 0;
}

// The frames that the marginalisation of the oldest concerns, it included.
std::vector<std::size_t> concerned_frames(const Window& window) {
  std::vector<bool> concerned(window.frames.size(), false);
  concerned[0] = concerned[1] = true;
  for (const std::uint64_t id : window.prior.frames) concerned[frame_index(window, id)] = true;
  for (const WindowLandmark& landmark : window.landmarks) {
    if (!seen_by_oldest(landmark)) continue;
    for (const WindowObservation& o : landmark.observations)
      if (window.frames[o.frame].keyframe) concerned[o.frame] = true;
  }
  std::vector<std::size_t> frames;
  for (std::size_t k = 0; k < concerned.size(); ++k)
    if (concerned[k]) frames.push_back(k);
  return frames;
}

// The prior that the oldest frame leaves.
StatePrior prior_after_oldest(const Window& window) {
  WindowEquations equations(window, 0.0);
  equations.add_prior();
  equations.add_imu(1);
  for (const WindowLandmark& landmark : window.landmarks)
    if (seen_by_oldest(landmark)) equations.add_landmark(landmark, true);

  const std::vector<FirstEstimate> held = first_estimates(window);
  std::vector<Eigen::Index> variables;
  std::vector<const OdometryState*> states;
  StatePrior prior;
  for (const std::size_t k : concerned_frames(window)) {
    for (Eigen::Index v = 0; v < (k <= 1 ? 15 : 6); ++v)
      variables.push_back(15 * static_cast<Eigen::Index>(k) + v);
    if (k == 0) continue;
    const WindowFrame& frame = window.frames[k];
    states.push_back(&frame.state);
    prior.frames.push_back(frame.id);
    prior.linearization.push_back(held[k].applied_to(frame.state));
  }
  const Eigen::MatrixXd full = equations.H().selfadjointView<Eigen::Lower>();
  const SquareRootPrior root =
      marginalize(full(variables, variables), equations.g()(variables), 15);
  prior.J = root.J;
  // The gradient was taken at the current states; the prior counts from the first estimates.
  prior.r = root.r - root.J * prior_offset(prior, states);
  return prior;
}

}  // namespace

void forget_frame(Window& window, std::size_t frame) {
  window.frames.erase(window.frames.begin() + static_cast<std::ptrdiff_t>(frame));
  for (WindowLandmark& landmark : window.landmarks) {
    std::erase_if(landmark.observations, [&](const auto& o) { return o.frame == frame; });
    for (WindowObservation& o : landmark.observations) o.frame -= o.frame > frame;
  }
  std::erase_if(window.landmarks, [](const auto& l) { return l.observations.empty(); });
}

void marginalize_oldest(Window& window) {
  window.frames[1].keyframe = true;  // in the prior: it can only leave by marginalisation
  window.prior = prior_after_oldest(window);
  for (WindowLandmark& landmark : window.landmarks) {
    if (!seen_by_oldest(landmark)) continue;
    std::erase_if(landmark.observations,  // what the prior has used must not count again
                  [&](const auto& o) { return window.frames[o.frame].keyframe; });
    landmark.located = false;
  }
  std::erase_if(window.landmarks, [](const auto& l) { return l.observations.empty(); });
  forget_frame(window, 0);
}

}  // namespace km
