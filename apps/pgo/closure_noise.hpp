#pragma once

#include <optional>
#include <string>
#include <vector>

#include "modules/pose_graph/robust/noise_scale.hpp"
#include "modules/pose_graph/team/team_graph.hpp"

namespace km {

/// How noisy the closures of a graph are taken to be.
struct NoiseModel {
  enum class Source {
    kGiven,     ///< `scale` times as noisy as the graph says.
    kLarger,    ///< As noise_scale() finds, if that is more than the graph says.
    kEstimated  ///< As noise_scale() finds.
  };
  Source source = Source::kGiven;
  double scale = 1.0;  ///< kGiven only.

  /// True if the graph is believed.
  [[nodiscard]] bool nominal() const { return source == Source::kGiven && scale == 1.0; }
};

/// Of "off", "larger", "any", or a number from 0.01 to 1000; nullopt for anything else.
[[nodiscard]] std::optional<NoiseModel> parse_noise_model(const std::string& text);

/// What came of it.
struct ClosureNoise {
  double scale = 1.0;                  ///< Sigmas are taken to be so many times those of the graph.
  std::optional<NoiseScale> estimate;  ///< nullopt: not asked for, or too few closures to tell.
};

/// `odometry` marks the edges that are no closures.
[[nodiscard]] ClosureNoise closure_noise(const TeamGraph& graph, const std::vector<bool>& odometry,
                                         const NoiseModel& model);

}  // namespace km
