#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "apps/lab/simulation/rendering/lanes.hpp"
#include "apps/lab/simulation/rendering/ray_tracer.hpp"
#include "apps/lab/simulation/rendering/sky.hpp"
#include "apps/lab/simulation/rendering/surfaces.hpp"
#include "apps/lab/simulation/world/world.hpp"

namespace km {

/// The six axis directions: +x, -x, +y, -y, +z, -z.
inline constexpr int kAxisDirections = 6;

/// Ambient light, computed once on a lattice near the surfaces. For each of the six axis directions
/// it has the irradiance of a surface facing there, from the sky and the lit surroundings, and the
/// visible share of each lamp. Between lattice points it is interpolated. Corners and contacts are
/// dark because their surroundings reflect little light. Immutable.
class LightVolume {
 public:
  static constexpr int kMaxLamps = 10;

  struct Light {
    Lanes ambient;                                 ///< Irradiance.
    std::array<Lanes, kMaxLamps> lamp_visibility;  ///< 0 to 1; only the lamps of the world are set.
  };

  /// Precondition: at most kMaxLamps lamps.
  LightVolume(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
              const Sky& sky);

  /// Light at points of surfaces; `normals` point to the lit sides and have unit length.
  void look_up(const Lanes3& points, const Lanes3& normals, Light& light) const;

 private:
  static constexpr float kLift =
      0.5F;  // distance before the surface at which light is looked up [cells]
  // A brick holds kBrick^3 cells, so (kBrick + 1)^3 samples: the last ones repeat those of the next
  // brick, so that a lookup stays within one brick.
  static constexpr int kBrick = 8;
  static constexpr int kSide = kBrick + 1;
  static constexpr std::size_t kBrickSamples = std::size_t{kSide} * kSide * kSide;

  void lay_out(const World& world);
  [[nodiscard]] std::vector<std::uint8_t> mark(const SurfaceMesh& mesh,
                                               const SurfaceTable& surfaces);
  void bake(const World& world, const RayTracer& tracer, const SurfaceTable& surfaces,
            const Sky& sky, const std::vector<std::uint8_t>& wanted);
  [[nodiscard]] std::vector<Eigen::Vector3f> brick_corners() const;
  [[nodiscard]] Eigen::Vector3f position(const std::vector<Eigen::Vector3f>& corners,
                                         std::size_t sample) const;
  void fill_from_neighbours(std::vector<std::uint8_t>& known);
  /// Cells of lookups: the lowest corner of a cell, and the position relative to it.
  struct Cells {
    IntLanes brick;   ///< Index in brick_index_; -1: outside of it.
    IntLanes corner;  ///< Sample within the brick.
    Lanes3 share;
  };
  void find_cells(const Lanes3& points, const Lanes3& normals, Cells& cells) const;
  void interpolate(const Cells& cells, const Lanes3& normals, Light& light) const;

  float cell_m_ = 0.5F;
  float per_cell_ = 2.0F;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i bricks_ = Eigen::Vector3i::Zero();  ///< Along each axis.
  std::vector<std::int32_t> brick_index_;             ///< -1: no surface near.
  /// A sample is six directions, then the lamps.
  static constexpr std::size_t kSampleBytes = 16;
  static_assert(kAxisDirections + kMaxLamps == kSampleBytes);
  std::vector<std::uint8_t> samples_;
  int lamps_ = 0;
  float ambient_scale_ = 1.0F;  ///< Irradiance of one step of 8 bit.
  float open_ambient_ = 0.0F;   ///< Ambient light outside all bricks.
};

}  // namespace km
