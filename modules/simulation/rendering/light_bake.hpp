#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "modules/simulation/rendering/ray_tracer.hpp"
#include "modules/simulation/rendering/sky.hpp"
#include "modules/simulation/rendering/surface_table.hpp"
#include "modules/simulation/world/world.hpp"

namespace km {

/// The six axis directions: +x, -x, +y, -y, +z, -z.
inline constexpr int kAxisDirections = 6;

/// Casts the rays behind LightVolume. Immutable, safe to use from several threads.
class LightBake {
 public:
  LightBake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
            const Sky& sky);

  struct Sample {
    std::array<float, kAxisDirections> ambient{};  ///< Irradiance of a surface facing there.
    std::vector<float> lamps;                      ///< Visible share of each.
    bool inside = false;                           ///< Of a solid: it must not light what is near.
  };

  /// At most kLanes points near each other: rays of the same direction run side by side.
  [[nodiscard]] std::vector<Sample> at(std::span<const Eigen::Vector3f> points) const;

 private:
  void add_surroundings(std::span<const Eigen::Vector3f> points,
                        std::vector<Sample>& samples) const;
  void add_lamps(std::span<const Eigen::Vector3f> points, std::vector<Sample>& samples) const;
  [[nodiscard]] LaneMask sunlit(LaneMask hits, const RayPacket& rays) const;
  [[nodiscard]] float reflected(const SurfaceRecord& surface, float distance_m, bool sunlit) const;

  const Lighting& lighting_;
  const RayTracer& tracer_;
  const SurfaceTable& surfaces_;
  const Sky& sky_;
  bool indoors_;
};

}  // namespace km
