#include "apps/lab/simulation/rendering/light_passages.hpp"

#include <algorithm>
#include <cmath>

#include "apps/lab/simulation/world/seeded_random.hpp"

namespace km {

LightPassages::LightPassages(const SensorEffectsConfig& config, double duration_s,
                             std::uint64_t seed) {
  checked(config);
  if (!(config.passage_every_s > 0.0) || config.passage_light == 1.0) return;
  SeededRandom random(seed);
  for (double at = 0.0;;) {
    // Intervals from half to one and a half of the mean; a passage ends before the next begins.
    at = std::max(at + config.passage_every_s * (0.5 + random.unit()),
                  passages_.empty() ? 0.0 : passages_.back().end_s);
    if (at > duration_s) return;
    const double sign = random.chance(0.5) ? 1.0 : -1.0;
    passages_.push_back({at, at + config.passage_s, sign * std::log(config.passage_light)});
  }
}

double LightPassages::factor(double t_s) const {
  for (const Passage& passage : passages_) {
    if (t_s < passage.begin_s || t_s > passage.end_s) continue;
    const double inside_s = std::min(t_s - passage.begin_s, passage.end_s - t_s);
    return std::exp(passage.log_light * std::min(1.0, inside_s / kRamp_s));
  }
  return 1.0;
}

}  // namespace km
