#include "apps/pgo/closure_noise.hpp"

#include <algorithm>
#include <charconv>

namespace km {

std::optional<NoiseModel> parse_noise_model(const std::string& text) {
  using Source = NoiseModel::Source;
  if (text == "off") return NoiseModel{};
  if (text == "larger") return NoiseModel{.source = Source::kLarger};
  if (text == "any") return NoiseModel{.source = Source::kEstimated};
  NoiseModel model;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, model.scale);
  if (error != std::errc() || end != last || !(model.scale >= 0.01 && model.scale <= 1000.0))
    return std::nullopt;
  return model;
}

ClosureNoise closure_noise(const TeamGraph& graph, const std::vector<bool>& odometry,
                           const NoiseModel& model) {
  if (model.source == NoiseModel::Source::kGiven) return {.scale = model.scale, .estimate = {}};
  ClosureNoise noise{.scale = 1.0, .estimate = noise_scale(graph, odometry)};
  if (!noise.estimate) return noise;
  noise.scale = noise.estimate->scale;
  if (model.source == NoiseModel::Source::kLarger) noise.scale = std::max(1.0, noise.scale);
  return noise;
}

}  // namespace km
